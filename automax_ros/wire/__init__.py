"""The messages of a rack: definitions, CDR, quality of service, the stream that nodes and recordings share."""

from __future__ import annotations

from typing import TYPE_CHECKING

from automax_ros.core.face import face

if TYPE_CHECKING:
    from automax_ros.wire.cdr import CdrError, decode, encode
    from automax_ros.wire.messages import (
        CommonImage,
        CommonWrite,
        JointState,
        PlantState,
        Scan,
        TaskState,
        VariableTable,
    )
    from automax_ros.wire.qos import QosProfile
    from automax_ros.wire.rack_files import RackFile
    from automax_ros.wire.stream import RackStream
    from automax_ros.wire.topics import Topic

__all__ = [
    "CdrError",
    "CommonImage",
    "CommonWrite",
    "JointState",
    "PlantState",
    "QosProfile",
    "RackFile",
    "RackStream",
    "Scan",
    "TaskState",
    "Topic",
    "VariableTable",
    "decode",
    "encode",
]

__getattr__ = face(__name__, "qos", "cdr", "messages", "topics", "rack_files", "stream")
