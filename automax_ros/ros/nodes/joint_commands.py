"""Commands of joints, in the form of ros2_control's controllers.

``/RACK/JOINT_velocity_controller/commands`` (rad/s) and ``/RACK/JOINT_effort_controller/commands`` (N m) are
std_msgs/Float64MultiArray with one number, as a ``JointGroupVelocityController`` or ``JointGroupEffortController`` of
one joint receives it. A command writes the common that the rack file names, as a message on that common's own ``/set``
does: between two scans, as the writer ``ros``. The last command stays in force when a controller disappears
(decision: so do forward_command_controller and every other ``/set``).
"""

from __future__ import annotations

from typing import Any

from automax_ros.core.types import Value
from automax_ros.rackfile.model.plants import JointCommand
from automax_ros.rackfile.model.ros_names import command_topic
from automax_ros.rackfile.sections.joints import INTERFACES, UNITS
from automax_ros.ros.base.node import ModuleNode
from automax_ros.ros.base.write_topic import ScaledWriter, subscribe_variable
from automax_ros.runtime.memory.views import MemoryValueError

TYPE = "std_msgs/msg/Float64MultiArray"
MOST_BYTES = 1024
"""Longest message that is read, bytes: one number, and a layout with its names (decision)."""


def subscribe_joint(node: ModuleNode, command: JointCommand) -> None:
    """Subscribe a node to the commands of one joint by one interface."""
    config, interface = node.site.rack.config, command.interface
    view = next(view for view, variable in enumerate(config.variables) if variable.name == command.common)
    topic = f"/{config.namespace}/{command_topic(command.joint, interface)}"
    scaled = None
    if command.scale:
        scaled = ScaledWriter(node, topic, config.variables[view], command.scale, UNITS[interface])

    def elements_of(message: Any) -> list[tuple[int, Value]]:
        if len(message.data) != 1:
            joint = f"{interface} of {command.joint}"
            raise MemoryValueError(f"{joint} is one number, the message has {len(message.data)}")
        value = message.data[0] / INTERFACES[interface]
        return [(0, value if scaled is None else scaled.counts(value))]

    subscribe_variable(node, topic, TYPE, view, elements_of, MOST_BYTES)
