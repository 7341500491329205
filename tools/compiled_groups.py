"""The list of the modules that are compiled ahead of time."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PACKAGE = ROOT / "automax_ros"


@dataclass(frozen=True)
class Group:
    """Modules that are translated together: calls inside a group are C calls, those out of it Python calls.

    ``folders`` are included with all files below them, except ``without`` (files, relative to the package); ``files``
    are single ones. A group is loaded whole or not at all (decision): its modules depend on each other's memory layout.
    """

    name: str
    folders: tuple[str, ...] = ()
    files: tuple[str, ...] = ()
    without: tuple[str, ...] = ()

    def sources(self) -> list[Path]:
        """Return the files of the group, in the order of their names; ``__init__`` files stay plain."""
        found = {path for folder in self.folders for path in (PACKAGE / folder).rglob("*.py")}
        found |= {PACKAGE / file for file in self.files}
        left = found - {PACKAGE / file for file in self.without}
        return sorted(path for path in left if path.name != "__init__.py")


_ASSESS = ("assessment", "drive_case", "drive_rules", "limits", "roll_rules")
_COLD = ("drive/base/nameplate.py", "drive/circuit/steady.py", *(f"drive/assess/{name}.py" for name in _ASSESS))
"""Files that a drive's tools use only once: compiling takes longer than it saves."""

_SCANS = (
    "runtime/scan/modeled_execution.py",
    "runtime/scan/scan_record.py",
    "runtime/scan/scan_in_progress.py",
    "runtime/time/scheduler.py",
    "runtime/tasks/task.py",
    "runtime/scan/task_io.py",
    "runtime/memory/views.py",
    "rack/base/observers.py",
    "rack/tasks/scheduled_task.py",
)
"""Files that each scan uses."""
_RECORDING = (
    "messages/stream/templates.py",
    "messages/stream/rack_messages.py",
    "messages/stream/stream.py",
    "messages/stream/task_messages.py",
    "messages/stream/write_messages.py",
    "recordings/mcap/mcap_output.py",
    "recordings/write/recorder.py",
    "recordings/write/recording.py",
    "recordings/write/writer.py",
)
"""Files that each message of a recording uses."""
_DRIVES = (
    "runtime/tasks/cml_task.py",
    "runtime/scan/drive_record.py",
    "runtime/scan/drives.py",
    "runtime/memory/image.py",
    "runtime/memory/memory.py",
    "rack/modules/drive.py",
    "rack/modules/drive_io.py",
    "rack/modules/io_module.py",
    "rack/plants.py",
)
"""Files that each interrupt of a 57C406 uses, down to the registers, and the instruments that measure a plant."""

GROUPS = (
    Group("drive", folders=("drive",), without=_COLD),
    Group("scans", files=(*_SCANS, *_RECORDING, *_DRIVES)),
)
"""The groups that run as machine code. They must not use ``sum`` of floating-point numbers (decision): Python 3.12 and
later round once, at the end, where C rounds after each addition."""
