"""Recordings: messages to and from rosbag2 folders, without ROS."""

from __future__ import annotations

from typing import TYPE_CHECKING

from automax_ros.core.face import face

if TYPE_CHECKING:
    from automax_ros.bags.errors import BagError, RecordingError
    from automax_ros.bags.export import export_csv
    from automax_ros.bags.info import bag_info
    from automax_ros.bags.reader import BagMessage, BagReader
    from automax_ros.bags.recorder import Recorder, RecordingOptions
    from automax_ros.bags.storage import StorageOptions

__all__ = [
    "BagError",
    "BagMessage",
    "BagReader",
    "Recorder",
    "RecordingError",
    "RecordingOptions",
    "StorageOptions",
    "bag_info",
    "export_csv",
]

__getattr__ = face(__name__, "errors", "reader", "info", "recorder", "storage", "export")
