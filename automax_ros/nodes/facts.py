"""Facts about a rack as read-only parameters of its nodes, for whoever looks with ``ros2 param``."""

from __future__ import annotations

from automax_ros.core.ticks import NS_PER_MS
from automax_ros.rack.modules.configured import ModuleConfig
from automax_ros.rack.rack import Rack

Facts = dict[str, tuple[bool | int | float | str, str]]
"""Value and description by name."""


def run_facts(run_id: int) -> Facts:
    """Return those of one run, which are known once it begins: processes of a distributed rack agree on its number."""
    return {"run_id": (run_id, "number of the run, as in VariableTable")}


def rack_facts(rack: Rack) -> Facts:
    """Return those of a whole rack."""
    config = rack.config
    return {
        "rack": (config.name, "the rack's name"),
        "config": (str(config.path.absolute()), "its YAML file"),
        "executive": (f"{config.executive / 10:.1f}", "version of its executive software"),
        "execution": (config.execution.value, "what time a scan takes: none (ideal), or the manual's (modeled)"),
        "operator": (config.operator, "whether it has the services of an operator"),
    }


def module_facts(module: ModuleConfig) -> Facts:
    """Return those of a module."""
    facts: Facts = {
        "slot": (module.slot, "the slot it stands in"),
        "model": (module.model, "its catalogue number"),
    }
    if module.tasks:
        facts["tick_ms"] = (module.tick_ns / NS_PER_MS, "its tick in ms")
    return facts
