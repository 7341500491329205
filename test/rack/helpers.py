"""What the tests of racks and of their files share."""

from pathlib import Path
from typing import Any

from automax_ros.rack.base.observers import Operation
from automax_ros.rack.rack import Rack
from automax_ros.rackfile.loader import LoadResult, load
from automax_ros.rackfile.model.config import CommonVariable, RackConfig

HEAD = "rack: LINE1\nslots:\n  0: {module: 57C435, tasks: {LINE: {priority: 5}}}\n"


def config_at(path: Path) -> RackConfig:
    """Return a rack file that is sound."""
    found = load(path)
    assert found.config is not None, found.diagnostics
    return found.config


def rack_at(path: Path, **options: Any) -> Rack:
    """Return the rack of a file, not started."""
    return Rack(config_at(path), **options)


def written_in(folder: Path, yaml: str, **tasks: str) -> Path:
    """Write a rack file and the sources of its Control Block tasks."""
    for name, text in tasks.items():
        (folder / f"{name}.BLK").write_text(text, encoding="utf-8")
    path = folder / "rack.yaml"
    path.write_text(yaml, encoding="utf-8")
    return path


def rack_from(folder: Path, yaml: str, **tasks: str) -> Rack:
    """Return the rack of a file with its tasks, written there and not started."""
    return rack_at(written_in(folder, yaml, **tasks))


def run_for(rack: Rack, seconds: float = 0.0) -> Rack:
    """Start a rack, let it run for some seconds and return it."""
    rack.start()
    if seconds:
        rack.run(seconds)
    return rack


class Observer:
    """An observer of a rack for which nothing that happens matters; others derive from it."""

    def scanned(self, *_: Any) -> None: ...

    def written(self, *_: Any) -> None: ...

    def tuned(self, *_: Any) -> None: ...

    def operated(self, *_: Any) -> None: ...


class Told(Observer):
    """Notes operations; everything else goes by."""

    def __init__(self) -> None:
        self.operations: list[Operation] = []

    def operated(self, operation: Operation) -> None:
        self.operations.append(operation)


def write(folder: Path, text: str) -> Path:
    """Write a rack file next to a task source LINE.BLK."""
    (folder / "LINE.BLK").write_text("10 CALL SCAN_LOOP( TICKS=1 )\n20 END\n")
    path = folder / "rack.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def loaded(folder: Path, text: str, *, allow_outside: bool = False) -> LoadResult:
    return load(write(folder, text), allow_outside=allow_outside)


def good(folder: Path, text: str) -> RackConfig:
    result = loaded(folder, text)
    assert result.config is not None, result.diagnostics
    return result.config


def codes(folder: Path, text: str) -> list[str]:
    return [item.code for item in loaded(folder, text).diagnostics]


def common(folder: Path, line: str) -> CommonVariable:
    return good(folder, f"{HEAD}common:\n  {line}\n").variables[0]
