"""The node of a plant over real DDS: its shaft and state, the load from ROS, faults and switches by services."""

from math import pi, remainder

import pytest

from ros.support import until

RACK = """\
rack: WIND
operator: true
slots:
  0: {module: 57C435, tasks: {LINE: {priority: 5}}}
  7: {module: 57C406, plant: UNWIND}
  10: {module: 57552, tasks: {WIND_B: {drive: B}}, plants: {B: WINDER}}
plants:
  UNWIND: {motor: dc_10hp_240v, load: {friction_nm: 1, ros: in}}
  WINDER: {motor: dc_10hp_240v, load: {speed_rpm: 300}}
"""
SOURCES = {
    "LINE": "10 CALL SCAN_LOOP(TICKS=20)\n20 END\n",
    "WIND_B": "100 CALL SCAN_LOOP(TICKS=20)\n900 END\n",
}


def test_shafts_and_states_are_heard_and_ros_loads_a_shaft(live, client):
    from automax_msgs.msg import PlantState
    from diagnostic_msgs.msg import DiagnosticArray
    from rclpy.qos import ReliabilityPolicy
    from sensor_msgs.msg import JointState
    from std_msgs.msg import Float64

    joints, health = {}, {}
    client.node.create_subscription(
        JointState, "/wind/joint_states", lambda item: joints.setdefault(item.name[0], []).append(item), 10
    )
    client.node.create_subscription(
        DiagnosticArray, "/diagnostics", lambda item: health.update({part.name: part for part in item.status}), 10
    )
    states = client.listen(PlantState, "/wind/plants/UNWIND")
    until(live, client, lambda: len(joints.get("WINDER", [])) > 5 and len(states) > 5)
    nodes = {name for name, _ in client.node.get_node_names_and_namespaces()}
    assert {"drive_plant_7", "drive_plant_10_B", "drive_7", "udc_10"} <= nodes
    (publisher,) = client.node.get_publishers_info_by_topic("/wind/plants/UNWIND")
    assert (publisher.node_name, publisher.qos_profile.reliability) == ("drive_plant_7", ReliabilityPolicy.RELIABLE)
    assert not client.node.get_subscriptions_info_by_topic("/wind/plants/WINDER/load_torque/set")
    first, second = joints["WINDER"][:2]
    assert first.velocity[0] == pytest.approx(10 * pi)
    passed_s = second.header.stamp.sec - first.header.stamp.sec
    passed_s += (second.header.stamp.nanosec - first.header.stamp.nanosec) * 1e-9
    assert passed_s == pytest.approx(0.01 * round(passed_s / 0.01))
    turned = second.position[0] - first.position[0]
    assert remainder(turned - 10 * pi * passed_s, 2 * pi) == pytest.approx(0.0, abs=1e-6)
    assert states[-1].load_nm == 0.0
    assert states[-1].speed_rpm == 0.0
    assert (states[-1].plant, states[-1].slot, states[-1].drive) == ("UNWIND", 7, "")

    torque = client.node.create_publisher(Float64, "/wind/plants/UNWIND/load_torque/set", 10)

    def sent(newton_metres: float) -> None:
        torque.publish(Float64(data=newton_metres))

    until(live, client, lambda: sent(-20.0) or states[-1].load_nm == -20.0)
    until(live, client, lambda: states[-1].speed_rpm > 10.0)
    until(live, client, lambda: sent(float("nan")) or live.health.counts["refused write"] > 0)
    assert live.rack.plants["UNWIND"].load_torque_nm == -20.0
    assert any("write refused: load torque in N m" in text for text in live.health.news())
    part = "wind/drive_plant_7: plant UNWIND"
    until(live, client, lambda: part in health and health[part].message == "turns")
    values = {item.key: item.value for item in health[part].values}
    assert (values["contactor"], values["line_hz"], values["faults"]) == ("open", "60", "")
    assert (values["interrupts"], values["late"]) == ("0", "0")
    assert health[part].hardware_id == "WIND slot 7"
    assert "interrupts" not in {item.key for item in health["wind/drive_plant_10_B: plant WINDER"].values}


def test_faults_and_switches_by_services(live, client, ask):
    from automax_msgs.msg import Operation, PlantState
    from automax_msgs.srv import OperateControl
    from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus

    told = client.listen(Operation, "/wind/operations", latched=True)
    states = client.listen(PlantState, "/wind/plants/UNWIND")
    health = {}
    client.node.create_subscription(
        DiagnosticArray, "/diagnostics", lambda item: health.update({part.name: part for part in item.status}), 10
    )

    def asked(service: str, name: str, control: str, value: str):
        response = ask(service, OperateControl, name=name, control=control, value=value)
        return response.ok, response.reason

    assert asked("plant", " unwind ", "short_scr", "3") == (True, "")
    assert asked("module", "7", "test_switch", "a") == (True, "")
    ok, reason = asked("plant", "UNWIND", "short_scr", "7")
    assert not ok
    assert reason.startswith("short_scr cannot be '7': it takes 1 to 6 or 11 to 16")
    assert asked("plant", "NOBODY", "short_scr", "3") == (
        False,
        "the rack has no plant 'NOBODY': it has UNWIND, WINDER",
    )
    assert asked("module", "0", "test_switch", "A")[0] is False
    assert asked("plant", "UNWIND", "repair", "x" * 101) == (False, "a text of 101 characters: at most 100 are read")
    until(live, client, lambda: len(told) == 6)
    assert [(item.what, item.ok, item.detail) for item in told[:3]] == [
        ("plant", True, "UNWIND short_scr 3"),
        ("module", True, "7 test_switch A"),
        ("plant", False, "UNWIND short_scr 7"),
    ]
    until(live, client, lambda: states and list(states[-1].faults) == ["short_scr 3"])
    part = "wind/drive_plant_7: plant UNWIND"
    until(live, client, lambda: part in health and health[part].level == DiagnosticStatus.WARN)
    assert health[part].message == "short_scr 3"
    assert asked("plant", "UNWIND", "repair", "all") == (True, "")
    until(live, client, lambda: not states[-1].faults)
    assert live.rack.modules[1].state()["switches"]["test"] == "A"
