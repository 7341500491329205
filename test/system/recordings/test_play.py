"""`automax play`: a recording as real subscribers of other processes get it."""

import os
import re
import signal
import time
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from mcap.writer import Writer
from recordings.recordings import sample_recording

from automax_ros.recordings.read.reader import BagReader
from system.support import TYPES, Automax, Client, Ended, automax, automax_here, consecutive, ns

PLAYING = "Ctrl-C ends it"
SPAN_NS = 454 * 5_500_000
"""How long the sample recording lasts."""


@pytest.fixture
def bag(tmp_path: Path) -> Path:
    return sample_recording(tmp_path / "bag")


def resume(client: Client, player: str = "/line1/player") -> None:
    """Let a paused player go on, once it knows of everything that the client has subscribed to.

    What a node creates is told in order: who answers a client has heard of the subscriptions before it.
    """
    from std_srvs.srv import Trigger

    pause = client.node.create_client(Trigger, f"{player}/pause")
    client.until(pause.service_is_ready, "the player's services")
    assert client.result(pause.call_async(Trigger.Request())).success
    go_on = client.node.create_client(Trigger, f"{player}/resume")
    client.until(go_on.service_is_ready, "the player's services")
    assert client.result(go_on.call_async(Trigger.Request())).success


def best_effort(client: Client, kind: Any, topic: str) -> list[Any]:
    """Listen as `ros2 topic echo` does to a sensor: whatever the sender offers will do."""
    from rclpy.qos import QoSProfile, ReliabilityPolicy

    received: list[Any] = []
    qos = QoSProfile(depth=50_000, reliability=ReliabilityPolicy.BEST_EFFORT)
    client._subscriptions.append(client.node.create_subscription(kind, topic, received.append, qos))
    return received


def test_subscriber_gets_what_was_recorded(ros_domain_id, bag):
    from automax_msgs.msg import CommonWrite, Scan, VariableTable
    from rclpy.qos import DurabilityPolicy, ReliabilityPolicy
    from rosgraph_msgs.msg import Clock
    from std_msgs.msg import Int16

    with Automax("play", bag, "--rate", "2", "--start-paused") as player, Client() as client:
        player.wait_for_line(PLAYING)
        scans = client.listen(Scan, "/line1/scans")
        writes = client.listen(CommonWrite, "/line1/backplane")
        values = client.listen(Int16, "/line1/common/REF", latched=True)
        tables = client.listen(VariableTable, "/line1/variables", latched=True)
        clocks = best_effort(client, Clock, "/clock")
        client.until(lambda: client.node.count_publishers("/line1/scans") > 0)
        for topic, durability in {
            "/line1/scans": DurabilityPolicy.VOLATILE,
            "/line1/common/REF": DurabilityPolicy.TRANSIENT_LOCAL,
        }.items():
            client.until(lambda topic=topic: bool(client.node.get_publishers_info_by_topic(topic)))
            (offered,) = client.node.get_publishers_info_by_topic(topic)
            assert offered.qos_profile.durability == durability
            assert offered.qos_profile.reliability == ReliabilityPolicy.RELIABLE
        began = time.monotonic()
        resume(client)
        client.until(lambda: player.process.poll() is not None, "the end of the playback")
        took = time.monotonic() - began
        client.until(lambda: len(writes) >= 454 and bool(values) and values[-1].data == 453, "the last messages")
        client.until(lambda: bool(clocks) and ns(clocks[-1].clock) == SPAN_NS + 2, "the last time")
        ended = player.end()
    assert (ended.code, ended.err) == (0, "")
    print(ended.out)
    assert "played 1364 messages up to 2.497 s of the run; late by " in ended.out
    assert took > SPAN_NS / 2e9

    recorded = [item.message for item in BagReader(bag).messages()]
    assert [(ns(item.stamp), item.task, item.scan, list(item.committed.value)) for item in scans] == [
        (item.stamp, item.task, item.scan, list(item.committed.value)) for item in recorded if hasattr(item, "task")
    ]
    assert [ns(item.stamp) for item in writes] == [index * 5_500_000 for index in range(1, 455)]
    assert consecutive([item.sequence for item in writes])
    (table,) = tables
    assert (table.rack, [item.name for item in table.variables][:2]) == ("LINE1", ["REF%", "COUNT!"])
    # The sender of a common keeps one value only: a value may be missing, none may be wrong, and the last must come.
    numbers = [item.data for item in values]
    assert all(one < two for one, two in pairwise(numbers))
    assert numbers[-1] == 453
    assert len(numbers) > 400
    times = [ns(item.clock) for item in clocks]
    assert all(one <= two for one, two in pairwise(times))
    assert times[0] == 0
    assert times[-1] == SPAN_NS + 2
    assert max(two - one for one, two in pairwise(times[:-1])) % (20_000_000) == 0, (
        "a tick of 10 ms is 20 ms of the bag"
    )
    assert len(times) > 20


def test_late_subscriber_gets_latched_facts(ros_domain_id, bag):
    from automax_msgs.msg import CommonImage, VariableTable
    from std_msgs.msg import Int16

    with Automax("play", bag, "--from", "1", "--rate", "0.01") as player, Client() as client:
        player.wait_for_line(PLAYING)
        values = client.listen(Int16, "/line1/common/REF", latched=True)
        client.until(lambda: bool(values))
        assert values[0].data in (180, 181)  # what held at 1 s, or the first one after it
        client.until(lambda: values[-1].data >= 182)
        with Client("second") as second:
            assert second.first(VariableTable, "/line1/variables").run_id == 77
            assert second.first(CommonImage, "/line1/backplane/snapshot").sequence == 0
            assert second.first(Int16, "/line1/common/REF").data >= 182
        ended = player.end(signal.SIGINT)
    print(f"stopped {ended.seconds:.2f} s after SIGINT")
    assert (ended.code, ended.err) == (0, "")


def test_loop_begins_again_until_it_is_stopped(ros_domain_id, bag):
    from rosgraph_msgs.msg import Clock
    from std_msgs.msg import Int16

    with Automax("play", bag, "--loop", "--rate", "10", "--topics", "/line1/common/*") as player, Client() as client:
        clocks = best_effort(client, Clock, "/clock")
        values = client.listen(Int16, "/line1/common/REF", latched=True)

        def returns(numbers: list[int]) -> int:
            return sum(two < one for one, two in pairwise(numbers))

        client.until(lambda: returns([item.data for item in values]) >= 2, "the third round")
        client.until(lambda: returns([ns(item.clock) for item in clocks]) >= 2)
        assert client.node.count_publishers("/line1/scans") == 0
        ended = player.end(signal.SIGTERM)
    assert (ended.code, ended.err) == (0, "")


def test_clock_is_left_alone_where_it_is_not_wanted(ros_domain_id, bag):
    from std_msgs.msg import Int16

    with Automax("play", bag, "--no-clock", "--start-paused") as player, Client() as client:
        player.wait_for_line("paused: ros2 service call /line1/player/resume")
        values = client.listen(Int16, "/line1/common/REF", latched=True)
        resume(client)
        client.until(lambda: bool(values) and values[-1].data > 10)
        assert client.node.count_publishers("/clock") == 0
        assert player.end(signal.SIGINT).code == 0


@pytest.fixture(scope="module")
def running(module_domain_id):
    with Automax("run", TYPES) as process:
        process.wait_for_line("Ctrl-C ends the run")
        yield process


@pytest.fixture(scope="module")
def recorded(tmp_path_factory) -> Path:
    bag: Path = tmp_path_factory.mktemp("recorded") / "bag"
    assert automax_here("run", TYPES, "--simulated", "--duration", "1", "--record", bag).code == 0
    return bag


def refused(*arguments: Any, **environment: str) -> Ended:
    return automax("play", *arguments, environment={**os.environ, **environment})


def test_live_rack_is_not_played_over(running, recorded, module_domain_id, tmp_path):
    ended = refused(recorded)
    assert ended.code == 2
    assert ended.err == (
        f"automax play: error: rack /types in ROS domain {module_domain_id} runs already (process {running.pid})\n"
        "  hint: stop it, play elsewhere with --namespace, or mix both with --force\n"
    )
    # Another user's lock, or another host's, is not seen; the graph tells.
    ended = refused(recorded, TMPDIR=str(tmp_path))
    assert ended.code == 2
    assert ended.err.startswith(f"automax play: error: rack /types is live in ROS domain {module_domain_id}\n  hint: ")


def test_live_rack_and_playback_side_by_side(running, recorded):
    from automax_msgs.msg import VariableTable
    from std_msgs.msg import Int16

    with Automax("play", recorded, "--namespace", "/replay", "--rate", "0.1") as player, Client() as client:
        player.wait_for_line(PLAYING)
        table = client.first(VariableTable, "/replay/variables")
        topics = {item.name: item.topic for item in table.variables}
        assert topics["TWICE%"] == "/replay/common/TWICE"
        values = client.listen(Int16, topics["TWICE%"], latched=True)
        client.until(lambda: bool(values) and values[-1].data == 2000)
        assert ("player", "/replay") in client.node.get_node_names_and_namespaces()
        assert client.node.count_publishers("/types/variables") == 1
        assert player.end(signal.SIGINT).code == 0
    assert automax("play", recorded, "--force", "--rate", "100", "--topics", "/types/scans", "--no-clock").code == 0


def test_rack_does_not_start_where_its_recording_plays(ros_domain_id, recorded):
    with Automax("play", recorded, "--start-paused") as player:
        player.wait_for_line(PLAYING)
        ended = automax_here("run", TYPES, "--duration", "0.1")
        assert ended.code == 2
        assert f"runs already (process {player.pid})" in ended.err
        assert player.end(signal.SIGTERM).code == 0


def foreign(path: Path) -> None:
    """A recording of another program: a type that is installed, the same twice more spoilt, and one that is not."""
    from geometry_msgs.msg import Point
    from rclpy.serialization import serialize_message

    data = serialize_message(Point(x=1.0, y=2.0, z=3.0))
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start(profile="ros2", library="other")
        qos = "- {history: 1, depth: 5, reliability: 1, durability: 1}\n"
        changed = "RIHS01_" + "ab" * 32
        for type_name, topic, type_hash in [
            ("geometry_msgs/msg/Point", "/point", ""),
            ("geometry_msgs/msg/Point", "/changed", changed),
            ("my_msgs/msg/Thing", "/thing", ""),
            ("antigravity/msg/Thing", "/flying", ""),
            ("geometry_msgs/msg/Nothing", "/nothing", ""),
        ]:
            schema = writer.register_schema(type_name, "ros2msg", b"float64 x\nfloat64 y\nfloat64 z\n")
            metadata = {"offered_qos_profiles": qos, "topic_type_hash": type_hash}
            channel = writer.register_channel(topic, "cdr", schema, metadata)
            writer.add_message(channel, log_time=10**18, data=data, publish_time=10**18)
        writer.finish()


def test_recording_of_another_program_plays_as_far_as_its_types_are_installed(ros_domain_id, tmp_path):
    from geometry_msgs.msg import Point

    path = tmp_path / "other.mcap"
    foreign(path)
    with Automax("play", path, "--loop", "--start-paused") as player, Client() as client:
        player.wait_for_line(PLAYING)
        points = client.listen(Point, "/point", latched=True)
        resume(client, "/player")
        client.until(lambda: bool(points))
        ended = player.end(signal.SIGINT)
    assert (ended.code, ended.err) == (0, "")
    assert (points[0].x, points[0].y, points[0].z) == (1.0, 2.0, 3.0)
    assert ended.out.startswith(
        "skipped /changed: geometry_msgs/msg/Point is installed with another definition\n"
        "skipped /thing: its type my_msgs/msg/Thing is not installed\n"
        "skipped /flying: its type antigravity/msg/Thing is not installed\n"
        "skipped /nothing: its type geometry_msgs/msg/Nothing is not installed\n"
        "playing 1 topic, "
    )


def test_malformed_message_ends_the_playback(ros_domain_id, tmp_path):
    from recordings.recordings import TABLE

    from automax_ros.messages.cdr.cdr import encode
    from automax_ros.messages.types.messages import NAMES, Int16, VariableTable
    from automax_ros.messages.types.topics import LATCHED, VALUE
    from automax_ros.recordings.write.writer import BagWriter

    with BagWriter(tmp_path / "bag") as writer:
        writer.write(writer.channel("/line1/variables", NAMES[VariableTable], LATCHED), 0, encode(TABLE))
        writer.write(writer.channel("/line1/common/REF", NAMES[Int16], VALUE), 1, b"\x00\x01\x00\x00\x07")
    ended = automax("play", tmp_path / "bag")
    assert ended.code == 2
    assert re.search(r"error\[AMX6816\]: the message on /line1/common/REF at 1 ns is malformed", ended.err)
    assert "Traceback" not in ended.err


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--rate", "0"), "--rate: 0 would never end"),
        (("--rate", "1001"), "--rate: 1001 is not a number from 0 to 1000"),
        (("--rate", "nan"), "--rate: 'nan' is not a number"),
        (("--rate", "1_0"), "--rate: '1_0' is not a number"),
        (("--from", "-1"), "--from: -1 s is negative"),
        (("--from", "3"), "it lasts from 0.000 to 2.497 s of the run"),
        (("--namespace", "a b"), "--namespace: 'a b' is not a ROS namespace"),
        (("--topics", "/line1/scan"), "did you mean /line1/scans?"),
    ],
)
def test_wrong_usage(ros_domain_id, bag, options, words):
    ended = automax_here("play", bag, *options)
    assert ended.code == 2
    assert words in ended.err
    assert "Traceback" not in ended.err


def test_what_is_no_recording_is_refused(ros_domain_id, tmp_path):
    assert "AMX6810" in automax_here("play", tmp_path / "none").err
    (tmp_path / "scans_0.mcap").write_bytes(b"nothing")
    ended = automax_here("play", tmp_path / "scans_0.mcap")
    assert ended.code == 2
    assert "AMX6810" in ended.err


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_stop_during_the_start_is_clean(ros_domain_id, bag, number):
    with Automax("play", bag) as player:
        player.wait_until_catching(signal.SIGTERM)
        ended = player.end(number, number)
    assert (ended.code, ended.err) == (0, "")
