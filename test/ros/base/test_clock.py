"""A rack's time and /clock: told where the rack's time is simulated, followed message by message with use_sim_time."""

import threading
from collections import deque
from itertools import pairwise

import pytest
from rack.helpers import Observer
from system.support import TYPES, ns, wait_until

from automax_ros.core.ticks import NS_PER_MS, NS_PER_S
from automax_ros.rack.rack import Rack
from automax_ros.rackfile.loader import load
from automax_ros.rackfile.model.writers import ROS_WRITER
from automax_ros.ros.intake.intake import MOST_OF_ONE, MOST_ROUNDS_FIRST, MessageIntake
from automax_ros.ros.setup.arguments import split_arguments
from automax_ros.runtime.time.simulated_pacer import LEAST_TICK_NS, MOST_TICK_NS, SimulatedTime
from ros.intake.test_service_requests import parameter
from ros.support import until

EPOCH_NS = 1_700_000_000 * NS_PER_S
STEP_NS = 20 * NS_PER_MS


@pytest.fixture
def made(ros_domain_id):
    """Live racks in simulated time, or with ROS arguments; closed at the end."""
    from automax_ros.ros.live_rack import LiveRack

    lives: list[LiveRack] = []

    def make(*words, simulated=None):
        _, arguments = split_arguments(["--ros-args", *words], {})
        lives.append(LiveRack(Rack(load(TYPES).config), arguments, simulated=simulated))
        return lives[-1]

    yield make
    for live in lives:
        live.close()


class Log(Observer):
    """All scans of a rack, and what was written from outside, with their times."""

    def __init__(self, rack) -> None:
        self.entries: list[object] = []
        rack.observe(self)

    def scanned(self, task, record, writes):
        assert record.skipped == 0
        self.entries.append((task.name, record.scan, record.time_ns, tuple(map(str, writes))))

    def written(self, writes):
        self.entries += [str(write) for write in writes]


def test_simulated_rack_tells_the_clock_after_all_messages_of_the_instant(made):
    live = made(simulated=SimulatedTime())
    happened: list[tuple[str, int]] = []
    clock = live.nodes._clock
    publish = clock.pace._publish

    def told(now_ns):
        publish(now_ns)
        happened.append(("clock", now_ns))

    clock.pace._publish = told
    live.stream.add_sink(
        lambda topic: (lambda stamp, _: happened.append(("scan", stamp))) if "scans" in topic.name else None
    )
    live.start([])
    live.run(NS_PER_S, lambda _: None)
    assert live.rack.now_ns == NS_PER_S
    assert [at for _, at in happened] == sorted(at for _, at in happened)
    for (before, at), (after, then) in pairwise(happened):
        assert not (before == "clock" and after == "scan" and at == then), f"a scan of {at} ns after its clock"
    clocks = [at for what, at in happened if what == "clock"]
    assert clocks[0] == 0
    assert all(LEAST_TICK_NS <= after - before <= MOST_TICK_NS for before, after in pairwise(clocks))
    assert live.rack.statistics["COPY"].scans == 400
    assert live.rack.statistics["COPY"].skipped == 0


def test_simulated_rack_in_the_graph(made, client):
    """Its clock is heard, its stamps are rack time, a write falls between two instants, another clock is told of."""
    from automax_msgs.msg import Scan
    from rosgraph_msgs.msg import Clock
    from std_msgs.msg import Int16

    live = made("-p", "use_sim_time:=true", simulated=SimulatedTime(5.0))
    live.start([])
    clocks = client.listen(Clock, "/clock")
    scans = client.listen(Scan, "/types/scans")
    heard = client.listen(Int16, "/types/common/TWICE", latched=True)
    other = client.node.create_publisher(Clock, "/clock", 10)
    writing = client.node.create_publisher(Int16, "/types/common/REF/set", 10)
    until(live, client, lambda: clocks and scans and heard and writing.get_subscription_count())
    writing.publish(Int16(data=123))
    until(live, client, lambda: heard[-1].data == 246)
    until(live, client, lambda: live.health.counts["other /clock"] == 1)
    times = [ns(message.clock) for message in clocks]
    assert times == sorted(set(times))
    assert times[-1] < 1000 * NS_PER_S
    assert all(ns(scan.stamp) < 1000 * NS_PER_S for scan in scans)
    assert live.rack.statistics["FAST"].skipped == 0
    client.node.destroy_publisher(other)


class Following:
    """A rack that follows a clock of the test's own, in lockstep."""

    def __init__(self, live, client) -> None:
        from rosgraph_msgs.msg import Clock

        self.live, self._client, self._kind = live, client, Clock
        self.log = Log(live.rack)
        self._clock = client.node.create_publisher(Clock, "/clock", 10)
        self._stop = False
        live.start([])
        self._thread = threading.Thread(target=lambda: live.run(None, self._look))
        self._thread.start()

    def _look(self, _: int) -> None:
        self.live.stopping = self._stop

    def tell(self, clock_ns: int) -> None:
        message = self._kind()
        message.clock.sec, message.clock.nanosec = divmod(clock_ns, NS_PER_S)
        self._clock.publish(message)

    def begin(self) -> None:
        """Tell the same time until the rack has begun with it."""

        def begun() -> bool:
            self.tell(EPOCH_NS)
            return bool(self.live.nodes.has_begun) and bool(self.log.entries)

        wait_until(begun)

    def go_to(self, at_ns: int) -> None:
        self.tell(EPOCH_NS + at_ns)
        wait_until(lambda: self.live.rack.now_ns == at_ns, pause_s=0.001)

    def write(self, value: int) -> None:
        from std_msgs.msg import Int16

        self._client.send(Int16, "/types/common/REF/set", Int16(data=value))
        wait_until(lambda: self.live.rack.value("REF%") == value, pause_s=0.001)

    def end(self) -> None:
        self._stop = True
        self._thread.join()
        self._client.node.destroy_publisher(self._clock)


WRITES = {3: 17, 11: -5, 12: 300}


def followed(live, client):
    following = Following(live, client)
    try:
        following.begin()
        for step in range(20):
            following.go_to(step * STEP_NS)
            if step in WRITES:
                following.write(WRITES[step])
        following.go_to(20 * STEP_NS)
        with live.nodes.lock:
            return list(following.log.entries)
    finally:
        following.end()


def simulated():
    rack = Rack(load(TYPES).config)
    log = Log(rack)
    rack.start()
    for step in range(20):
        rack.scheduler.run_through(step * STEP_NS)
        if step in WRITES:
            rack.write("REF%", WRITES[step], writer=ROS_WRITER)
    rack.scheduler.run_through(20 * STEP_NS)
    return log.entries


def test_same_clock_and_writes_give_the_same_scans_as_simulated_time(made, client):
    """Over real DDS, twice; the log has every scan with its values, and every write with its time."""
    expected = simulated()
    assert len(expected) > 150
    for _ in range(2):
        live = made("-p", "use_sim_time:=true")
        assert followed(live, client) == expected
        live.close()


@pytest.mark.parametrize("second", [(1 << 31) - 1, (1 << 31) - 86400])
def test_a_clock_at_the_end_of_time_is_refused_and_the_rack_goes_on(made, client, second):
    """No stamp of ROS is later: a rack that took it could never send again."""
    live = made("-p", "use_sim_time:=true")
    following = Following(live, client)
    try:
        following.begin()
        following.go_to(NS_PER_S)
        following.tell(second * NS_PER_S)
        wait_until(lambda: live.health.counts["malformed /clock"] == 1)
        following.go_to(2 * NS_PER_S)
        assert live.rack.now_ns == 2 * NS_PER_S
        assert live.stream.stamp(live.rack.now_ns) == EPOCH_NS + 2 * NS_PER_S
    finally:
        following.end()


def test_a_clock_that_leaps_again_and_again_does_not_bring_stamps_to_the_end_of_time(made, client):
    """Each leap is added to the stamps, which do not go back with the clock: two of 13 years would be beyond 2038."""
    live = made("-p", "use_sim_time:=true")
    following = Following(live, client)
    leap_ns = 400_000_000 * NS_PER_S
    try:
        following.begin()
        following.tell(EPOCH_NS + leap_ns)
        wait_until(lambda: live.health.counts["clock jump"] == 1)
        following.tell(EPOCH_NS)
        wait_until(lambda: live.health.counts["clock jump"] == 2)
        following.tell(EPOCH_NS + leap_ns)
        wait_until(lambda: live.health.counts["malformed /clock"] == 1)
        following.tell(EPOCH_NS + NS_PER_S)
        wait_until(lambda: live.rack.now_ns == NS_PER_S)
        assert live.stream.stamp(live.rack.now_ns) == EPOCH_NS + leap_ns + NS_PER_S
        assert not live.health.counts["failed callback"]
    finally:
        following.end()


def test_clock_that_goes_back_or_leaps_is_told_and_rack_time_goes_on(made, client):
    live = made("-p", "use_sim_time:=true")
    following = Following(live, client)
    try:
        following.begin()
        following.go_to(NS_PER_S)
        following.tell(EPOCH_NS)
        wait_until(lambda: live.health.counts["clock jump"] == 1)
        following.tell(EPOCH_NS + STEP_NS)
        wait_until(lambda: live.rack.now_ns == NS_PER_S + STEP_NS)
        assert live.stream.stamp(live.rack.now_ns) == EPOCH_NS + NS_PER_S + STEP_NS
        following.tell(EPOCH_NS + STEP_NS + 3600 * NS_PER_S)
        wait_until(lambda: live.health.counts["clock jump"] == 2)
        assert live.rack.now_ns == NS_PER_S + STEP_NS
        assert live.stream.stamp(live.rack.now_ns) == EPOCH_NS + NS_PER_S + STEP_NS + 3600 * NS_PER_S
        told = live.health.news()
        assert any("went back by 1 s: rack time and stamps go on" in text for text in told)
        assert any("went ahead by 3600 s: the rack leaves that time out" in text for text in told)
    finally:
        following.end()


def test_parameter_says_whose_time_it_is_and_cannot_be_set_later(made, client):
    from rcl_interfaces.srv import SetParameters

    live = made("-p", "use_sim_time:=true")
    assert all(node.get_parameter("use_sim_time").value for node in live.nodes.nodes)
    asking = client.node.create_client(SetParameters, "/types/processor_1/set_parameters")
    client.until(asking.service_is_ready)
    wanted = SetParameters.Request(parameters=[parameter("use_sim_time", 1, bool_value=False)])
    found = client.result(asking.call_async(wanted))
    assert not found.results[0].successful
    assert found.results[0].reason == (
        "the rack follows /clock; use_sim_time cannot be set on its nodes: "
        "start it with --ros-args -p use_sim_time:=false"
    )
    wanted = SetParameters.Request(parameters=[parameter("use_sim_time", 1, bool_value=True)])
    assert client.result(asking.call_async(wanted)).results[0].successful


def test_rack_that_hears_no_clock_ends_when_asked(made):
    live = made("-p", "use_sim_time:=true")
    live.start([])
    looks: list[int] = []

    def look(now_ns: int) -> None:
        looks.append(now_ns)
        live.stopping = len(looks) == 3

    live.run(NS_PER_S, look)
    assert looks == [0, 0, 0]
    assert not live.nodes.has_begun


class Way:
    """An entrance with messages of the test's own."""

    def __init__(self, name, log, messages=()) -> None:
        self.name, self.handle, self.messages, self._log = name, None, deque(messages), log

    def take(self):
        if not self.messages:
            return False
        self._log.append((self.name, self.messages.popleft()))
        return True


def test_what_has_come_before_the_clock_is_taken_before_it(monkeypatch):
    """Writes in any number come first; those that come later wait for the next message of the clock at most."""
    log: list[tuple[str, int]] = []
    write, clock = Way("write", log, range(10)), Way("clock", log, [100, 101])
    intake = MessageIntake(lambda what, error: pytest.fail(f"{what}: {error}"))
    intake._last = clock
    looks = iter([[clock, write]])

    def woken(_):
        if ("clock", 100) in log and ("write", 10) not in log and not write.messages:
            write.messages.append(10)
            return [write]
        if ("clock", 101) in log:
            intake._closing = True
        return next(looks, [])

    monkeypatch.setattr(intake, "_woken", woken)
    intake._run()
    assert log == [*(("write", number) for number in range(10)), ("clock", 100), ("write", 10), ("clock", 101)]


def test_flood_of_writes_does_not_stop_the_clock(monkeypatch):
    log: list[tuple[str, int]] = []
    write, clock = Way("write", log, range(100_000)), Way("clock", log, [1, 2, 3])
    intake = MessageIntake(lambda what, error: pytest.fail(f"{what}: {error}"))
    intake._last = clock
    monkeypatch.setattr("automax_ros.ros.intake.intake.time.sleep", lambda _: None)

    def woken(_):
        intake._closing = not clock.messages
        return [clock, write]

    monkeypatch.setattr(intake, "_woken", woken)
    intake._run()
    at = [place for place, (name, _) in enumerate(log) if name == "clock"]
    assert at == [number * (MOST_ROUNDS_FIRST * MOST_OF_ONE + 1) - 1 for number in (1, 2, 3)]
