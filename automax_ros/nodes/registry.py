"""Which node a module has: one entry for each kind that has one of its own.

The common memory is the rack's, with a module for it or without: its node is there always, and first.
"""

from __future__ import annotations

from collections.abc import Callable

from automax_ros.nodes.common_memory import CommonMemoryNode
from automax_ros.nodes.drive_plant import DrivePlantNode
from automax_ros.nodes.facts import module_facts, rack_facts
from automax_ros.nodes.io_module import IoModuleNode
from automax_ros.nodes.module_node import ModuleNode, Site
from automax_ros.nodes.network import NetworkNode
from automax_ros.nodes.operator import OperatorNode
from automax_ros.nodes.processor import ProcessorNode
from automax_ros.nodes.rack_health import RackHealth
from automax_ros.nodes.tables import Tables
from automax_ros.nodes.udc import UdcNode
from automax_ros.rack.modules.analog_io import ANALOG_IO
from automax_ros.rack.modules.common_memory import COMMON_MEMORY
from automax_ros.rack.modules.digital_io import DIGITAL_IO
from automax_ros.rack.modules.drive_analog import DRIVE_ANALOG
from automax_ros.rack.modules.drive_config import DRIVE_CONTROLLER
from automax_ros.rack.modules.kind import ModuleKind
from automax_ros.rack.modules.network_config import NETWORK
from automax_ros.rack.modules.pc3000 import PC3000
from automax_ros.rack.modules.processor import PROCESSOR
from automax_ros.rack.modules.pulsetach import PULSETACH
from automax_ros.rack.modules.registry import SUPPORTED
from automax_ros.rack.modules.resolver import RESOLVER
from automax_ros.rack.modules.running import Module
from automax_ros.rack.modules.udc_config import UDC

NODES: dict[ModuleKind, Callable[[Site, Module], ModuleNode] | None] = {
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


def nodes_of(site: Site) -> tuple[ModuleNode, ...]:
    """Create the nodes of a rack's part: those of its modules by slot.

    Where common memory is, its node and, if the rack has one, the operator's stand first.

    After the modules stand those of the plants that drives turn, by slot and drive.
    """
    made: list[ModuleNode] = []
    if site.is_home:
        made.append(CommonMemoryNode(site))
        made[0].declare_facts(rack_facts(site.rack))
        if site.rack.config.operator:
            made.append(OperatorNode(site))
    for module in site.rack.modules:
        node = NODES[SUPPORTED[module.config.model]]
        if node is not None:
            made.append(node(site, module))
            made[-1].declare_facts(module_facts(module.config))
    made += (DrivePlantNode(site, driven) for driven in site.rack.part.driven)
    if not site.is_home:
        made[0].diagnose(RackHealth(site, f"{made[0].get_name()}: process").statuses)
    Tables(made[0])
    return tuple(made)
