"""The node ``drive_plant_SLOT`` (``drive_plant_SLOT_A`` and ``_B`` of a UDC): the plant that a drive turns.

Publishes: ``joint_states`` (sensor_msgs/JointState), the shaft as a joint with the plant's name, and ``plants/NAME``
(automax_msgs/PlantState), both 100 times per second of rack time; its part of ``/diagnostics``. With a roll or roller
also ``rolls/NAME`` (automax_msgs/RollState), and for a web that comes from it ``webs/WEB`` (automax_msgs/WebState) and
``webs/WEB/tension`` (std_msgs/Float32, N).

Subscribes: ``plants/NAME/load_torque/set`` (std_msgs/Float64, N m) where the plant's load says ``ros: in``, and no
other topic. A torque applies from the instant of its arrival. Observers are not notified of an operation: PlantState
shows the load (decision).

The scheduler runs the plant: this node does not advance its time, and the plant never waits for ROS.
"""

from __future__ import annotations

from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus

from automax_ros.rack.modules.drive import DriveControllerModule
from automax_ros.rack.operator.switches import SwitchOperations
from automax_ros.rackfile.model.config import DrivenPlant
from automax_ros.rackfile.model.ros_names import load_topic
from automax_ros.ros.base.node import ModuleNode, RackContext
from automax_ros.ros.base.write_topic import WriteTopic
from automax_ros.ros.nodes.webs import drive_outlet


class DrivePlantNode(ModuleNode):
    """Serves the plant of one drive."""

    def __init__(self, rack_context: RackContext, driven: DrivenPlant) -> None:
        super().__init__(rack_context, "_".join(filter(None, ("drive_plant", str(driven.slot), driven.drive))))
        self._driven, self._plant = driven, rack_context.rack.plants[driven.name]
        outlets = {
            topic: drive_outlet(self, topic) for topic in rack_context.stream.drive_topics if topic.plant == driven.name
        }
        rack_context.stream.add_sink(outlets.get)
        modules = {module.config.slot: module for module in rack_context.rack.modules}
        module = modules[driven.slot]
        self._timing = module.timing if isinstance(module, DriveControllerModule) else None
        self._controls = SwitchOperations(rack_context.rack)
        if driven.config.load.from_ros:
            target = f"the load of {driven.name}"
            WriteTopic(self, load_topic(driven.name), "std_msgs/msg/Float64", self._load, 8, target)
        self.diagnose(self._health)

    def _load(self, message: Any) -> None:
        self._controls.load(self._driven.name, message.data)

    def _health(self, _: int) -> list[DiagnosticStatus]:
        """Return the plant's health: WARN with a fault, or with late firings since the last report; else OK."""
        state = self.rack_context.stream.plants.last(self._driven.name)
        if state is None:
            return []
        level, text = DiagnosticStatus.OK, "turns" if state.speed_rpm else "stands still"
        shown = {
            "speed_rpm": f"{state.speed_rpm:.6g}",
            "current_percent": f"{100.0 * state.current_rms_a / self._plant.rated_amps:.4g}",
            "contactor": "closed" if state.contactor else "open",
            "line_hz": f"{state.line_hz:.6g}",
            "line_v": f"{state.line_v:.6g}",
            "faults": ", ".join(state.faults),
        }
        timing = self._timing
        if timing is not None:
            newly = self.rack_context.diagnostics.newly(f"{self._driven.name} late", timing.late)
            shown |= {
                "interrupts": str(timing.interrupts),
                "late": str(timing.late),
                "latest_ms": f"{timing.greatest_ns / 1e6:.4g}",
            }
            if newly:
                level, text = DiagnosticStatus.WARN, f"firings late by more than 1 ms since the last report: {newly}"
        if state.faults:
            level, text = DiagnosticStatus.WARN, ", ".join(state.faults)
        return [self.status(f"plant {self._driven.name}", level, text, self._driven.slot, shown)]
