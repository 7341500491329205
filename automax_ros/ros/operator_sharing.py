"""The operator of a distributed rack: requests arrive at the home and are forwarded to the process of their object."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

from automax_ros.rackfile.processes import part_name
from automax_ros.ros.base.node import ModuleNode
from automax_ros.ros.distributed.bus import DistributedMemory
from automax_ros.ros.distributed.forwarding import RequestForwarder, operate_name
from automax_ros.ros.nodes.common_memory import CommonMemoryNode
from automax_ros.ros.nodes.operator import OperatorNode, OperatorServices


def forward_operator(nodes: Sequence[ModuleNode], bus: DistributedMemory) -> OperatorServices | None:
    """Make the operator's node forward requests, or serve forwarded requests if that node is in another process.

    Returns the services created here, to be closed; None if the rack has no operator, or its node closes them.
    """
    rack = nodes[0].site.rack
    memory = next((node for node in nodes if isinstance(node, CommonMemoryNode)), None)
    for node in nodes:
        if isinstance(node, OperatorNode) and memory is not None:
            node.operator_services.forward_by = RequestForwarder(node, bus, memory.offer_files)
    if rack.part.holds_common_memory or not rack.config.operator:
        return None
    return OperatorServices(nodes[0], partial(operate_name, part_name(rack.config, rack.part.slots)))
