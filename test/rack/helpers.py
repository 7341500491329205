"""What the tests of rack files share."""

from pathlib import Path

from automax_ros.rackfile.loader import LoadResult, load
from automax_ros.rackfile.model.config import CommonVariable, RackConfig

HEAD = "rack: LINE1\nslots:\n  0: {module: 57C435, tasks: {LINE: {priority: 5}}}\n"


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
