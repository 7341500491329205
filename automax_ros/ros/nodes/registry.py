"""The node of each kind of module, and facts about a rack as read-only parameters, for ``ros2 param``.

The common memory belongs to the rack, with or without a module for it: its node always exists, and is the first.
"""

from __future__ import annotations

from collections.abc import Callable

from automax_ros.core.ticks import NS_PER_MS
from automax_ros.rack.modules.module import Module
from automax_ros.rack.rack import Rack
from automax_ros.rackfile.model.module import ModuleConfig
from automax_ros.rackfile.modules.common_memory import COMMON_MEMORY
from automax_ros.rackfile.modules.drive import DRIVE_ANALOG, DRIVE_CONTROLLER
from automax_ros.rackfile.modules.io import ANALOG_IO, DIGITAL_IO, PULSETACH, RESOLVER
from automax_ros.rackfile.modules.kind import ModuleKind
from automax_ros.rackfile.modules.network import NETWORK
from automax_ros.rackfile.modules.processor import PC3000, PROCESSOR
from automax_ros.rackfile.modules.registry import SUPPORTED
from automax_ros.rackfile.modules.udc import UDC
from automax_ros.ros.base.node import ModuleNode, RackContext
from automax_ros.ros.base.rack_health import RackHealth
from automax_ros.ros.nodes.common_memory import CommonMemoryNode
from automax_ros.ros.nodes.drive_plant import DrivePlantNode
from automax_ros.ros.nodes.io_module import IoModuleNode
from automax_ros.ros.nodes.network import NetworkNode
from automax_ros.ros.nodes.operator import OperatorNode
from automax_ros.ros.nodes.processor import ProcessorNode, UdcNode
from automax_ros.ros.nodes.tables import StatusTables

Facts = dict[str, tuple[bool | int | float | str, str]]
"""Value and description by name."""


NODES: dict[ModuleKind, Callable[[RackContext, Module], ModuleNode] | None] = {
    PROCESSOR: ProcessorNode,
    PC3000: ProcessorNode,
    COMMON_MEMORY: None,
    DIGITAL_IO: IoModuleNode,
    ANALOG_IO: IoModuleNode,
    RESOLVER: IoModuleNode,
    PULSETACH: IoModuleNode,
    DRIVE_CONTROLLER: IoModuleNode,
    DRIVE_ANALOG: IoModuleNode,
    NETWORK: NetworkNode,
    UDC: UdcNode,
}
"""The node of each kind of module; None where the rack's common memory node is enough."""


def run_facts(run_id: int) -> Facts:
    """Return the facts of one run, known once it begins: processes of a distributed rack agree on its number."""
    return {"run_id": (run_id, "number of the run, as in VariableTable")}


def rack_facts(rack: Rack) -> Facts:
    """Return the facts of a whole rack."""
    config = rack.config
    return {
        "rack": (config.name, "the rack's name"),
        "config": (str(config.path.absolute()), "its YAML file"),
        "executive": (f"{config.executive / 10:.1f}", "version of its executive software"),
        "execution": (config.execution.value, "what time a scan takes: none (ideal), or the manual's (modeled)"),
        "operator": (config.operator, "whether it has the services of an operator"),
    }


def module_facts(module: ModuleConfig) -> Facts:
    """Return the facts of a module."""
    facts: Facts = {
        "slot": (module.slot, "the slot it stands in"),
        "model": (module.model, "its catalogue number"),
    }
    if module.tasks:
        facts["tick_ms"] = (module.tick_ns / NS_PER_MS, "its tick in ms")
    return facts


def nodes_of(rack_context: RackContext) -> tuple[ModuleNode, ...]:
    """Create the nodes of a rack's part: those of its modules by slot.

    If the part has common memory, its node and, if the rack has one, the operator's come first. Those of the plants
    that drives turn come last, by slot and drive.
    """
    made: list[ModuleNode] = []
    if rack_context.holds_common_memory:
        made.append(CommonMemoryNode(rack_context))
        made[0].declare_facts(rack_facts(rack_context.rack))
        if rack_context.rack.config.operator:
            made.append(OperatorNode(rack_context))
    for module in rack_context.rack.modules:
        node = NODES[SUPPORTED[module.config.model]]
        if node is not None:
            made.append(node(rack_context, module))
            made[-1].declare_facts(module_facts(module.config))
    made += (DrivePlantNode(rack_context, driven) for driven in rack_context.rack.part.driven)
    if not rack_context.holds_common_memory:
        made[0].diagnose(RackHealth(rack_context, f"{made[0].get_name()}: process").statuses)
    StatusTables(made[0])
    return tuple(made)
