"""docs/rack_yaml.md says what the loader does."""

import re
from pathlib import Path

from automax_ros.core.kinds import Direction
from automax_ros.rackfile import loader
from automax_ros.rackfile.loader import load
from automax_ros.rackfile.modules.registry import KINDS, SUPPORTED
from automax_ros.rackfile.sections import commons

PAGE = Path(__file__).parents[2] / "docs" / "rack_yaml.md"


def table_keys(heading: str) -> list[str]:
    """The first column of the first table under a heading."""
    section = PAGE.read_text(encoding="utf-8").split(f"\n## {heading}\n")[1]
    rows = re.search(r"\| --- .*?\n((?:\|.*\n)+)", section)[1].splitlines()
    return [re.match(r"\| `(\w+)`", row)[1] for row in rows]


def example(folder: Path) -> Path:
    (folder / "sections").mkdir()
    for name in ("LINE.BLK", "sections/DRAW.BLK", "sections/SECT1.BLK"):
        (folder / name).write_text("10 END\n")
    path = folder / "rack.yaml"
    path.write_text(re.search(r"```yaml\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.S)[1], encoding="utf-8")
    return path


def test_example_is_a_rack_without_problems(tmp_path):
    result = load(example(tmp_path))
    assert result.diagnostics == []
    rack = result.config
    processors = [(item.slot, item.tick_ns, len(item.tasks)) for item in rack.task_modules]
    assert processors == [(1, 5_500_000, 2), (2, 2_500_000, 1)]
    directions = {item.name: item.direction for item in rack.variables}
    assert directions["LINE_SPEED%"] is Direction.IN
    assert directions["RECIPE%"] is Direction.CLOSED
    assert directions["TOTAL!"] is Direction.OUT


def test_page_has_every_key():
    assert table_keys("The file") == list(loader.KEYS)
    assert table_keys("Slots") == ["module", *dict.fromkeys(key for kind in KINDS for key in kind.options)]
    assert sorted(table_keys("Tasks")) == ["critical", "drive", "file", "priority"]
    text = PAGE.read_text(encoding="utf-8")
    tables = text.split("| option |")
    options = re.findall(r"^\| `(\w+)` \|", tables[1].split("\n###")[0] + tables[2].split("\n###")[0], re.M)
    assert options == list(commons.OPTIONS)


def test_page_names_every_module():
    text = PAGE.read_text(encoding="utf-8")
    assert all(f"`{number}`" in text for number in SUPPORTED)
