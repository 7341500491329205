"""What clients may ask of a rack's nodes: nothing ends the loop, what cannot be is refused with a reason."""

import time
from pathlib import Path

import pytest
from system.support import TYPES, wait_until

from automax_ros.rack.rack import Rack
from automax_ros.rackfile.loader import load
from ros.support import until

ROOT = Path(__file__).parents[3]


@pytest.fixture
def live(ros_domain_id):
    from automax_ros.ros.live_rack import LiveRack

    made = LiveRack(Rack(load(TYPES).config))
    made.start([])
    yield made
    made.close()


def answer(live, client, kind, service, request):
    asking = client.node.create_client(kind, service)
    until(live, client, asking.service_is_ready)
    future = asking.call_async(request)
    until(live, client, future.done)
    return future.result()


def parameter(name, type_, **fields):
    from rcl_interfaces.msg import Parameter, ParameterValue

    return Parameter(name=name, value=ParameterValue(type=type_, **fields))


@pytest.mark.parametrize("node", ["common_memory", "processor_1"])
@pytest.mark.parametrize("type_", [10, 255])
def test_parameter_of_an_unknown_type_is_refused(live, client, node, type_):
    from rcl_interfaces.srv import SetParameters, SetParametersAtomically

    wrong = [parameter("FAST.GAIN", type_), parameter("use_sim_time", 1, bool_value=False)]
    found = answer(
        live, client, SetParameters, f"/types/{node}/set_parameters", SetParameters.Request(parameters=wrong)
    )
    assert [result.successful for result in found.results] == [False, False]
    assert f"unknown type {type_}" in found.results[0].reason
    request = SetParametersAtomically.Request(parameters=wrong)
    found = answer(live, client, SetParametersAtomically, f"/types/{node}/set_parameters_atomically", request)
    assert not found.result.successful
    assert f"unknown type {type_}" in found.result.reason
    assert live.health.counts["failed callback"] == 2
    assert len(live.health.news()) == 2
    scans = live.rack.statistics["FAST"].scans
    until(live, client, lambda: live.rack.statistics["FAST"].scans > scans)


def test_simulated_time_is_refused(live, client):
    from diagnostic_msgs.msg import DiagnosticArray
    from rcl_interfaces.srv import SetParameters

    arrays = client.listen(DiagnosticArray, "/diagnostics")
    request = SetParameters.Request(parameters=[parameter("use_sim_time", 1, bool_value=True)])
    for node in ("common_memory", "processor_1", "processor_2"):
        found = answer(live, client, SetParameters, f"/types/{node}/set_parameters", request)
        assert not found.results[0].successful
        assert "the rack does not follow /clock" in found.results[0].reason
    arrays.clear()
    until(live, client, lambda: arrays)
    assert arrays[0].header.stamp.sec > 1_600_000_000


def test_simulated_time_of_a_launch_file_does_not_reach_the_rack(ros_domain_id):
    """The parameter is set for all nodes of a context there."""
    from rclpy.context import Context

    from automax_ros.ros.rack_nodes import RackNodes

    context = Context()
    context.init(args=["--ros-args", "-p", "use_sim_time:=true"])
    try:
        with RackNodes(TYPES, context=context) as nodes:
            assert [node.get_parameter("use_sim_time").value for node in nodes.nodes] == [False] * 3
    finally:
        context.try_shutdown()


def test_callback_that_fails_does_not_end_the_loop(live, client, monkeypatch):
    """As if a message brought what nobody thought of."""
    from std_msgs.msg import Int16

    calls = []

    def fail(*_: object) -> None:
        calls.append(1)
        raise RuntimeError("unheard of")

    monkeypatch.setattr(live.rack, "write_view", fail)
    publisher = client.node.create_publisher(Int16, "/types/common/REF/set", 10)
    until(live, client, publisher.get_subscription_count)
    for number in range(3):
        publisher.publish(Int16(data=number))
    until(live, client, lambda: len(calls) == 3)
    assert_told(live)


def test_failure_before_our_callback_is_reached_does_not_end_the_loop(live, client, monkeypatch):
    """Such as a string that is not UTF-8, on which rclpy itself fails."""

    class Failing:
        def spin_once(self, timeout_sec):
            time.sleep(min(timeout_sec, 0.01))
            raise RuntimeError("unheard of")

    monkeypatch.setattr(live._process, "executor", Failing())
    wait_until(lambda: live.health.counts["failed callback"] >= 3)
    monkeypatch.undo()
    scans = live.rack.statistics["FAST"].scans
    until(live, client, lambda: live.rack.statistics["FAST"].scans > scans)
    assert_told(live)


def assert_told(live):
    assert live.health.counts["failed callback"] >= 3
    (news,) = live.health.news()
    assert "RuntimeError: unheard of" in news
    assert live.rack.statistics["FAST"].scans


def test_string_that_is_not_utf8_does_not_end_the_loop(live, client):
    """It ends rclpy's own conversion, in a message as in a request."""
    from std_msgs.msg import String

    publisher = client.node.create_publisher(String, "/types/common/NOTE/set", 10)
    until(live, client, publisher.get_subscription_count)
    publisher.publish(b"\x00\x01\x00\x00\x03\x00\x00\x00\xff\xfe\x00\x00")
    publisher.publish(String(data="well"))
    until(live, client, lambda: live.rack.value("NOTE$") == "well")


@pytest.mark.parametrize("reliable", [True, False])
def test_writers_of_either_reliability_are_heard(live, client, reliable):
    from rclpy.qos import QoSProfile, ReliabilityPolicy
    from std_msgs.msg import Int16

    reliability = ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT
    publisher = client.node.create_publisher(
        Int16, "/types/common/REF/set", QoSProfile(depth=1, reliability=reliability)
    )
    sent = iter(range(1, 30_000))
    seen: set[int] = set()

    def heard() -> bool:
        publisher.publish(Int16(data=next(sent)))
        value = live.rack.value("REF%")
        if value != 1000:
            seen.add(value)
        return len(seen) > 3

    until(live, client, heard)
    assert not live.health.counts


def test_reliable_writers_are_still_heard_after_a_best_effort_one(live, client):
    from rclpy.qos import QoSProfile, ReliabilityPolicy
    from std_msgs.msg import Int16

    topic = "/types/common/REF/set"
    reliable = client.node.create_publisher(Int16, topic, 10)
    hasty = client.node.create_publisher(Int16, topic, QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT))

    def heard(publisher, value):
        def written() -> bool:
            publisher.publish(Int16(data=value))
            return bool(live.rack.value("REF%") == value)

        return written

    for publisher, value in ((reliable, 1), (hasty, 2), (reliable, 3), (hasty, 4)):
        until(live, client, heard(publisher, value))


def test_executor_trial_leaves_nothing_in_the_graph(live, client):
    until(live, client, lambda: "/types/processor_1/get_parameters" in services(client))
    assert not [name for name in services(client) if "executor_trial" in name]
    assert "executor_trial" not in client.node.get_node_names()


def services(client):
    return [name for name, _ in client.node.get_service_names_and_types()]


def test_player_goes_on_too(ros_domain_id, client):
    from rcl_interfaces.srv import SetParameters

    from automax_ros.recordings.read.playback import Renaming, survey
    from automax_ros.ros.clients.player import Player

    found = survey(ROOT / "bags" / "section_drive")
    player = Player(found, Renaming(found.spaces, None), 1.0, clock=True)
    try:
        player.open()
        asking = client.node.create_client(SetParameters, f"{player.name}/set_parameters")
        future = None

        def answered() -> bool:
            nonlocal future
            for _ in range(5):
                client.executor.spin_once(timeout_sec=0)
            if future is None and asking.service_is_ready():
                future = asking.call_async(SetParameters.Request(parameters=[parameter("use_sim_time", 99)]))
            return future is not None and future.done()

        while player.play(answered, lambda: None):
            pass
        assert future is not None
        assert "unknown type 99" in future.result().results[0].reason
        assert len(player.health.news()) == 1
    finally:
        player.close()


def test_wrong_type_hashes_leave_the_console_alone(live, client, capfd):
    from type_description_interfaces.srv import GetTypeDescription

    for wrong in ("", "RIHS", "no hash at all", "RIHS01_12") * 3:
        request = GetTypeDescription.Request(type_name="a/msg/B", type_hash=wrong)
        assert not answer(live, client, GetTypeDescription, "/types/rack/get_type_description", request).successful
    assert capfd.readouterr().err == ""


def test_forged_presences_are_told_a_few_times(live, client):
    from automax_msgs.msg import Presence

    words = client.node.create_publisher(Presence, "/types/bus/presence", 10)
    until(live, client, lambda: words.get_subscription_count() > 0)
    for number in range(60):
        words.publish(Presence(rack="TYPES", process=1000 + number, run_id=77 + number))
        until(live, client, lambda: live.health.counts["other rack"] > number)  # noqa: B023 used at once
    assert len([text for text in live.health.news() if text.startswith("another rack")]) == 20
