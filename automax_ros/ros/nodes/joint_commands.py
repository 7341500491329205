"""Commands of joints, in the form of ros2_control's controllers.

``/RACK/JOINT_velocity_controller/commands`` (rad/s) and ``/RACK/JOINT_effort_controller/commands`` (N m) are
std_msgs/Float64MultiArray with one number, as a ``JointGroupVelocityController`` or ``JointGroupEffortController`` of
one joint receives it. A command writes the common that the rack file names, as a message on that common's own ``/set``
does: between two scans, as the writer ``ros``. The last command stays in force when a controller disappears
(decision: so do forward_command_controller and every other ``/set``).
"""

from __future__ import annotations

from typing import Any

from automax_ros.rackfile.model.config import CommonVariable
from automax_ros.rackfile.model.plants import JointCommand
from automax_ros.rackfile.model.ros_names import command_topic
from automax_ros.rackfile.model.writers import ROS_WRITER
from automax_ros.rackfile.sections.joint_keys import INTERFACES, UNITS
from automax_ros.ros.base.node import ModuleNode
from automax_ros.ros.base.write_topic import ScaledWriter, WriteTopic
from automax_ros.runtime.memory.views import MemoryValueError

TYPE = "std_msgs/msg/Float64MultiArray"
MOST_BYTES = 1024
"""Longest message that is read, bytes: one number, and a layout with its names (decision)."""


class JointInlet:
    """Receives the commands of one joint by one interface."""

    def __init__(self, node: ModuleNode, command: JointCommand) -> None:
        self._node, self._command = node, command
        variables = node.site.rack.config.variables
        self._view, self._variable = _place(variables, command.common)
        topic = f"/{node.site.rack.config.namespace}/{command_topic(command.joint, command.interface)}"
        unit = UNITS[command.interface]
        self._scaled = ScaledWriter(node, topic, self._variable, command.scale, unit) if command.scale else None
        self._inlet = WriteTopic(node, topic, TYPE, self._write, MOST_BYTES)

    def _write(self, message: Any) -> None:
        rack, variable = self._node.site.rack, self._variable
        try:
            if not rack.operations.powered and not rack.config.is_input(variable):
                raise MemoryValueError(f"the power is off, and {variable.name} is not an input")
            if len(message.data) != 1:
                joint = f"{self._command.interface} of {self._command.joint}"
                raise MemoryValueError(f"{joint} is one number, the message has {len(message.data)}")
            value = message.data[0] / INTERFACES[self._command.interface]
            number = value if self._scaled is None else self._scaled.counts(value)
            rack.write_view(self._view, [(0, number)], ROS_WRITER)
        except MemoryValueError as error:
            self._inlet.refuse(variable.name, error)


def joint_inlets(node: ModuleNode) -> list[JointInlet]:
    """Subscribe a node to the commands of all joints of the rack."""
    return [JointInlet(node, command) for command in node.site.rack.config.joint_commands]


def _place(variables: tuple[CommonVariable, ...], name: str) -> tuple[int, CommonVariable]:
    return next((view, variable) for view, variable in enumerate(variables) if variable.name == name)
