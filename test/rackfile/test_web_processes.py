"""A chain of plants that hangs together belongs to one process of a distributed rack."""

from __future__ import annotations

from pathlib import Path

from rack.helpers import config_at

from automax_ros.rack.base.part import RackPart
from automax_ros.rackfile.model.config import RackConfig
from automax_ros.rackfile.processes import processes_of

ROLLER = "{motor: dc_10hp_240v, gear: 5.25, roller: {diameter_m: 0.5}}"
SPAN = "length_m: 4.0, stiffness_n: 2.0e5"
HEAD = """\
rack: PM1
slots:
  0: {module: 57C413}
  1: {module: 57C435}
  7: {module: 57C406, plant: FIRST}
  9: {module: 57C406, plant: THIRD}
  11: {module: 57C406, plant: FOURTH}
"""


def config_of(folder: Path, webs: str) -> RackConfig:
    plants = "".join(f"  {name}: {ROLLER}\n" for name in ("FIRST", "SECOND", "THIRD", "FOURTH"))
    (folder / "rack.yaml").write_text(f"{HEAD}plants:\n{plants}{webs}")
    return config_at(folder / "rack.yaml")


def shared(config: RackConfig) -> dict[tuple[int, ...], tuple[str, ...]]:
    return {item.slots: item.reasons for item in processes_of(config) if len(item.slots) > 1}


def test_two_drives_at_one_web(tmp_path):
    config = config_of(tmp_path, f"webs:\n  W1: {{from: FIRST, to: THIRD, {SPAN}}}\n")
    assert shared(config) == {(7, 9): ("the web W1 runs from FIRST to THIRD",)}


def test_a_roller_between_them_that_nothing_drives(tmp_path):
    webs = f"webs:\n  W1: {{from: FIRST, to: SECOND, {SPAN}}}\n  W2: {{from: SECOND, to: THIRD, {SPAN}}}\n"
    config = config_of(tmp_path, webs)
    assert shared(config) == {(7, 9): ("FIRST and THIRD hang together by other plants",)}
    first, other = RackPart.of(config, (7, 9)), RackPart.of(config, (0, 11))
    assert [plant.name for plant in first.plants] == ["FIRST", "SECOND", "THIRD"]
    assert [web.name for web in first.webs] == ["W1", "W2"]
    assert [plant.name for plant in other.plants] == ["FOURTH"]
    assert other.is_elsewhere("web", "W1")
    assert not first.is_elsewhere("web", "W1")


def test_a_task_and_a_plant_of_one_name_do_not_hide_each_other():
    """WINDER of the paper line is a task in slot 2 and a plant at the UDC in slot 10."""
    config = config_at(Path(__file__).parents[2] / "config" / "paper_line" / "rack.yaml")
    parts = [RackPart.of(config, process.slots) for process in processes_of(config)]
    tasks = [part for part in parts if not part.is_elsewhere("task", "WINDER")]
    plants = [part for part in parts if not part.is_elsewhere("plant", "WINDER")]
    assert [2 in part.slots for part in tasks] == [True]
    assert [10 in part.slots for part in plants] == [True]


def test_without_webs_each_drive_has_its_own(tmp_path):
    assert shared(config_of(tmp_path, "")) == {}
