"""Interrupts of I/O modules: when they come, which scans they start, what freezes at them, what ends them."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from automax_ros.core.kinds import WriteKind
from automax_ros.rack.rack import Rack
from automax_ros.runtime.time.scheduler import EventClass, EventKey
from rack.helpers import Observer, rack_at, run_for

MS = 1_000_000
COMMON = """\
  POSITION%: {slot: 6, register: 0, ros: in}
  COPY%: {slot: 6, register: 2}
  ISCR%: {slot: 6, register: 3}
  PERIOD%: {slot: 6, register: 4}
  SEEN%: {}
  RAW%: {}
"""
FOLLOW = """\
10 COMMON POSITION%, ISCR%, PERIOD%, SEEN%, RAW%
20 EVENT NAME=GO, INTERRUPT_STATUS=ISCR%, TIMEOUT=32767
30 PERIOD% = 43
40 ISCR% = 64
50 CALL SCAN_LOOP(TICKS=4, EVENT=GO)
60 CALL SUMMER(INPUT1=POSITION%, INPUT2=0, OUTPUT=SEEN%)
70 RAW% = IOREAD%(6, 0)
80 END
"""


def built(
    folder: Path,
    common: str = COMMON,
    slots: str = "  6: {module: 57C411}\n",
    *,
    execution: str = "ideal",
    **tasks: tuple[int, str],
) -> Rack:
    for name, (_, text) in tasks.items():
        (folder / f"{name}.BLK").write_text(text)
    listed = ", ".join(f"{name}: {{priority: {priority}}}" for name, (priority, _) in tasks.items())
    head = f"rack: PM1\nexecution: {execution}\nslots:\n  0: {{module: 57C435, tasks: {{{listed}}}}}\n"
    (folder / "rack.yaml").write_text(f"{head}{slots}common:\n{common}")
    return rack_at(folder / "rack.yaml")


class Watching(Observer):
    """Notes when tasks scan, and what was written by whom."""

    def __init__(self, rack: Rack) -> None:
        self.scans: list[tuple[str, int]] = []
        self.writes: list[tuple[int, str, object]] = []
        self._specs = rack.memory.specs
        self._rack = rack
        rack.observe(self)

    def start(self) -> Watching:
        self._rack.start()
        return self

    def scanned(self, task, record, writes) -> None:
        if record.scan:
            self.scans.append((task.name, record.time_ns))
        self.written(writes)

    def written(self, writes) -> None:
        entries = (item for group in writes for item in group.entries())
        self.writes += [(item.time_ns, self._specs[item.view].name, item.value) for item in entries]


def later(rack: Rack, time_ns: int, action) -> None:
    """Let something come from outside at an instant, before all else of it."""
    rack.scheduler.at(time_ns, EventKey(EventClass.OUTSIDE, 0, ""), lambda _: action())


def test_interrupts_start_scans_at_whole_periods_after_the_clock(tmp_path):
    rack = built(tmp_path, FOLLOW=(5, FOLLOW))
    seen = Watching(rack).start()
    rack.run(0.1)
    assert seen.scans == [("FOLLOW", number * 22 * MS) for number in range(1, 5)]
    assert rack.value("COPY%") == rack.value("ISCR%") == 64
    rack.write("PERIOD%", 1)
    rack.run(0.003)
    assert seen.scans[4:] == [("FOLLOW", 101 * MS), ("FOLLOW", 102 * MS)]
    rack.write("PERIOD%", -1)
    rack.run(65.0)
    assert [time for _, time in seen.scans[6:]] == [32_768 * MS]


@pytest.mark.parametrize("number", [0, 1, 10, 32767, -32768, -1])
def test_the_period_register_counts_half_milliseconds_without_sign(tmp_path, number):
    rack = built(tmp_path, FOLLOW=(5, FOLLOW.replace("PERIOD% = 43", f"PERIOD% = {number}")))
    seen = Watching(rack).start()
    period = ((number & 0xFFFF) + 1) * 500_000
    rack.run(2.5 * period / 1e9)
    assert seen.scans == [("FOLLOW", period), ("FOLLOW", 2 * period)]


def test_without_a_clock_nothing_interrupts(tmp_path):
    rack = built(tmp_path, FOLLOW=(5, FOLLOW.replace("40 ISCR% = 64\n", "")))
    seen = Watching(rack).start()
    rack.run(1.0)
    assert seen.scans == []
    rack.write("ISCR%", 64)
    rack.run(0.03)
    assert seen.scans == [("FOLLOW", 1022 * MS)]
    rack.write("ISCR%", 0)
    rack.run(1.0)
    assert len(seen.scans) == 1


def test_a_late_host_skips_whole_interrupts_and_counts_them(tmp_path):
    rack = built(tmp_path, FOLLOW=(5, FOLLOW))
    seen = Watching(rack).start()
    for now_ms in (1, 22, 23, 100, 101, 110):
        rack.scheduler.run_due(now_ms * MS)
    assert seen.scans == [("FOLLOW", number * 22 * MS) for number in (1, 4, 5)]
    assert rack.statistics["FOLLOW"].skipped == 2


def test_another_module_may_drive_the_clock_but_not_both(tmp_path):
    common = COMMON + "  OTHER%: {slot: 7, register: 2, ros: in}\n"
    slots = "  6: {module: 57C411}\n  7: {module: 57C419}\n"
    rack = built(tmp_path, common, slots, FOLLOW=(5, FOLLOW.replace("ISCR% = 64", "ISCR% = 0")))
    seen = Watching(rack).start()
    rack.write("OTHER%", 64)
    rack.run(0.03)
    assert seen.scans == [("FOLLOW", 22 * MS)]
    rack.write("ISCR%", 64)
    rack.run(0.001)
    cause = rack.operations.stopped
    assert cause is not None
    assert (cause.time_ns, cause.code) == (30 * MS, "38")
    assert "resolver_6" in cause.reason
    assert "digital_io_7" in cause.reason
    assert (rack.value("ISCR%"), rack.value("OTHER%")) == (0, 0)


@pytest.mark.parametrize("registers", [(5,), (6,), (5, 6)])
def test_an_analog_module_shows_that_there_is_a_clock(tmp_path, registers):
    common = "  STATUS%: {slot: 6, register: 4}\n"
    rack = run_for(built(tmp_path, common, "  6: {module: 57C409}\n", T=(5, "10 CALL SCAN_LOOP(TICKS=1)\n20 END\n")))
    view = rack.memory.view("SLOT:6%")
    rack.write_view(view, [(number, 64) for number in registers], 1)
    rack.run(0.001)
    assert rack.value("STATUS%") == 1 << 8 | 1 << 10
    rack.operations.stop_all("test")
    rack.run(0.001)
    assert rack.value("STATUS%") == 0


def test_each_channel_of_an_analog_module_has_its_own_interrupt(tmp_path):
    common = "".join(
        f"  P{n}%: {{slot: 6, register: {2 + n}}}\n  ISCR{n}%: {{slot: 6, register: {5 + n}}}\n" for n in (0, 1)
    )
    task = "10 COMMON P{n}%, ISCR{n}%\n20 EVENT NAME=GO{n}, INTERRUPT_STATUS=ISCR{n}%, TIMEOUT=9\n30 P{n}% = {p}\n"
    task += "35 ISCR{n}% = 64\n40 CALL SCAN_LOOP(TICKS=1, EVENT=GO{n})\n50 END\n"
    tasks = {"B": (5, task.format(n=0, p=10)), "A": (5, task.format(n=1, p=21))}
    rack = built(tmp_path, common, "  6: {module: 57C409}\n", **tasks)
    seen = Watching(rack).start()
    rack.run(0.0225)
    assert seen.scans == [
        ("B", 5_500_000),
        ("A", 11 * MS),
        ("B", 11 * MS),
        ("B", 16_500_000),
        ("A", 22 * MS),
        ("B", 22 * MS),
    ]


def test_scans_of_one_instant_come_by_priority_and_name_whatever_the_slots(tmp_path):
    common = "".join(f"  I{n}%: {{slot: {n}, register: 2}}\n  P{n}%: {{slot: {n}, register: 3}}\n" for n in (5, 6, 7))
    slots = "".join(f"  {n}: {{module: 57C419}}\n" for n in (5, 6, 7))
    task = "10 COMMON P{n}%, I{n}%\n20 EVENT NAME=GO{n}, INTERRUPT_STATUS=I{n}%, TIMEOUT=9\n30 P{n}% = 10\n"
    task += "40 CALL SCAN_LOOP(TICKS=1, EVENT=GO{n})\n50 END\n"
    tasks = {"LAST": (9, task.format(n=5)), "B": (5, task.format(n=6)), "A": (5, task.format(n=7))}
    tasks["CLOCK"] = (4, "10 COMMON I6%\n20 I6% = 64\n30 CALL SCAN_LOOP(TICKS=1)\n40 END\n")
    rack = built(tmp_path, common, slots, **tasks)
    seen = Watching(rack).start()
    rack.run(0.012)
    order = [name for name, time_ns in seen.scans if time_ns == 5_500_000]
    assert order == ["CLOCK", "A", "B", "LAST"]


def test_a_pulsetach_needs_its_timer_enabled_and_counts_24_bits(tmp_path):
    common = """\
  COUNT!: {slot: 6, register: 0, ros: in}
  PERIOD%: {slot: 6, register: 2}
  ISCR%: {slot: 6, register: 5}
"""
    task = """\
10 COMMON COUNT!, PERIOD%, ISCR%
15 LOCAL SEEN!
20 EVENT NAME=GO, INTERRUPT_STATUS=ISCR%, TIMEOUT=9
30 PERIOD% = 10
40 ISCR% = 64
50 CALL SCAN_LOOP(TICKS=1, EVENT=GO)
60 SEEN! = COUNT!
70 END
"""
    rack = built(tmp_path, common, "  6: {module: 57C421}\n", T=(5, task))
    seen = Watching(rack).start()
    rack.run(0.02)
    assert seen.scans == []
    rack.write("ISCR%", 64 | 32)
    rack.run(0.005)
    assert seen.scans == [("T", 22 * MS)]
    for sent, counted in ((8388607, 8388607), (8388608, -8388608), (-8388609, 8388607), (-1, -1), (1 << 24, 0)):
        rack.write("COUNT!", sent)
        rack.run(0.0055)
        assert (rack.value("COUNT!"), rack.task("T").value("SEEN!")) == (counted, counted)
        high, low = rack.value("SLOT:6%", 0), rack.value("SLOT:6%", 1)
        assert (high, low & 0xFFFF) == (counted >> 16, counted & 0xFFFF)


def test_inputs_freeze_from_the_interrupt_to_the_end_of_the_scan(tmp_path):
    """A task of higher priority holds the Processor for several ms; the process moves the input meanwhile."""
    rack = built(tmp_path, execution="modeled", HOG=(4, HOG), FOLLOW=(5, FOLLOW))
    seen = Watching(rack).start()
    later(rack, 21_900_000, lambda: rack.write("POSITION%", 1))
    begins: list[int] = []
    rack.run(0.022)
    start = rack.now_ns
    assert rack.value("POSITION%") == 1
    rack.run(0.0235 - 0.022)
    for number in (2, 3):
        begins.append(rack.now_ns)
        rack.write("POSITION%", number)
        assert (rack.value("POSITION%"), rack.value("SLOT:6%", 0)) == (1, 1)
        rack.run(0.0002)
    rack.run(0.015)
    assert start <= begins[0]
    ((name, scanned),) = [scan for scan in seen.scans if scan[0] == "FOLLOW"]
    assert name == "FOLLOW"
    assert (rack.value("SEEN%"), rack.value("RAW%")) == (1, 1)
    assert rack.value("POSITION%") == rack.value("SLOT:6%", 0) == 3
    thawed = [(time, value) for time, what, value in seen.writes if what == "POSITION%"]
    assert [value for _, value in thawed] == [1, 3]
    assert thawed[1][0] > begins[1]
    assert scanned < thawed[1][0]


def test_a_frozen_word_and_its_bits_keep_the_order_of_writes(tmp_path):
    common = COMMON + "  BIT@: {slot: 6, register: 0, bit: 0, ros: in}\n"
    rack = run_for(built(tmp_path, common, FOLLOW=(5, FOLLOW)))
    shown: list[object] = []

    def move(_: int) -> None:
        for name, value in (("BIT@", True), ("POSITION%", 6), ("BIT@", True), ("POSITION%", 8), ("BIT@", True)):
            rack.write(name, value)
        shown.append(rack.value("POSITION%"))

    rack.scheduler.at(22 * MS, EventKey(EventClass.IO, 15, "after the interrupt"), move)
    rack.run(0.023)
    assert shown == [0]
    assert rack.value("SEEN%") == 0
    assert (rack.value("POSITION%"), rack.value("BIT@")) == (9, True)


@pytest.mark.parametrize("waits", [True, False])
def test_what_an_operator_sets_waits_too_and_what_nobody_waits_for_follows_the_process(tmp_path, waits):
    rack = run_for(built(tmp_path, FOLLOW=(5, FOLLOW)), 0.01)
    if not waits:
        rack.operations.stop("FOLLOW")
    shown: list[object] = []

    def move(_: int) -> None:
        (rack.adjust.set if waits else rack.write)("POSITION%", 6)
        shown.append(rack.value("POSITION%"))

    rack.scheduler.at(22 * MS, EventKey(EventClass.IO, 15, "after the interrupt"), move)
    rack.run(0.013)
    assert (shown, rack.value("SEEN%"), rack.value("POSITION%")) == ([0 if waits else 6], 0, 6)


def test_stop_all_ends_interrupts_and_frees_inputs(tmp_path):
    rack = built(tmp_path, FOLLOW=(5, FOLLOW))
    seen = Watching(rack).start()

    def stop(_: int) -> None:
        rack.write("POSITION%", 7)
        assert rack.value("POSITION%") == 0
        rack.operations.stop_all("test")

    rack.scheduler.at(22 * MS, EventKey(EventClass.IO, 15, "after the interrupt"), stop)
    rack.run(0.1)
    assert seen.scans == []
    assert (rack.value("POSITION%"), rack.value("ISCR%"), rack.value("COPY%")) == (7, 0, 0)
    rack.operations.run_all()
    rack.run(0.0225)
    assert seen.scans == [("FOLLOW", 122 * MS)]


def test_a_reloaded_task_has_the_interrupt_of_its_new_source(tmp_path):
    from automax_ros.core.diagnostics import SourceText

    rack = built(tmp_path, FOLLOW=(5, FOLLOW))
    seen = Watching(rack).start()
    rack.run(0.03)
    quiet = "10 COMMON SEEN%\n20 CALL SCAN_LOOP(TICKS=10)\n30 SEEN% = 5\n40 END\n"
    rack.operations.reload("FOLLOW", SourceText("FOLLOW.BLK", quiet))
    rack.run(0.05)
    assert [time for _, time in seen.scans] == [22 * MS, 33 * MS]
    rack.operations.reload("FOLLOW", SourceText("FOLLOW.BLK", FOLLOW))
    rack.run(0.03)
    assert [time for _, time in seen.scans[2:]] == [88 * MS, 110 * MS][: len(seen.scans) - 2]
    assert len(seen.scans) >= 3


HOG = "10 LOCAL N%, M%\n20 CALL SCAN_LOOP(TICKS=4)\n30 FOR N% = 1 TO 600\n35 M% = N%\n40 NEXT N%\n50 END\n"
INSTANTS = st.one_of(st.integers(0, 70_000_000), st.integers(21_900_000, 26_000_000))


@pytest.mark.parametrize("execution", ["ideal", "modeled"])
@given(cut=INSTANTS, moves=st.lists(st.tuples(INSTANTS, st.integers(-9, 9)), max_size=6))
@settings(deadline=None, derandomize=True, max_examples=30, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_a_rack_goes_on_from_its_state_at_any_instant(tmp_path, execution, cut, moves):
    def run(until_ns: int, rack: Rack) -> None:
        for time_ns, value in sorted(moves):
            if rack.now_ns <= time_ns < until_ns:
                rack.scheduler.run_until(time_ns)
                rack.write("POSITION%", value)
        rack.scheduler.run_until(until_ns)

    tasks = {"FOLLOW": (5, FOLLOW), "HOG": (4, HOG)}
    whole, first, second = (built(tmp_path, execution=execution, **tasks) for _ in range(3))
    whole.start()
    run(80 * MS, whole)
    first.start()
    run(cut, first)
    second.load(first.state())
    run(80 * MS, second)
    assert second.now_ns == whole.now_ns
    assert second.memory.image() == whole.memory.image()
    assert second.state() == whole.state()


def test_what_is_frozen_is_part_of_the_state(tmp_path):
    one, other = (built(tmp_path, FOLLOW=(5, FOLLOW)) for _ in range(2))
    one.start()

    def move(_: int) -> None:
        one.write("POSITION%", 5)
        other.load(one.state())

    one.scheduler.at(22 * MS, EventKey(EventClass.IO, 15, "after the interrupt"), move)
    one.run(0.0221)
    assert other.value("POSITION%") == 0
    frozen = other.state().modules[6]["3"]
    assert frozen["owed"] == ["FOLLOW"]
    assert [entry[2] for entry in frozen["kept"]] == [5]


def test_writes_that_waited_are_the_writers_own(tmp_path):
    rack = built(tmp_path, FOLLOW=(5, FOLLOW))
    told: list[tuple[int, WriteKind]] = []
    seen = Watching(rack).start()
    plain = seen.written

    def note(writes) -> None:
        entries = (item for group in writes for item in group.entries())
        told.extend((item.writer, item.kind) for item in entries if rack.memory.specs[item.view].name == "POSITION%")
        plain(writes)

    seen.written = note
    move = lambda _: rack.write("POSITION%", 5, writer=1)  # noqa: E731
    rack.scheduler.at(22 * MS, EventKey(EventClass.IO, 15, "after the interrupt"), move)
    rack.run(0.03)
    assert told == [(1, WriteKind.OUTSIDE)]


def test_what_waits_in_a_basic_task_freezes_too():
    """A BASIC task waits for the event now, or it does not: what SCAN_LOOP names is always waited for."""
    from automax_ros.blocks.catalogue import CATALOGUE
    from automax_ros.compile.compiler import compile_program
    from automax_ros.core.diagnostics import SourceText
    from automax_ros.core.types import DataType
    from automax_ros.language.checks.checker import check
    from automax_ros.language.program import CommonSpec
    from automax_ros.runtime.memory.memory import CommonMemory
    from automax_ros.runtime.memory.views import Place, ViewSpec
    from automax_ros.runtime.scan.events import Events
    from automax_ros.runtime.tasks.basic_task import BasicTask
    from automax_ros.runtime.tasks.interrupts import Interrupts

    text = """\
10 COMMON ISCR%
20 EVENT NAME=GO, INTERRUPT_STATUS=ISCR%, TIMEOUT=6
30 DELAY 2 TICKS
40 WAIT ON GO
50 END
"""
    spec = CommonSpec("ISCR%", DataType.INTEGER, "rack.yaml:1")
    program = check(
        SourceText("B.BAS", text), name="B", catalogue=CATALOGUE, tick_ns=MS, commons={"ISCR%": spec}
    ).program
    assert program is not None
    views = (
        ViewSpec("SLOT:6%", DataType.INTEGER, 5, is_array=True),
        ViewSpec("ISCR%", DataType.INTEGER, place=Place(0, 3)),
    )
    memory, events = CommonMemory(views), Events()
    task = BasicTask(compile_program(program, {"SLOT:6%": 0, "ISCR%": 1}), memory, events=events)
    interrupts = Interrupts(memory, events)
    interrupts.bind(task)
    task.run(0)
    found = [interrupts.waiting(0, 3)]
    for time_ns in (0, 2 * MS, 3 * MS):
        task.scan(time_ns)
        found.append(interrupts.waiting(0, 3))
    assert found == [[], [], ["B"], []]


def test_a_power_cycle_ends_the_clock_until_the_task_turns_it_on_again(tmp_path):
    rack = built(tmp_path, FOLLOW=(5, FOLLOW))
    seen = Watching(rack).start()
    rack.run(0.03)
    rack.operations.power_off()
    rack.run(0.1)
    assert [time for _, time in seen.scans] == [22 * MS]
    rack.operations.power_on()
    rack.run(0.1)
    assert (len(seen.scans), rack.value("ISCR%"), rack.value("COPY%")) == (1, 0, 0)
    rack.operations.run("FOLLOW")
    rack.run(0.0221)
    assert [time for _, time in seen.scans[1:]] == [252 * MS]
