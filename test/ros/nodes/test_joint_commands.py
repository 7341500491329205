"""Joints over real DDS: commands as a controller of ros2_control sends them, and the shaft's own name."""

from math import pi

from ros.support import until

RACK = """\
rack: WIND
slots:
  0: {module: 57C435, tasks: {LINE: {priority: 5}}}
  10: {module: 57552, tasks: {WIND_A: {drive: A}}, plants: {A: WINDER}}
plants:
  WINDER:
    motor: dc_10hp_240v
    joint:
      name: winder_shaft
      velocity: {common: SPEED_SP%, scale: {counts: [-4095, 4095], value: [-1750.0, 1750.0]}}
      effort: {common: TORQUE_SP}
common:
  SPEED_SP%: {ros: in}
  TORQUE_SP: {ros: in}
"""
SOURCES = {
    "LINE": "10 CALL SCAN_LOOP(TICKS=20)\n20 END\n",
    "WIND_A": "100 CALL SCAN_LOOP(TICKS=20)\n900 END\n",
}


def test_commands_of_controllers_write_the_commons_of_the_joint(live, client):
    """Values by hand: pi rad/s are 30 rpm, 30/1750 of 4095 counts are 70.2; the rest is refused, nothing written."""
    from sensor_msgs.msg import JointState
    from std_msgs.msg import Float64MultiArray

    states = client.listen(JointState, "/wind/joint_states")
    velocity = client.node.create_publisher(Float64MultiArray, "/wind/winder_shaft_velocity_controller/commands", 10)
    effort = client.node.create_publisher(Float64MultiArray, "/wind/winder_shaft_effort_controller/commands", 10)

    def sent(publisher, *data: float) -> None:
        publisher.publish(Float64MultiArray(data=data))

    value = live.rack.value
    until(live, client, lambda: sent(velocity, pi) or value("SPEED_SP%") == 70)
    until(live, client, lambda: sent(effort, -12.5) or value("TORQUE_SP") == -12.5)
    until(live, client, lambda: sent(velocity, 1000.0) or value("SPEED_SP%") == 4095)
    assert live.health.counts["clamped value"] >= 1
    for wrong in ((), (1.0, 2.0), (float("nan"),)):
        before = live.health.counts["refused write"]
        until(live, client, lambda: sent(velocity, *wrong) or live.health.counts["refused write"] > before)  # noqa: B023
    assert value("SPEED_SP%") == 4095
    until(live, client, lambda: bool(states))
    assert {tuple(state.name) for state in states} == {("winder_shaft",)}
