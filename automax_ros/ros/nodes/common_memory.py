"""The node ``common_memory``: the rack's common variables as topics.

Publishes: ``variables`` (automax_msgs/VariableTable, latched), ``config`` (std_msgs/String, latched: the rack's YAML
file and the tasks' sources as JSON), ``backplane`` (automax_msgs/CommonWrite), ``backplane/snapshot``
(automax_msgs/CommonImage, latched, sent again to each late joiner of either), ``common/NAME`` (std_msgs, latched) for
each variable with ``ros: out`` or ``ros: in``; rolls, rollers and webs that no drive turns, as ``drive_plant_SLOT``.

Subscribes: ``common/NAME/set`` (std_msgs) for each variable with ``ros: in``, and for no other;
``JOINT_velocity_controller/commands`` and ``JOINT_effort_controller/commands`` (std_msgs/Float64MultiArray) where a
plant's joint is commanded.
"""

from __future__ import annotations

from functools import partial
from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus
from std_msgs.msg import String

from automax_ros.core.kinds import Direction
from automax_ros.core.types import Value
from automax_ros.messages.types.rack_files import RackFile, files_of, files_text
from automax_ros.messages.types.topics import LATCHED, Take, Topic
from automax_ros.rackfile.model.plants import JointCommand
from automax_ros.rackfile.model.ros_names import command_topic
from automax_ros.rackfile.sections.joints import INTERFACES, UNITS
from automax_ros.ros.base.node import MAIN_NODE, ModuleNode, RackContext
from automax_ros.ros.base.qos import ros_qos
from automax_ros.ros.base.rack_health import RackHealth
from automax_ros.ros.base.write_topic import ScaledWriter, subscribe_values, subscribe_variable
from automax_ros.ros.nodes.webs import drive_outlet
from automax_ros.runtime.memory.views import MemoryValueError

TYPE = "std_msgs/msg/Float64MultiArray"
MOST_BYTES = 1024
"""Longest message that is read, bytes: one number, and a layout with its names (decision)."""


def subscribe_joint(node: ModuleNode, command: JointCommand) -> None:
    """Subscribe a node to the commands of one joint, in rad/s or N m, as ros2_control's group controllers receive them.

    A command writes the common that the rack file names, between two scans, as the writer ``ros``. The last command
    stays in force when a controller disappears (decision: so do forward_command_controller and every other ``/set``).
    """
    config, interface = node.rack_context.rack.config, command.interface
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


class CommonMemoryNode(ModuleNode):
    """Serves the topics of common memory; its callbacks run between scans."""

    def __init__(self, rack_context: RackContext) -> None:
        super().__init__(rack_context, "common_memory")
        rack, stream = rack_context.rack, rack_context.stream
        outlets: dict[Topic, Take] = {}
        for own in stream.topics:
            if own.slot is None:
                joined = own in (stream.snapshot_topic, stream.backplane_topic)
                # The latched image may be as old as the run.
                outlets[own] = self.outlet(own, stream.send_image) if joined else drive_outlet(self, own)
        self._config = self.create_publisher(String, "config", ros_qos(LATCHED))
        self._files: list[RackFile] = []
        outlets[stream.operations_topic] = partial(self._send_operation, outlets[stream.operations_topic])
        self.offer_files()
        for view, variable in enumerate(rack.config.variables):
            topic = stream.value_topic(view)
            if variable.direction is Direction.IN and topic is not None:
                subscribe_values(self, view, variable, topic)
        for command in rack.config.joint_commands:
            subscribe_joint(self, command)
        stream.add_sink(outlets.get)
        self.diagnose(RackHealth(rack_context, f"{MAIN_NODE}: {rack.config.name}").statuses)
        self.diagnose(self._module_health)

    def _send_operation(self, publish: Take, stamp: int, payload: bytes) -> None:
        """Publish an operation, after the files that the rack runs from: a reload has changed them."""
        self.offer_files()
        publish(stamp, payload)

    def _module_health(self, _: int) -> list[DiagnosticStatus]:
        """Return the health of the module that holds common memory; a lone Processor reports its own."""
        rack = self.rack_context.rack
        module = next(item for item in rack.config.modules if item.slot == rack.config.common_memory_slot)
        if module.tick_ns:
            return []
        good = rack.operations.battery_good
        values = {"variables": str(len(rack.config.declared)), "battery_good": str(good)}
        level, text = (DiagnosticStatus.OK, "running") if good else (DiagnosticStatus.WARN, "the battery was bad")
        return [self.status(module.model, level, text, module.slot, values)]

    def offer_files(self) -> None:
        """Publish the rack's files again if one of them has changed."""
        rack = self.rack_context.rack
        files = files_of(rack)
        if files != self._files:
            self._files = files
            self._config.publish(String(data=files_text(rack.config.name, files)))
