"""A rack's memory and its running tasks: memory, task, scheduler, error log."""

from __future__ import annotations

from typing import TYPE_CHECKING

from automax_ros.core.face import face

if TYPE_CHECKING:
    from automax_ros.running.backplane import Backplane, Bank
    from automax_ros.running.error_log import ErrorLog, LogEntry
    from automax_ros.running.health import Health
    from automax_ros.running.memory import CommonMemory
    from automax_ros.running.pacer import Pacer
    from automax_ros.running.private_image import PrivateImage
    from automax_ros.running.scheduler import EventClass, EventKey, Scheduler
    from automax_ros.running.task import ScanRecord, Status, Task
    from automax_ros.running.views import Memory, MemoryValueError, ViewSpec, Write, WriteGroup

__all__ = [
    "Backplane",
    "Bank",
    "CommonMemory",
    "ErrorLog",
    "EventClass",
    "EventKey",
    "Health",
    "LogEntry",
    "Memory",
    "MemoryValueError",
    "Pacer",
    "PrivateImage",
    "ScanRecord",
    "Scheduler",
    "Status",
    "Task",
    "ViewSpec",
    "Write",
    "WriteGroup",
]

__getattr__ = face(
    __name__, "backplane", "views", "memory", "private_image", "scheduler", "pacer", "error_log", "health", "task"
)
