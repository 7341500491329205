"""launch/diagnostics_analyzers.yaml: each status of the example racks is in one group, by GenericAnalyzer's rules."""

import re
from pathlib import Path
from typing import Any

import pytest
import yaml
from rack.helpers import config_at

from automax_ros.rackfile.loader import load
from automax_ros.rackfile.model.config import RackConfig, driven_plants

ROOT = Path(__file__).parents[1]
RACKS = sorted(
    path for path in (*(ROOT / "config").rglob("rack.yaml"), ROOT / "test" / "system" / "racks" / "types" / "rack.yaml")
)
GROUPS = yaml.safe_load((ROOT / "launch" / "diagnostics_analyzers.yaml").read_text())["analyzers"]["ros__parameters"]
NAMES = {
    "rack": "Racks",
    "common_memory": "Common memory",
    "processor": "Processors and tasks",
    "udc": "Processors and tasks",
    "digital_io": "Inputs and outputs",
    "analog_io": "Inputs and outputs",
    "resolver": "Inputs and outputs",
    "pulsetach": "Inputs and outputs",
    "drive": "Drives",
    "drive_analog": "Drives",
    "drive_plant": "Drives",
    "network": "Networks",
}


def matches(group: dict[str, Any], name: str) -> bool:
    """What diagnostic_aggregator's GenericAnalyzer does: a whole match of a regex, equality, a beginning, a part."""
    return (
        any(re.fullmatch(item, name) for item in group.get("regex", ()))
        or name in (*group.get("expected", ()), *group.get("name", ()))
        or name.startswith(tuple(group.get("startswith", ())))
        or any(item in name for item in group.get("contains", ()))
    )


def groups_of(name: str) -> list[str]:
    """Return the groups that a status is in."""
    return [group["path"] for group in GROUPS.values() if isinstance(group, dict) and matches(group, name)]


def status_names(config: RackConfig) -> list[str]:
    """Return the names of all statuses of a rack, in one process or in one for each module."""
    space = config.namespace
    names = [f"{space}/rack: {config.name}"]
    names += [f"{space}/{module.name}: {module.model}" for module in config.modules]
    names += [f"{space}/{module.name}: process" for module in config.modules]
    names += [f"{space}/{module.name}: {task.name}" for module, task in config.placed_tasks]
    for item in driven_plants(config):
        node = "_".join(filter(None, ("drive_plant", str(item.slot), item.drive)))
        names.append(f"{space}/{node}: plant {item.name}")
    return names


@pytest.mark.parametrize("path", RACKS, ids=lambda path: path.parent.name)
def test_each_status_is_in_the_group_of_its_node(path: Path) -> None:
    config = config_at(path)
    for space in (config.namespace, f"plant/{config.namespace}"):
        for name in status_names(config):
            placed = name.replace(config.namespace, space, 1)
            node = re.sub(r"_[0-9]+(_[AB])?$", "", placed.partition(": ")[0].rpartition("/")[2])
            assert groups_of(placed) == [NAMES[node]], placed


def test_every_group_is_used_and_of_the_kind_that_the_model_knows() -> None:
    groups = [group for group in GROUPS.values() if isinstance(group, dict)]
    assert {group["type"] for group in groups} == {"diagnostic_aggregator/GenericAnalyzer"}
    assert {group["path"] for group in groups} == set(NAMES.values())
    configs = [load(path).config for path in RACKS]
    found = {place for config in configs if config for name in status_names(config) for place in groups_of(name)}
    assert found == set(NAMES.values())


def test_other_nodes_are_in_no_group() -> None:
    for name in ("pm1/recorder: bag", "camera: drive_1: lens", "processor_1: LINE", "pm1/drive: motor"):
        assert groups_of(name) == []
