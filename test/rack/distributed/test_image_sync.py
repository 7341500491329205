"""One rack over three processes, without ROS: whatever the order in which writes arrive, all come to hold the same."""

from __future__ import annotations

from itertools import count

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from automax_ros.core.kinds import WriteKind
from automax_ros.core.ticks import NS_PER_MS
from automax_ros.rack.base.stop_cause import StopCause
from automax_ros.rack.distributed.image_sync import MOST_AHEAD_NS, Batch, ImageCopy, StopState
from automax_ros.rack.distributed.versions import VersionedValue
from automax_ros.rack.rack import Rack
from automax_ros.runtime.time.scheduler import EventClass, EventKey
from rack.distributed.parts import ONE, PROCESS_SLOTS, Process, config_in, cut, image, settle

WRITTEN = {
    "A%": st.integers(-32768, 32767),
    "R": st.sampled_from([0.0, 1.5, -2.25, 1e6]),
    "S$": st.sampled_from(["", "ABC", "12345678"]),
    "GO@": st.booleans(),
    "OUT%": st.integers(-32768, 32767),
    "OUT3@": st.booleans(),
    "OUT7@": st.booleans(),
    "LONG!": st.integers(-(2**31), 2**31 - 1),
    "LOW@": st.booleans(),
    "HALF": st.sampled_from([0.0, 0.5, -3.0]),
}
REPEATABLE = settings(deadline=None, derandomize=True, max_examples=60)


@pytest.fixture(scope="module")
def config(tmp_path_factory):
    return config_in(tmp_path_factory.mktemp("cut"))


@st.composite
def deeds(draw):
    """What happens: writes of one process after some ns, or one hears a few batches of another."""
    name = draw(st.sampled_from(sorted(WRITTEN)))
    write = st.tuples(st.just(name), WRITTEN[name], st.integers(0, 2), st.integers(0, 3))
    hear = st.tuples(st.just(""), st.integers(0, 2), st.integers(0, 2), st.integers(1, 2))
    return draw(st.one_of(write, hear))


def idle(config) -> list[Process]:
    """The processes with tasks that do not run: only what the test writes happens."""
    processes = cut(config)
    settle(processes)
    for process in processes:
        process.rack.operations.stop_tasks()
    return processes


def run(processes, seconds: float) -> None:
    """Let all run, and receive what the others have sent."""
    for process in processes:
        process.rack.run(seconds)
    settle(processes)


@REPEATABLE
@given(story=st.lists(deeds(), min_size=1, max_size=40))
def test_all_images_come_to_hold_the_same(config, story):
    processes = idle(config)
    model = {}
    order = count(1)
    for name, value, who, span in story:
        if not name:
            if value != who:
                processes[who].hear(processes[value], span)
            continue
        process = processes[who]
        process.rack.scheduler.pass_until(process.rack.now_ns + span)
        process.rack.write(name, value)
        note(model, process, name, value, next(order))
    settle(processes)
    first, *others = [image(process) for process in processes]
    assert all(other == first for other in others)
    for (name, mask), (_, value) in model.items():
        assert shown(processes[0], name, mask) == value


def note(model, process, name, value, order):
    """Keep, for each bit of a register and each plain common, the value with the greatest version."""
    memory = process.rack.memory
    view = memory.view(name)
    version = (process.rack.now_ns, process.link.process_slot, order)
    if view not in memory.registers.views:
        model[name, 0] = max(model.get((name, 0), ((-1,), None)), (version, value), key=lambda item: item[0])
        return
    for bank, register, bits, mask in memory.registers.parts(view, 0, value):
        for bit in range(16):
            if mask >> bit & 1:
                key = ((bank, register), bit)
                model[key] = max(model.get(key, ((-1,), 0)), (version, bits >> bit & 1), key=lambda item: item[0])


def shown(process, place, bit):
    memory = process.rack.memory
    if isinstance(place, str):
        return memory.read_now(memory.view(place))
    bank, register = place
    return int(memory.read_now(bank, register)) >> bit & 1


def test_a_task_of_one_process_feeds_a_task_of_another(config):
    memory_process, one, two = processes = cut(config)
    for _ in range(20):
        run(processes, 0.0055)
    assert one.rack.value("A%") == two.rack.value("A%") == memory_process.rack.value("A%") == 7 + 20
    # TWO latches what ONE wrote in the tick before.
    assert memory_process.rack.value("B%") == 7 + 19
    assert [task.name for task in one.rack.tasks] == ["ONE"]
    assert two.rack.part.tasks == ["TWO", "WIND_A"]


def test_presets_are_everybodys_own_and_a_write_wins_over_those_that_come_late(config):
    early, late = Process(config, PROCESS_SLOTS[1]), Process(config, PROCESS_SLOTS[2])
    early.start()
    early.rack.write("A%", 99)
    late.link.receive(early.sent[-1])
    late.start()
    assert early.sent[-1].entries == ((early.rack.memory.view("A%"), 0, 99),)
    assert late.rack.value("A%") == 99


def test_a_scan_that_was_late_gives_way_to_what_was_written_after_its_deadline(config):
    memory_process, one, _ = idle(config)
    memory_process.rack.scheduler.pass_until(7 * NS_PER_MS)
    memory_process.rack.write("B%", 70)
    memory_process.rack.write("OUT3@", value=True)
    one.hear(memory_process)
    one.rack.memory.now_ns = 5 * NS_PER_MS
    one.rack.memory.commit([(one.rack.memory.view("B%"), 5), (one.rack.memory.view("OUT%"), 0)], writer=3)
    one.rack.observers.report_writes()
    memory_process.hear(one)
    assert one.rack.value("B%") == memory_process.rack.value("B%") == 70
    assert one.rack.value("OUT%") == memory_process.rack.value("OUT%") == 8


@pytest.mark.parametrize(
    ("at_ns", "kind", "first", "second"),
    [
        (5_600_000, WriteKind.OUTSIDE, 7, 40),
        (5_500_000, WriteKind.OUTSIDE, 40, 40),
        (5_499_999, WriteKind.COMMIT, 40, 40),
        (5_500_000, WriteKind.COMMIT, 7, 40),
        (5_600_000, WriteKind.FORCE, 7, 40),
        (11_000_000, WriteKind.COMMIT, 7, 7),
        (5_500_000, WriteKind.BASIC, 7, 40),
        (11_000_000, WriteKind.BASIC, 7, 7),
        (11_000_000, WriteKind.OUTSIDE, 7, 40),
        (5_500_001 + MOST_AHEAD_NS, WriteKind.OUTSIDE, 40, 40),
    ],
)
def test_a_scan_that_is_late_does_not_see_what_was_written_after_its_deadline(config, at_ns, kind, first, second):
    """The scan of 5.5 ms has not been made yet when the batch comes: it sees what it would have seen in time."""
    for way in ("write", "picture"):
        two = Process(config, PROCESS_SLOTS[2]).start()
        two.rack.run(0.0055)
        view = two.rack.memory.view("A%")
        if way == "write":
            two.link.receive(Batch(1, 1, at_ns, 3, kind, ((view, 0, 40),)))
        elif kind is WriteKind.OUTSIDE:
            two.link.merge(ImageCopy(1, (VersionedValue(view, 0, 40, 0xFFFF, (at_ns, 1, 1)),), ()))
        else:
            continue
        seen = []
        for until_ms in (6, 12):
            two.rack.scheduler.run_due(until_ms * NS_PER_MS)
            seen.append(two.rack.value("B%"))
        assert seen == [first, second], way


def test_what_start_up_parts_wrote_is_there_before_the_first_scans(config):
    two = Process(config, PROCESS_SLOTS[2]).start()
    two.link.receive(Batch(1, 1, 0, 3, WriteKind.BASIC, ((two.rack.memory.view("A%"), 0, 40),)))
    two.rack.run(0.001)
    assert two.rack.value("B%") == 40


@pytest.mark.parametrize("end", ["stop", "last", "lost"])
def test_what_waits_for_its_time_is_taken_before_the_rack_stops_or_an_image_is_shown(config, end):
    """Else an output that was set before a STOP ALL came on again after it."""
    memory_process = Process(config, PROCESS_SLOTS[0]).start()
    memory_process.rack.run(0.0055)
    view = memory_process.rack.memory.view("OUT7@")
    tick = memory_process.rack.scheduler.every(
        5 * NS_PER_MS, 6 * NS_PER_MS, EventKey(EventClass.SCAN, 5, "late"), lambda *_: None
    )
    memory_process.link.receive(Batch(1, 1, 7 * NS_PER_MS, 3, WriteKind.COMMIT, ((view, 0, True),)))
    assert memory_process.rack.value("OUT7@") is False
    if end == "stop":
        cause = StopCause(8 * NS_PER_MS, "a fault", "31", "")
        memory_process.link.adopt(StopState(8 * NS_PER_MS, 1, cause))
    elif end == "last":
        memory_process.link.take_waiting()
    else:
        held = {item.view for item in memory_process.link.last_of(1).values}
        assert memory_process.rack.memory.registers.parts(view, 0, True)[0].bank in held
    memory_process.rack.scheduler.run_due(20 * NS_PER_MS)
    tick.cancel()
    assert memory_process.rack.value("OUT7@") is (end != "stop")


def test_a_damaged_image_that_waits_for_its_time_ends_nothing(config):
    reported = []

    def guard(take):
        with pytest.raises(OverflowError) as raised:
            take()
        reported.append(raised)

    two = Process(config, PROCESS_SLOTS[2], guard=guard).start()
    two.rack.run(0.0055)
    word = next(iter(two.rack.memory.registers.views))
    two.link.merge(ImageCopy(1, (VersionedValue(word, 0, float("inf"), 0xFFFF, (6 * NS_PER_MS, 1, 1)),), ()))
    assert not reported
    two.rack.scheduler.run_due(12 * NS_PER_MS)
    assert len(reported) == 1
    assert two.rack.task("TWO").scan_number == 2


def test_what_was_written_while_a_process_stood_still_comes_between_its_scans_in_order(config):
    """It has slept for 40 ms: of its scans the last is made, of what has come what was written before it."""
    _, one, two = cut(config)
    one.rack.run(0.04)
    two.rack.scheduler.pass_until(40 * NS_PER_MS)
    two.hear(one)
    two.rack.scheduler.run_due(40 * NS_PER_MS)
    assert two.rack.value("A%") == one.rack.value("A%") == 7 + 8
    assert two.rack.value("B%") == 7 + 7, "the eighth scan of ONE was at the instant of this one"
    assert two.rack.task("TWO").scan_number == 1


def test_a_force_holds_everywhere_until_it_is_released(config):
    memory_process, one, two = processes = cut(config)
    memory_process.rack.force("A%", 500)
    settle(processes)
    run(processes, 0.011)
    assert one.rack.value("A%") == two.rack.value("A%") == 500
    assert [force.name for force in two.rack.forces()] == ["A%"]
    memory_process.rack.unforce("A%")
    settle(processes)
    run(processes, 0.011)
    assert two.rack.value("A%") == 502
    assert two.rack.forces() == []


def test_a_stop_all_of_one_stops_all_and_outputs_are_off_everywhere(config):
    memory_process, one, two = processes = cut(config)
    one.rack.write("OUT7@", value=True)
    settle(processes)
    one.rack.run(0.001)
    one.rack.operations.stop_all("a fault of ONE", "14", "ONE")
    for process in (memory_process, two):
        process.link.adopt(one.link.standing)
    settle(processes)
    for process in processes:
        assert process.rack.operations.stopped.reason == "a fault of ONE"
        assert process.rack.operations.stopped.code == "14"
        assert image(process)["OUT%", 0] == 0
        assert image(process)["A%", 0] == 0
        assert process.link.standing == one.link.standing
    two.rack.scheduler.pass_until(2 * NS_PER_MS)
    two.rack.operations.run_all()
    assert two.link.standing.cause is None
    one.link.adopt(two.link.standing)
    assert one.rack.operations.stopped is None
    one.link.adopt(StopState(500, 0, StopCause(500, "older news")))
    assert one.rack.operations.stopped is None


def test_what_is_set_while_the_rack_stands_outlives_operations_of_any_process(config):
    """A part that stands is not stopped again because the same STOP ALL is told of once more."""
    memory_process, one, two = processes = cut(config)
    one.rack.run(0.001)
    one.rack.operations.stop_all("a fault of ONE", "14", "ONE")
    for process in (two, memory_process):
        process.rack.scheduler.pass_until(3 * NS_PER_MS)
        process.link.adopt(one.link.standing)
    settle(processes)
    memory_process.rack.write("A%", 44)
    settle(processes)
    for process in processes:
        process.rack.operations.clear_errors()
    for other in processes:
        for process in processes:
            process.link.adopt(other.link.standing)
    settle(processes)
    assert [process.rack.value("A%") for process in processes] == [44, 44, 44]
    assert len({process.link.standing for process in processes}) == 1


def test_a_stop_of_the_stimuli_is_one_stop_in_all_processes(config):
    processes = [Process(config, slots, common=lambda: True) for slots in PROCESS_SLOTS]
    for process in processes:
        process.start()
        process.rack.operations.stop_all("STOP ALL of the stimuli")
    assert len({process.link.standing for process in processes}) == 1


def test_a_stop_and_a_run_at_one_instant_are_told_in_their_order(config):
    memory_process, one, _ = processes = cut(config)
    assert {process.rack.now_ns for process in processes} == {0}
    for _ in range(2):
        memory_process.rack.operations.stop_all("by hand")
        one.link.adopt(memory_process.link.standing)
        assert one.rack.operations.stopped is not None
        one.rack.operations.run_all()
        memory_process.link.adopt(one.link.standing)
        assert memory_process.rack.operations.stopped is None


def test_a_process_that_joins_takes_over_what_the_others_hold(config):
    memory_process, one, two = processes = cut(config)
    run(processes, 0.05)
    memory_process.rack.write("T%", 44, element=2)
    memory_process.rack.write("S$", "HELLO")
    memory_process.rack.write("OUT3@", value=True)
    memory_process.rack.force("GO@", value=True)
    settle(processes)
    again = Process(config, PROCESS_SLOTS[1])
    again.rack.join(60 * NS_PER_MS, lambda: again.link.merge(memory_process.link.picture()))
    again.link.starting = False
    assert image(again) == image(memory_process)
    assert [force.name for force in again.rack.forces()] == ["GO@"]
    assert again.rack.task("ONE").scan_number == 0
    # The first scan comes at the next tick of the common grid: 60.5 ms.
    again.rack.run(0.0006)
    assert again.rack.task("ONE").scan_number == 1
    assert again.rack.value("A%") == memory_process.rack.value("A%") + 1
    for process in (memory_process, two):
        process.rack.scheduler.run_until(again.rack.now_ns)
        for batch in again.sent:
            process.link.receive(batch)
    again.hear(two)
    memory_process.hear(two)
    assert image(memory_process) == image(two) == image(again)
    assert one.rack.task("ONE").scan_number > 1


def test_what_happens_in_every_process_by_itself_is_sent_by_the_home_alone(config):
    acting = [False]
    processes = [Process(config, slots, common=lambda: acting[0]) for slots in PROCESS_SLOTS]
    for process in processes:
        process.start()
        process.rack.operations.stop_tasks()
    sent = [len(process.sent) for process in processes]
    acting[0] = True
    for process in processes:
        process.rack.scheduler.pass_until(4 * NS_PER_MS)
        process.rack.write("A%", 40)
    acting[0] = False
    # For a process that joins in the middle of a wave.
    assert [len(process.sent) - before for process, before in zip(processes, sent, strict=True)] == [1, 0, 0]
    # A write of 3 ms that comes now is older.
    memory_process, one, _ = processes
    late = Process(config, PROCESS_SLOTS[1]).start()
    late.rack.operations.stop_tasks()
    late.rack.scheduler.pass_until(3 * NS_PER_MS)
    late.rack.write("A%", 30)
    memory_process.link.receive(late.sent[-1])
    assert memory_process.rack.value("A%") == one.rack.value("A%") == 40


def test_all_hold_what_an_input_makes_of_a_value(config):
    memory_process, one, two = processes = idle(config)
    view = memory_process.rack.memory.view("B%")
    memory_process.rack.inputs.shape([(view, 0)], lambda value: int(value) & 7)
    one.rack.write("B%", 15)
    settle(processes)
    assert [process.rack.value("B%") for process in (memory_process, one, two)] == [7, 7, 7]


def test_the_part_of_a_rack_compiles_and_runs_its_own_tasks_alone(config):
    part, whole = Rack(config, local=(1,)), Rack(config)
    assert [task.name for task in part.tasks] == ["ONE"]
    assert (part.part.holds_common_memory, part.part.is_whole, whole.part.is_whole) == (False, False, True)
    assert part.installed == whole.installed
    assert part.writers == whole.writers
    with pytest.raises(ValueError, match="slot 9"):
        Rack(config, local=(1, 9))


def test_a_damaged_batch_changes_nothing(config):
    memory_process, one, _ = idle(config)
    before = image(memory_process)
    batch = one_write(one)
    view = one.rack.memory.view("A%")
    for entry in ((9999, 0, 1.0), (view, 3, 1.0), (view, 0, 40000.0), (view, 0, float("nan")), (view, 0, "X")):
        memory_process.link.receive(type(batch)(1, 77, 1, 0, batch.kind, (entry,)))
    assert image(memory_process) == before
    assert "N% = N% + 1" in ONE


def one_write(process):
    process.rack.write("B%", 1)
    return process.sent[-1]


def test_the_last_writes_of_a_process_that_ended_in_the_middle_of_sending_reach_all(config):
    memory_process, one, two = idle(config)
    one.rack.write("A%", 11)
    one.rack.write("OUT3@", value=True)
    one.rack.force("GO@", value=True)
    memory_process.hear(one)
    assert image(memory_process) != image(two)
    for lost_by in (memory_process, two):
        picture = lost_by.link.last_of(one.link.process_slot)
        for other in (memory_process, two):
            other.link.merge(picture)
    assert image(memory_process) == image(two)
    assert two.rack.value("A%") == 11
    assert two.rack.value("OUT%") == 8
    assert [force.name for force in two.rack.forces()] == ["GO@"]


def test_an_older_force_gives_way_to_a_newer_one(config):
    memory_process, one, _ = idle(config)
    memory_process.rack.scheduler.pass_until(5 * NS_PER_MS)
    memory_process.rack.force("B%", 50)
    one.hear(memory_process)
    one.rack.force("B%", 10)
    memory_process.hear(one)
    assert one.rack.value("B%") == memory_process.rack.value("B%") == 50
