"""What other programs publish on a rack's topics: no recording holds it, ends by it, or fails to begin by it."""

import os
import signal

import pytest

from automax_ros.messages.cdr.cdr import encode
from automax_ros.messages.types.messages import CommonWrite, Scan, Values, VariableTable
from automax_ros.recordings.read.reader import BagReader
from system.support import TYPES, Automax, Client, wait_until

BEGUN = "recording since"
READY = "Ctrl-C ends the run"
FORGED_RUN = 0x0BAD


@pytest.fixture
def rack(ros_domain_id):
    with Automax("run", TYPES) as process:
        process.wait_for_line(READY)
        yield process
        assert process.end(signal.SIGINT).code == 0


class Forger(Client):
    """Publishes what a rack would, in another program."""

    def latched(self, kind, topic):
        from rclpy.qos import DurabilityPolicy, QoSProfile

        return self.node.create_publisher(kind, topic, QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL))

    def forge(self, publishers):
        """Publish a table of a run that never was, and scans, writes and files of it; once each."""
        table = VariableTable(1, "TYPES", FORGED_RUN)
        values = Values((0,), (0,), (666.0,), ())
        publishers["variables"].publish(encode(table))
        publishers["scans"].publish(encode(Scan(1, 1, "FAST", 666_666, full=True, written=values)))
        publishers["backplane"].publish(encode(CommonWrite(1, FORGED_RUN, 0, 0, 0, 1, values)))
        publishers["config"].publish(b"\x00\x01\x00\x00\x05\x00\x00\x00evil\x00")

    def publishers(self):
        from automax_msgs.msg import CommonWrite as WriteClass
        from automax_msgs.msg import Scan as ScanClass
        from automax_msgs.msg import VariableTable as TableClass
        from std_msgs.msg import String

        return {
            "variables": self.latched(TableClass, "/types/variables"),
            "config": self.latched(String, "/types/config"),
            "scans": self.node.create_publisher(ScanClass, "/types/scans", 1000),
            "backplane": self.node.create_publisher(WriteClass, "/types/backplane", 1000),
        }


def test_recording_holds_the_rack_alone(rack, tmp_path):
    bag = tmp_path / "bag"
    with Forger() as forger:
        publishers = forger.publishers()
        forger.forge(publishers)  # latched: a recorder finds these first
        with Automax("record", "TYPES", "--output", bag) as recorder:
            recorder.wait_for_line(BEGUN)
            wait_until(lambda: publishers["scans"].get_subscription_count() > 0)
            for _ in range(20):
                forger.forge(publishers)
            recorder.wait_for_line("left out what another program publishes on /types/scans")
            ended = recorder.end(signal.SIGINT)
    assert (ended.code, ended.err) == (0, "")
    assert "left out what another program publishes on /types/variables" in ended.out
    assert "messages of other programs left out" in ended.out
    messages = list(BagReader(bag).messages())
    tables = [item.message for item in messages if item.topic == "/types/variables"]
    assert {table.run_id for table in tables} != {FORGED_RUN}
    assert len({table.run_id for table in tables}) == 1
    assert 666_666 not in {item.message.scan for item in messages if item.topic == "/types/scans"}
    runs = {item.message.run_id for item in messages if item.topic == "/types/backplane"}
    assert runs == {tables[0].run_id}
    with Automax("bag", "info", bag, "--check") as checked:
        assert checked.end().code == 0


def test_rack_that_does_not_exist_is_not_found(ros_domain_id, tmp_path):
    """A table alone is not a rack."""
    with Forger() as forger:
        forger.forge(forger.publishers())
        with Automax("record", "TYPES", "--output", tmp_path / "bag", "--wait", "3") as recorder:
            ended = recorder.end()
    assert ended.code == 2
    assert not (tmp_path / "bag").exists()


def test_two_racks_of_one_name_are_told(ros_domain_id, tmp_path):
    """As on two hosts: each has its own folder of locks. A recorder may find the second when it records already."""
    bag = tmp_path / "bag"
    (tmp_path / "other").mkdir()
    with Automax("run", TYPES) as first:
        first.wait_for_line(READY)
        with Automax("run", TYPES, environment=os.environ | {"TMPDIR": str(tmp_path / "other")}) as second:
            second.wait_for_line(READY)
            with Automax("record", "TYPES", "--output", bag) as recorder:
                told = "another rack is called /types too: it is not recorded"
                wait_until(lambda: recorder.process.poll() is not None or told in "".join(recorder.out))
                ended = recorder.end(signal.SIGINT)
    if ended.code == 2:
        assert "2 racks are called /types" in ended.err
        assert not bag.exists()
    else:
        assert (ended.code, ended.err) == (0, "")
        assert len({item.message.run_id for item in BagReader(bag).messages() if item.topic == "/types/backplane"}) == 1
