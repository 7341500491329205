"""The loop of a live rack in this process: deadlines, stalls, the executor's stand-in."""

import time
from collections.abc import Callable
from itertools import pairwise

import pytest
from rack.helpers import Observer, rack_at
from system.support import TYPES, Client

from automax_ros.core.ticks import NS_PER_MS
from automax_ros.rack.rack import Rack
from automax_ros.rackfile.loader import load
from automax_ros.ros.setup import process as executor_module
from ros.support import PATIENCE_NS


class Scans(Observer):
    """Notes the scans of one task, and may do something in each."""

    def __init__(self, name: str, action: Callable[[int], None] = lambda _: None) -> None:
        self.scans: list[tuple[int, int, int]] = []
        self._name = name
        self._action = action

    def scanned(self, task, record, _):
        if task.name == self._name and record.scan:
            self.scans.append((record.scan, record.time_ns, record.skipped))
            self._action(record.scan)


@pytest.fixture
def live(ros_domain_id):
    """A live rack that is closed at the end."""
    from automax_ros.ros.live_rack import LiveRack

    made = LiveRack(rack_at(TYPES, stopwatch=time.perf_counter_ns))
    yield made
    made.close()


def run_until(live, condition, *chores):
    """Let the rack live until a condition is true, with chores between scans."""

    def on_idle(now_ns: int) -> None:
        for chore in chores:
            chore()
        live.stopping = bool(condition())

    live.run(PATIENCE_NS, on_idle)
    assert condition(), "the rack never came so far"


def test_stall_skips_scans_counts_them_and_keeps_the_grid(live):
    period = 2_500_000

    def stall(scan: int) -> None:
        if scan == 20:
            time.sleep(0.1)

    observer = Scans("COPY", stall)
    live.rack.observe(observer)
    live.start([])
    run_until(live, lambda: len(observer.scans) > 60)
    assert [scan for scan, _, _ in observer.scans] == list(range(1, len(observer.scans) + 1))
    for (_, before, _), (_, after, skipped) in pairwise(observer.scans):
        assert after - before == period * (1 + skipped)
    assert observer.scans[0][1] % period == 0
    stalled = observer.scans[20]
    assert stalled[2] >= 0.1 / 0.0025 - 2
    statistics = live.rack.statistics["COPY"]
    assert statistics.skipped == sum(skipped for _, _, skipped in observer.scans)
    assert statistics.scans == len(observer.scans)


def test_duration_ends_the_run_at_its_instant(live):
    observer = Scans("FAST")
    live.rack.observe(observer)
    live.start([("REF%", 12)])
    live.run(200 * NS_PER_MS, lambda _: None)
    assert live.rack.value("TWICE%") == 24
    last = observer.scans[-1][1]
    assert last < 200 * NS_PER_MS <= last + 5_500_000 * 2
    assert live.rack.now_ns == 200 * NS_PER_MS


def test_first_scans_stand_at_zero(live):
    """Start-up work is done before rack time 0: the first scan of every task stands at 0, unless the host is late."""
    observers = [Scans(name) for name in ("FAST", "SLOW", "COPY")]
    for observer in observers:
        live.rack.observe(observer)
    live.start([])
    run_until(live, lambda: all(observer.scans for observer in observers))
    for observer, period in zip(observers, (5_500_000, 16_500_000, 2_500_000), strict=True):
        scan, time_ns, skipped = observer.scans[0]
        assert (scan, time_ns) == (1, skipped * period)


def test_write_is_stamped_with_its_own_instant(live):
    """Between two scans, not at the last one."""
    from std_msgs.msg import Int16

    stamps: list[int] = []
    observer = Scans("SLOW")
    observer.written = lambda writes: stamps.extend(write.time_ns for write in writes if write.writer == 1)
    live.rack.observe(observer)
    live.start([])
    with Client() as client:
        publisher = client.node.create_publisher(Int16, "/types/common/REF/set", 10)
        sent = iter(range(1, 1000))

        def send() -> None:
            if publisher.get_subscription_count():
                publisher.publish(Int16(data=next(sent)))

        run_until(live, lambda: len(stamps) >= 5, send)
    assert stamps == sorted(stamps)
    assert any(stamp % 500_000 for stamp in stamps), "all scans stand on multiples of 0.5 ms"


def test_single_threaded_executor_stands_in(ros_domain_id, monkeypatch):
    from rclpy.executors import SingleThreadedExecutor
    from std_msgs.msg import Int16

    from automax_ros.ros.live_rack import LiveRack

    monkeypatch.setattr(executor_module, "dispatches", lambda *_: False)
    live = LiveRack(rack_at(TYPES))
    try:
        assert isinstance(live._executor, SingleThreadedExecutor)
        live.start([])
        with Client() as client:
            doubled = client.listen(Int16, "/types/common/TWICE", latched=True, depth=1)
            publisher = client.node.create_publisher(Int16, "/types/common/REF/set", 10)

            def write() -> None:
                client.executor.spin_once(timeout_sec=0)
                publisher.publish(Int16(data=77))

            run_until(live, lambda: bool(doubled) and doubled[-1].data == 154, write)
    finally:
        live.close()


def test_executor_that_dispatches_is_found(ros_domain_id):
    from rclpy.context import Context
    from rclpy.executors import SingleThreadedExecutor

    context = Context()
    context.init(args=[])
    try:
        single = SingleThreadedExecutor(context=context)
        assert executor_module.dispatches(single, context)
        single.shutdown()

        class Idle:
            def add_node(self, node):
                pass

            remove_node = add_node

            def spin_once(self, timeout_sec):
                pass

        assert not executor_module.dispatches(Idle(), context)
        made = executor_module.make_executor(context)
        assert executor_module.dispatches(made, context)
        made.shutdown()
    finally:
        context.try_shutdown()


def test_closing_before_the_start_is_clean(ros_domain_id):
    from automax_ros.ros.live_rack import LiveRack

    live = LiveRack(rack_at(TYPES))
    live.close()
    live.close()


def test_two_topics_of_one_name_are_refused_with_the_reason(ros_domain_id):
    from automax_ros.ros.live_rack import LiveRack
    from automax_ros.ros.setup.arguments import split_arguments
    from automax_ros.ros.setup.environment import RosUnavailable

    arguments = split_arguments(["--ros-args", "-r", "scans:=states"])[1]
    with pytest.raises(RosUnavailable, match="existing topic name rt/types/states with incompatible type") as caught:
        LiveRack(Rack(load(TYPES).config), arguments)
    assert "one name" in str(caught.value.hint)
