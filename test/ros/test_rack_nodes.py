"""A rack in somebody else's process: their context, their executor, their nodes next to it."""

import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest
from system.support import PATIENCE_S, RACKS, TYPES, wait_until

from automax_ros.compile.compiler import compile_program
from automax_ros.core.diagnostics import SourceText
from automax_ros.core.ticks import NS_PER_MS, NS_PER_S
from automax_ros.rack.base.observers import Observers
from automax_ros.rack.rack import Rack
from automax_ros.rack.tasks.installation import RackError
from automax_ros.rackfile.loader import load

ROOT = Path(__file__).parents[2]


@pytest.fixture(params=["EventsExecutor", "SingleThreadedExecutor", "MultiThreadedExecutor"])
def executor(request, context):
    from rclpy import executors, experimental

    kind = getattr(executors, request.param, None) or getattr(experimental, request.param)
    made = kind(context=context)
    yield made
    made.shutdown()


@pytest.fixture
def nodes(context):
    from automax_ros.ros.rack_nodes import RackNodes

    with RackNodes(TYPES, context=context) as made:
        yield made


def spin_until(executor, condition):
    deadline = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < deadline, "it never came true"
        executor.spin_once(timeout_sec=0.05)


def test_own_node_works_with_the_rack_in_one_executor(context, executor, nodes):
    """A node of the user's own writes a common, the rack's task doubles it, the node hears of it."""
    from rclpy.node import Node
    from rclpy.qos import DurabilityPolicy, QoSProfile
    from std_msgs.msg import Int16

    mine = Node("mine", context=context)
    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    heard: list[int] = []
    mine.create_subscription(Int16, "/types/common/TWICE", lambda message: heard.append(message.data), latched)
    publisher = mine.create_publisher(Int16, "/types/common/REF/set", 10)
    mine.create_timer(0.05, lambda: publisher.publish(Int16(data=77)))
    executor.add_node(mine)
    nodes.add_to(executor)
    nodes.start([("REF%", 12)])
    spin_until(executor, lambda: heard and heard[-1] == 154)
    executor.remove_node(mine)
    mine.destroy_node()
    with nodes.lock:
        assert nodes.rack.value("REF%") == 77
    assert nodes.rack.statistics["FAST"].scans > 0
    assert not nodes.health.counts


def test_scans_go_on_while_a_callback_of_the_users_takes_long(context, nodes):
    """The rack has a thread of its own, so a slow callback delays messages, not scans."""
    from rclpy.executors import SingleThreadedExecutor

    executor = SingleThreadedExecutor(context=context)
    nodes.add_to(executor)
    nodes.start()
    wait_until(lambda: nodes.rack.statistics["FAST"].scans > 0)
    slow = threading.Event()
    executor.create_task(slow.wait, PATIENCE_S)
    spinning = threading.Thread(target=executor.spin_once)
    spinning.start()
    before = nodes.rack.statistics["FAST"].scans
    wait_until(lambda: nodes.rack.statistics["FAST"].scans > before + 20)
    assert spinning.is_alive(), "the callback goes on all the while"
    slow.set()
    spinning.join()
    executor.shutdown()


def test_scans_stand_on_the_grid(nodes):
    seen = []

    class Observer:
        def scanned(self, task, record, _):
            if task.name == "FAST" and record.scan:
                seen.append((record.scan, record.time_ns))

        def written(self, writes):
            pass

        tuned = operated = written

    nodes.rack.observe(Observer())
    nodes.start()
    wait_until(lambda: len(seen) > 20)
    assert [scan for scan, _ in seen[:20]] == list(range(1, 21))
    assert not [at for _, at in seen if at % 5_500_000]


def test_run_ends_at_its_time(context, nodes):
    from rclpy.executors import SingleThreadedExecutor

    executor = SingleThreadedExecutor(context=context)
    nodes.add_to(executor)
    nodes.start(paced=False)
    nodes.run(100 * NS_PER_MS)
    assert nodes.rack.now_ns == 100 * NS_PER_MS
    executor.shutdown()


def test_nothing_stays_in_the_graph(context, executor):
    """Neither nodes nor topics nor services, but for one that rclpy leaves of each node: the process lives on."""
    from rclpy.node import Node

    from automax_ros.ros.rack_nodes import RackNodes

    witness = Node("witness", context=context)
    executor.add_node(witness)

    def of_the_rack():
        found = witness.get_topic_names_and_types() + witness.get_service_names_and_types()
        return [name for name, _ in found if name.startswith("/types/") and "type_desc" not in name]

    with RackNodes(TYPES, context=context) as nodes:
        nodes.add_to(executor)
        nodes.start()
        spin_until(executor, of_the_rack)
    spin_until(executor, lambda: not of_the_rack())
    assert witness.get_node_names() == ["witness"]
    executor.remove_node(witness)
    witness.destroy_node()


def test_two_racks_share_a_process(context, executor, tmp_path):
    from automax_ros.ros.rack_nodes import RackNodes

    (tmp_path / "rack.yaml").write_text(
        "rack: OTHER\nslots:\n  0: {module: 57C435, tasks: {T: {priority: 5}}}\ncommon:\n  COUNT%:\n"
    )
    (tmp_path / "T.BLK").write_text("10 COMMON COUNT%\n100 CALL SCAN_LOOP(TICKS=1)\n110 COUNT% = COUNT% + 1\n120 END\n")
    with RackNodes(TYPES, context=context) as first, RackNodes(tmp_path / "rack.yaml", context=context) as second:
        for nodes in (first, second):
            nodes.add_to(executor)
            nodes.start()
        spin_until(executor, lambda: second.rack.value("COUNT%") > 20 and first.rack.statistics["FAST"].scans > 20)


def test_rack_of_ones_own_and_closing_before_the_start(context):
    from automax_ros.ros.rack_nodes import RackNodes

    rack = Rack(load(TYPES).config)
    nodes = RackNodes(rack, context=context)
    assert nodes.rack is rack
    assert [node.get_fully_qualified_name() for node in nodes.nodes] == [
        "/types/common_memory", "/types/processor_1", "/types/processor_2",
    ]  # fmt: skip
    nodes.close()
    nodes.close()


def test_file_with_errors_says_so(context, tmp_path):
    from automax_ros.ros.rack_nodes import RackNodes

    (tmp_path / "rack.yaml").write_text("rack: [\n")
    with pytest.raises(RackError, match=r"rack\.yaml has errors") as caught:
        RackNodes(tmp_path / "rack.yaml", context=context)
    assert caught.value.findings


def test_what_prepares_ros_needs_no_rclpy():
    """``prepare`` must be there before rclpy is imported."""
    program = "import sys; from automax_ros import prepare; assert 'rclpy' not in sys.modules"
    subprocess.run([sys.executable, "-c", program], check=True)


def test_every_kind_of_module_has_its_node_or_none():
    from automax_ros.rackfile.modules.registry import KINDS
    from automax_ros.ros.nodes.registry import NODES

    assert set(NODES) == set(KINDS)


def test_digital_modules_show_their_registers(context, tmp_path):
    """A push button that ROS presses reaches the word that diagnostics show."""
    from diagnostic_msgs.msg import DiagnosticArray
    from rclpy.executors import SingleThreadedExecutor
    from rclpy.node import Node
    from std_msgs.msg import Bool

    from automax_ros.ros.rack_nodes import RackNodes

    (tmp_path / "rack.yaml").write_text(
        "rack: IO\nslots:\n  0: {module: 57C413}\n  1: {module: 57C435, tasks: {T: {priority: 5}}}\n"
        "  5: {module: 57C419}\n"
        "common:\n  START_PB@: {slot: 5, register: 0, bit: 3, ros: in}\n  SEEN@: {ros: out}\n"
    )
    (tmp_path / "T.BLK").write_text(
        "10 COMMON START_PB@, SEEN@\n100 CALL SCAN_LOOP(TICKS=1)\n110 SEEN@ = START_PB@\n120 END\n"
    )
    executor = SingleThreadedExecutor(context=context)
    button = Node("button", context=context)
    arrays = []
    button.create_subscription(DiagnosticArray, "/diagnostics", arrays.append, 10)
    publisher = button.create_publisher(Bool, "/io/common/START_PB/set", 10)
    executor.add_node(button)

    def shown():
        statuses = [status for array in arrays for status in array.status if status.name == "io/digital_io_5: 57C419"]
        return {pair.key: pair.value for status in statuses[-1:] for pair in status.values}

    nothing = {f"register_{number}": "0000H" for number in range(4)}
    with RackNodes(tmp_path / "rack.yaml", context=context) as nodes:
        names = [node.get_name() for node in nodes.nodes]
        assert names == ["common_memory", "processor_1", "digital_io_5"]
        nodes.add_to(executor)
        nodes.start()
        spin_until(executor, lambda: shown() == {**nothing, "register_0": "0000H"})
        spin_until(executor, publisher.get_subscription_count)
        publisher.publish(Bool(data=True))
        spin_until(executor, lambda: nodes.rack.value("SEEN@"))
        spin_until(executor, lambda: shown() == {**nothing, "register_0": "0008H"})
    button.destroy_node()
    executor.shutdown()


def test_parameters_are_those_of_the_source_that_runs(context):
    from rclpy.parameter import Parameter

    from automax_ros.ros.rack_nodes import RackNodes

    with RackNodes(TYPES, context=context) as nodes:
        node = next(node for node in nodes.nodes if node.get_name() == "processor_1")
        nodes.start(paced=False)
        source = nodes.rack.sources["FAST"]
        node.set_parameters([Parameter("FAST.TRIM", value=50)])
        assert nodes.rack.task("FAST").value("TRIM%") == 50
        text = source.text.replace("CURRENT=3, HIGH=100", "CURRENT=4, HIGH=40").replace("FREE", "LOOSE")
        nodes.rack.operations.reload("FAST", SourceText("new/FAST.BLK", text))
        assert not node.has_parameter("FAST.FREE")
        assert (node.get_parameter("FAST.TRIM").value, node.get_parameter("FAST.LOOSE").value) == (4, 1.5)
        low, high = node.set_parameters([Parameter("FAST.TRIM", value=39), Parameter("FAST.TRIM", value=41)])
        assert (low.successful, high.successful) == (True, False)
        assert nodes.rack.task("FAST").value("TRIM%") == 39


def test_what_is_done_under_the_lock_happens_in_the_present(context):
    """Else a task put into RUN while nothing was due would begin in the past, and count scans as skipped."""
    from automax_ros.ros.rack_nodes import RackNodes

    with RackNodes(TYPES, context=context) as nodes:
        with nodes.lock:
            assert nodes.rack.now_ns == 0
        nodes.start(paced=False)
        nodes.run(20 * NS_PER_MS)
        nodes.rack.operations.stop_tasks()
        time.sleep(0.05)  # rack time has to pass, and nothing happens in it
        with nodes.lock:
            assert nodes.rack.now_ns >= 70 * NS_PER_MS
        assert nodes.health.counts["failed callback"] == 0, "without an executor there is nothing to spin"


def test_a_rack_scans_while_a_new_source_is_compiled(context, executor, monkeypatch):
    """The compiler is held up until ten more scans have passed; a second reload is refused meanwhile."""
    from automax_msgs.srv import Reload
    from rclpy.node import Node

    from automax_ros.ros.rack_nodes import RackNodes

    folder = RACKS / "operated"
    source = (folder / "SPEED.BLK").read_text()
    go_on, compiling = threading.Event(), threading.Event()

    def slow(*given):
        compiling.set()
        assert go_on.wait(PATIENCE_S), "nothing goes on"
        return compile_program(*given)

    user = Node("user", context=context)
    client = user.create_client(Reload, "/operated/reload")
    executor.add_node(user)
    with RackNodes(folder / "rack.yaml", context=context) as nodes:
        told = []
        monkeypatch.setattr(Observers, "operated", lambda _, operation: told.append(operation))
        monkeypatch.setattr("automax_ros.rack.tasks.installation.compile_program", slow)
        nodes.add_to(executor)
        nodes.start()
        spin_until(executor, client.service_is_ready)
        first = client.call_async(Reload.Request(task="LINE", source=(folder / "LINE.BLK").read_text()))
        spin_until(executor, compiling.is_set)
        before = nodes.rack.statistics["SPEED"].scans
        spin_until(executor, lambda: nodes.rack.statistics["SPEED"].scans > before + 10)
        second = client.call_async(Reload.Request(task="LINE", source=source))
        spin_until(executor, second.done)
        assert not second.result().ok
        assert "the new source of LINE is still being compiled" in second.result().reason
        assert not first.done()
        assert [(item.what, item.ok) for item in told] == [("reload", False)]
        go_on.set()
        spin_until(executor, first.done)
        assert (first.result().ok, first.result().reason) == (True, "")
        assert [(item.what, item.ok) for item in told] == [("reload", False), ("reload", True)]
        wrong = client.call_async(Reload.Request(task="LINE", source="10 END!"))
        spin_until(executor, wrong.done)
        assert not wrong.result().ok
        assert wrong.result().findings[0].startswith("LINE.BLK:1:")
        assert not told[-1].ok
    user.destroy_node()


SMALL_BUFFER = """<?xml version="1.0" encoding="UTF-8"?>
<dds><profiles xmlns="http://www.eprosima.com/XMLSchemas/fastRTPS_Profiles">
  <transport_descriptors><transport_descriptor>
    <transport_id>small</transport_id><type>UDPv4</type><receiveBufferSize>65500</receiveBufferSize>
  </transport_descriptor></transport_descriptors>
  <participant profile_name="small" is_default_profile="true"><rtps>
    <userTransports><transport_id>small</transport_id></userTransports>
    <useBuiltinTransports>false</useBuiltinTransports>
  </rtps></participant>
</profiles></dds>
"""
READER = """
import time
from rclpy.context import Context
from rclpy.node import Node
from automax_ros.messages.types.topics import SCAN
from automax_ros.recordings.live.topics import TopicKind
from automax_ros.messages.cdr.message_headers import scan_head
from automax_ros.ros.clients.recorder import RawSubscription

context = Context()
context.init(args=[])
node = Node("reader", context=context)
source = RawSubscription(node, "/types/scans", TopicKind("automax_msgs/msg/Scan", SCAN))
print("up", flush=True)
last, is_known, is_there = {}, False, True
while not is_known or is_there:
    is_there = node.count_publishers("/types/scans") > 0  # before the last look at what has come
    for found in source.taken():
        head = scan_head(found.payload)
        is_known = is_known or print("receives", flush=True) is None
        last[head.task] = head.scan
    time.sleep(0.01)
print(*(f"{task}={scan}" for task, scan in sorted(last.items())), flush=True)
"""


def test_a_rack_that_ends_waits_for_a_reader_that_is_late(context, ros_domain_id, tmp_path, monkeypatch):
    """What the reader's socket dropped while the reader was held up is sent again before the rack leaves the graph."""
    from automax_ros.ros import rack_nodes
    from automax_ros.ros.rack_nodes import RackNodes

    monkeypatch.setattr(rack_nodes, "DELIVERY_NS", int(PATIENCE_S * NS_PER_S))

    (tmp_path / "small.xml").write_text(SMALL_BUFFER)
    environment = os.environ | {"FASTRTPS_DEFAULT_PROFILES_FILE": str(tmp_path / "small.xml")}
    reader = subprocess.Popen([sys.executable, "-c", READER], stdout=subprocess.PIPE, text=True, env=environment)
    try:
        assert reader.stdout.readline() == "up\n"
        with RackNodes(TYPES, context=context) as nodes:
            scanned = nodes.rack.statistics["FAST"]
            nodes.start()
            assert reader.stdout.readline() == "receives\n"
            reader.send_signal(signal.SIGSTOP)
            before = scanned.scans
            wait_until(lambda: scanned.scans > before + 100)
            threading.Timer(0.3, reader.send_signal, (signal.SIGCONT,)).start()
        last = dict(part.split("=") for part in reader.stdout.readline().split())
        assert last == {name: str(item.scans) for name, item in nodes.rack.statistics.items()}
    finally:
        reader.kill()
        reader.wait()
