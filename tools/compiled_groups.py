"""Which modules are compiled ahead of time: the one list, and how a change of it is noticed."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
PACKAGE = ROOT / "automax_ros"


@dataclass(frozen=True)
class Group:
    """Modules that are translated together: inside a group calls are C, out of it they are Python's.

    ``folders`` are taken whole, with what is below them, but for ``without`` (files, relative to the package);
    ``files`` are single ones. A group is loaded whole or not at all (decision): its modules know each other's memory.
    """

    name: str
    folders: tuple[str, ...] = ()
    files: tuple[str, ...] = ()
    without: tuple[str, ...] = ()

    def sources(self) -> list[Path]:
        """Return the files of the group, in the order of their names; faces (``__init__``) stay plain."""
        found = {path for folder in self.folders for path in (PACKAGE / folder).rglob("*.py")}
        found |= {PACKAGE / file for file in self.files}
        left = found - {PACKAGE / file for file in self.without}
        return sorted(path for path in left if path.name != "__init__.py")


_COLD = ("steady", "drive_case", "drive_rules", "gain_rules", "nameplate", "limits", "assessment")
"""What a drive's tools ask once: compiling takes longer than it saves."""

_SCANS = (
    "running/processor_time.py",
    "running/scan_record.py",
    "running/scan_under_way.py",
    "running/scheduler.py",
    "running/task.py",
    "running/task_io.py",
    "running/views.py",
    "rack/observers.py",
    "rack/scan_end.py",
    "rack/scheduled_task.py",
    "rack/task_statistics.py",
)
"""What each scan goes through."""
_RECORDING = (
    "wire/patterns.py",
    "wire/prepared.py",
    "wire/rack_messages.py",
    "wire/stream.py",
    "wire/task_messages.py",
    "wire/unsigned.py",
    "wire/write_messages.py",
    "bags/chunk_builder.py",
    "bags/mcap_output.py",
    "bags/recorder.py",
    "bags/recording.py",
    "bags/writer.py",
)
"""What each message of a recording goes through."""
_DRIVES = (
    "running/cml_task.py",
    "running/drive_record.py",
    "running/drives.py",
    "running/image.py",
    "running/memory.py",
    "running/process_inputs.py",
    "rack/modules/drive_controller.py",
    "rack/modules/drive_digital.py",
    "rack/modules/drive_interrupts.py",
    "rack/modules/drive_switches.py",
    "rack/modules/drive_voltage.py",
    "rack/modules/io_module.py",
    "rack/plants/feeding.py",
    "rack/plants/sampling.py",
)
"""What each interrupt of a 57C406 goes through, to the registers, and the instruments that look at a plant."""

GROUPS = (
    Group("drive", folders=("drive",), without=tuple(f"drive/{name}.py" for name in _COLD)),
    Group("scans", files=(*_SCANS, *_RECORDING, *_DRIVES)),
)
"""What runs as machine code. ``sum`` of floating-point numbers must not stand in it (decision): Python 3.12 and later
round once, at the end, where C rounds after each addition."""
