"""A rack is operated: RUN, STOP, reload, STOP ALL, clear, power, any number of times and without double scans."""

from __future__ import annotations

import contextlib
import itertools
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from automax_ros.core.diagnostics import SourceText
from automax_ros.rack.base.stop_cause import OperationRefused
from automax_ros.rack.rack import Rack
from automax_ros.rack.tasks.installation import RackError
from automax_ros.runtime.memory.views import MemoryValueError
from automax_ros.runtime.tasks.task import Status
from rack.helpers import config_at, rack_from

YAML = """\
rack: LINE1
slots:
  0: {module: 57C413}
  1: {module: 57C435, tick_ms: 5.5, tasks: {FAST: {priority: 4}, SLOW: {priority: 8}}}
  2: {module: 57C431, tick_ms: 2.0, tasks: {OTHER: {priority: 5}}}
  5: {module: 57C419}
  6: {module: 57C403}
common:
  COUNT%: {}
  KEPT!: {non_volatile: true}
  START@: {slot: 5, register: 0, bit: 3, ros: in}
  BUTTONS%: {slot: 5, register: 0}
  LAMP@: {slot: 6, register: 0, bit: 1}
  LAMPS%: {slot: 6, register: 0}
  FORCINGSTATUS@: {}
  BATTERYSTATUS0@: {}
"""
FAST = """\
10 COMMON COUNT%, START@, LAMP@, KEPT!
20 LOCAL OWN%, GAIN% [CURRENT=2, HIGH=9, LOW=0], BEGUN%
30 BEGUN% = BEGUN% + 1
100 CALL SCAN_LOOP(TICKS=1)
110 COUNT% = COUNT% + 1
120 OWN% = OWN% + GAIN%
130 KEPT! = KEPT! + 1
140 CALL AND(INPUT1=START@, INPUT2=START@, OUTPUT=LAMP@)
150 END
"""
SLOW = "10 LOCAL N%, Z%, NIL%\n20 CALL SCAN_LOOP(TICKS=2)\n30 N% = N% + 1\n40 IF N% = 3 THEN Z% = N% / NIL%\n50 END\n"
OTHER = "10 LOCAL N%\n20 CALL SCAN_LOOP(TICKS=3)\n30 N% = N% + 1\n40 END\n"
SOURCES = {"FAST": FAST, "SLOW": SLOW, "OTHER": OTHER}
TICKS = {"FAST": 5_500_000, "SLOW": 5_500_000, "OTHER": 2_000_000}
PERIODS = {"FAST": 5_500_000, "SLOW": 11_000_000, "OTHER": 6_000_000}


class Notes:
    """What an observer was told: the instants of scans, scan 0 included, and operations."""

    def __init__(self):
        self.scans, self.operations, self.order = [], [], []

    def scanned(self, task, record, _):
        self.scans.append((task.name, record.scan, record.time_ns))
        self.order.append("scan")

    def written(self, _):
        self.order.append("write")

    def tuned(self, *_):
        self.order.append("tune")

    def operated(self, operation):
        self.operations.append((operation.what, operation.task, operation.ok))
        self.order.append(operation.what)


def build(folder: Path, *, yaml: str = YAML, **sources: str) -> tuple[Rack, Notes]:
    rack, notes = rack_from(folder, yaml, **{**SOURCES, **sources}), Notes()
    rack.observe(notes)
    return rack, notes


@pytest.fixture
def made(tmp_path):
    rack, notes = build(tmp_path)
    rack.start()
    return rack, notes


def times(notes: Notes, task: str) -> list[int]:
    """The instants (us) at which a task has scanned, scan 0 left out."""
    return [time // 1000 for name, scan, time in notes.scans if name == task and scan]


def test_a_stopped_task_scans_no_more_and_begins_on_the_next_tick(made):
    rack, notes = made
    rack.run(0.012)
    rack.operations.stop("FAST")
    rack.run(0.010)
    assert times(notes, "FAST") == [0, 5500, 11000]
    rack.operations.run("FAST")
    assert notes.scans[-1] == ("FAST", 0, 22_000_000), "the start-up part runs at once"
    rack.run(0.012)
    assert times(notes, "FAST")[3:] == [27500, 33000]
    assert notes.operations == [("stop", "FAST", True), ("run", "FAST", True)]
    assert rack.task("FAST").value("BEGUN%") == 2


def test_a_task_put_into_run_between_two_ticks_waits_for_the_next(made):
    rack, notes = made
    rack.operations.stop("OTHER")
    rack.run(0.0031)
    rack.operations.run("OTHER")
    rack.run(0.014)
    assert times(notes, "OTHER") == [4000, 10000, 16000]


def test_running_twice_is_refused_and_makes_no_second_scan(made):
    rack, notes = made
    with pytest.raises(OperationRefused, match="FAST runs already"):
        rack.operations.run("FAST")
    rack.run(0.02)
    assert times(notes, "FAST") == [0, 5500, 11000, 16500]
    assert notes.operations == [("run", "FAST", False)]


def test_an_unknown_task_is_refused_with_the_nearest(made):
    with pytest.raises(OperationRefused, match="did you mean FAST"):
        made[0].operations.stop("FSAT")


def test_stop_all_clears_what_section_2_4_5_says_and_the_rack_runs_again(made):
    rack, notes = made
    rack.write("BUTTONS%", 0x18)
    rack.force("COUNT%", 77)
    rack.run(0.012)
    assert (rack.value("START@"), rack.value("LAMP@"), rack.value("LAMPS%")) == (True, True, 2)
    rack.operations.stop_all("operator")
    assert rack.stop_reason == "operator"
    assert (rack.value("LAMP@"), rack.value("LAMPS%"), rack.backplane.readable(6, 0)) == (False, 0, (9, 0))
    assert rack.memory.read_now(9, 0) == 0, "outputs off, also by register"
    assert (rack.value("START@"), rack.value("BUTTONS%"), rack.value("KEPT!")) == (True, 0x18, 3), "inputs and kept"
    assert (rack.value("COUNT%"), rack.value("FORCINGSTATUS@"), rack.value("BATTERYSTATUS0@")) == (77, True, True)
    own = rack.task("FAST").value("OWN%")
    rack.run(0.05)
    assert len(times(notes, "FAST")) == 3
    rack.operations.run_all()
    assert (rack.stop_reason, rack.task("FAST").value("OWN%")) == (None, own)
    rack.run(0.02)
    assert times(notes, "FAST")[3:] == [66000, 71500, 77000]
    assert [name for name, scan, _ in notes.scans if not scan][3:] == ["FAST", "OTHER", "SLOW"], "by priority and name"


def test_power_loses_volatile_memory_and_keeps_the_rest(made):
    rack, notes = made
    rack.write("BUTTONS%", 8)
    rack.tune(rack.task("FAST"), "GAIN%", 5)
    rack.run(0.032)
    assert rack.task("SLOW").errors.count == 2
    rack.operations.power_off()
    own = rack.task("FAST").value("OWN%")
    for refused in (rack.operations.power_off, rack.operations.run_all):
        with pytest.raises(OperationRefused):
            refused()
    rack.run(0.1)
    scans = len(notes.scans)
    rack.operations.power_on()
    assert (rack.value("COUNT%"), rack.value("KEPT!"), rack.value("LAMP@"), rack.value("BUTTONS%")) == (0, 6, False, 8)
    fast = rack.task("FAST")
    assert (fast.value("OWN%"), fast.value("GAIN%"), fast.status) == (own, 5, Status.STOPPED)
    assert rack.task("SLOW").errors.count == 2
    rack.run(0.1)
    assert len(notes.scans) == scans, "without AUTO RUN nothing starts by itself"


def test_auto_run_starts_what_ran_when_the_power_went(made):
    rack, notes = made
    rack.operations.stop("SLOW")
    rack.run(0.003)
    rack.operations.power_off()
    rack.operations.power_on(auto_run=True)
    begun = len(notes.scans)
    rack.run(0.02)
    assert {name for name, scan, _ in notes.scans[begun:] if scan} == {"FAST", "OTHER"}


def test_without_a_battery_everything_is_as_at_installation(made):
    rack, _ = made
    rack.tune(rack.task("FAST"), "GAIN%", 5)
    rack.run(0.032)
    rack.operations.power_off()
    rack.operations.power_on(battery=False)
    fast = rack.task("FAST")
    assert (rack.value("KEPT!"), fast.value("OWN%"), fast.value("GAIN%")) == (0, 0, 2)
    assert rack.task("SLOW").errors.count == 0
    assert rack.value("BATTERYSTATUS0@") is False
    rack.operations.stop_all("test")
    assert rack.value("BATTERYSTATUS0@") is False
    rack.operations.power_off()
    rack.operations.power_on()
    assert rack.value("BATTERYSTATUS0@") is True


def test_a_task_is_reloaded_while_the_others_run(made):
    rack, notes = made
    rack.tune(rack.task("FAST"), "GAIN%", 5)
    rack.run(0.012)
    rack.operations.reload("FAST", SourceText("new/FAST.BLK", FAST.replace("GAIN%\n130", "100\n130")))
    fast = rack.task("FAST")
    assert (fast.value("OWN%"), fast.value("GAIN%"), fast.value("BEGUN%")) == (0, 2, 1)
    rack.run(0.010)
    assert (fast.value("OWN%"), times(notes, "FAST")) == (100, [0, 5500, 11000, 16500])
    assert rack.sources["FAST"].name == "new/FAST.BLK"
    assert times(notes, "OTHER") == [0, 6000, 12000, 18000], "the others do not notice"


def test_a_reload_with_errors_leaves_the_old_task_running(made):
    rack, notes = made
    rack.run(0.003)
    with pytest.raises(RackError) as refused:
        rack.operations.reload("FAST", SourceText("new/FAST.BLK", "10 NONSENSE\n"))
    assert refused.value.findings[0][1]
    rack.run(0.010)
    assert times(notes, "FAST") == [0, 5500, 11000]
    assert notes.operations == [("reload", "FAST", False)]


def test_a_faulted_task_runs_again_after_its_log_is_cleared(tmp_path):
    endless = "10 LOCAL I%\n20 CALL SCAN_LOOP(TICKS=2)\n30 FOR I% = 0 TO 1 STEP 1\n40 I% = 0\n50 NEXT I%\n60 END\n"
    rack, notes = build(tmp_path, SLOW=endless)
    rack.start()
    rack.run(0.02)
    assert rack.stop_reason is not None
    assert rack.task("SLOW").status is Status.FAULTED
    assert ("stop_all", "SLOW", True) in notes.operations
    rack.operations.clear_errors("SLOW")
    assert (rack.task("SLOW").status, rack.task("SLOW").errors.count) == (Status.STOPPED, 0)
    rack.operations.run("OTHER")
    assert rack.stop_reason is None


def test_a_task_that_has_faulted_needs_its_log_cleared_also_after_power(tmp_path):
    endless = "10 LOCAL I%\n20 CALL SCAN_LOOP(TICKS=2)\n30 FOR I% = 0 TO 1 STEP 1\n40 I% = 0\n50 NEXT I%\n60 END\n"
    rack, notes = build(tmp_path, SLOW=endless)
    rack.start()
    rack.run(0.02)
    for attempt in (lambda: rack.operations.run("SLOW"), rack.operations.run_all):
        with pytest.raises(OperationRefused, match="a fault has stopped SLOW: clear the error log first"):
            attempt()
    rack.operations.power_off()
    rack.operations.power_on(auto_run=True)
    begun = len(notes.scans)
    rack.run(0.02)
    assert len(notes.scans) == begun, "AUTO RUN starts nothing that a fault has stopped (J2-3106-1 p. 12-4)"
    with pytest.raises(OperationRefused, match="clear the error log first"):
        rack.operations.run("SLOW")
    rack.operations.run("OTHER")
    rack.operations.clear_errors()
    rack.operations.run("FAST")
    assert {task.name: task.status for task in rack.tasks} == {
        "FAST": Status.RUNNING,
        "SLOW": Status.STOPPED,
        "OTHER": Status.RUNNING,
    }


def test_power_comes_back_after_its_time_and_auto_run_follows_the_rack_file(tmp_path):
    for number, auto_run in enumerate((False, True)):
        (tmp_path / str(number)).mkdir()
        rack, notes = build(tmp_path / str(number), yaml=f"auto_run: {str(auto_run).lower()}\n{YAML}")
        rack.start()
        rack.operations.stop("SLOW")
        rack.run(0.0123)
        rack.operations.power(5_000_000)
        assert (rack.operations.powered, rack.value("KEPT!")) == (False, 3)
        rack.run(0.004)
        assert not rack.operations.powered
        rack.run(0.0157)
        assert rack.operations.powered
        assert notes.operations == [("stop", "SLOW", True), ("power_off", "", True), ("power_on", "", True)]
        after = [(name, scan, time / 1e6) for name, scan, time in notes.scans if time > 12_300_000]
        assert after == (
            [("FAST", 0, 17.3), ("OTHER", 0, 17.3), ("OTHER", 1, 18), ("FAST", 1, 22), ("OTHER", 2, 24),
             ("FAST", 2, 27.5), ("OTHER", 3, 30)]
            if auto_run
            else []
        )  # fmt: skip


def test_power_that_is_switched_on_earlier_does_not_come_twice(made):
    rack, notes = made
    rack.operations.power(5_000_000)
    rack.operations.power_on()
    rack.operations.run_all()
    rack.run(0.02)
    assert [what for what, _, _ in notes.operations] == ["power_off", "power_on", "run_all"]
    with pytest.raises(ValueError, match="-1 ns"):
        rack.operations.power(-1)
    assert rack.operations.powered


def test_without_a_battery_forces_go_too(made):
    rack, _ = made
    rack.force("COUNT%", 77)
    rack.operations.power_off()
    rack.operations.power_on()
    assert [(item.name, item.value) for item in rack.forces()] == [("COUNT%", 77)]
    rack.operations.power(0, battery=False)
    rack.run(0.001)
    assert (rack.forces(), rack.value("COUNT%"), rack.value("FORCINGSTATUS@")) == ([], 0, False)


def test_a_deleted_task_is_gone_until_it_is_reloaded(made):
    rack, notes = made
    rack.run(0.012)
    with pytest.raises(OperationRefused, match="task FAST runs: stop it first"):
        rack.operations.delete("FAST")
    rack.operations.stop("FAST")
    rack.operations.delete("FAST")
    assert rack.task("FAST").value("OWN%") == 0, "its memory is free"
    for refused in (rack.operations.run, rack.operations.delete):
        with pytest.raises(OperationRefused, match="task FAST was deleted"):
            refused("FAST")
    rack.operations.run_all()
    scans = len(times(notes, "FAST"))
    rack.run(0.02)
    assert len(times(notes, "FAST")) == scans
    rack.operations.reload("FAST", SourceText("FAST.BLK", FAST))
    rack.operations.run("FAST")
    rack.run(0.012)
    assert len(times(notes, "FAST")) > scans


def test_a_critical_task_is_not_reloaded_while_it_runs(tmp_path):
    rack, _ = build(tmp_path, yaml=YAML.replace("FAST: {priority: 4}", "FAST: {priority: 4, critical: true}"))
    rack.start()
    with pytest.raises(OperationRefused, match="FAST is critical"):
        rack.operations.reload("FAST", SourceText("FAST.BLK", FAST))
    rack.operations.stop_all("operator")
    rack.operations.reload("FAST", SourceText("FAST.BLK", FAST))


KEEPING = """\
10 LOCAL OWN%, GAIN% [CURRENT=2, HIGH=9, LOW=0], LIST%(2), NOTE$:6, SAME!, AVERAGE%, BEGUN%
20 BEGUN% = BEGUN% + 1
30 OWN% = OWN% + 100
40 NOTE$ = "ABCDEF"
50 SAME! = 70000
60 LIST%(1) = 5
100 CALL SCAN_LOOP(TICKS=1)
110 CALL RUNNING_AVERAGE(INPUT=GAIN%, REQUIRED_SAMPLES=4, OUTPUT=AVERAGE%)
150 END
"""
EDITED = """\
10 LOCAL NEW%, OWN%, GAIN% [CURRENT=1, HIGH=9, LOW=0], LIST%(3), NOTE$:5, SAME%, AVERAGE%, BEGUN%
20 BEGUN% = BEGUN% + 1
100 CALL SCAN_LOOP(TICKS=1)
110 CALL RUNNING_AVERAGE(INPUT=GAIN%, REQUIRED_SAMPLES=4, OUTPUT=AVERAGE%)
150 END
"""


def test_a_reload_carries_over_what_fits_by_name(tmp_path):
    """Another dimension, a text too long, another type begin as installed, and blocks as after each RUN."""
    rack, notes = build(tmp_path, FAST=KEEPING)
    rack.start()
    rack.tune(rack.task("FAST"), "GAIN%", 8)
    rack.run(0.025)
    fast = rack.task("FAST")
    assert (fast.value("AVERAGE%"), fast.value("LIST%")) == (8, [0, 5, 0])
    rack.operations.reload("FAST", SourceText("FAST.BLK", EDITED), keep_state=True)
    names = ("NEW%", "OWN%", "GAIN%", "LIST%", "NOTE$", "SAME%", "AVERAGE%", "BEGUN%")
    assert [fast.value(name) for name in names] == [0, 100, 8, [0, 0, 0, 0], "", 0, 8, 2]
    rack.run(0.006)
    assert fast.value("AVERAGE%") == 2, "one sample of 8, of four"
    lower = EDITED.replace("HIGH=9", "HIGH=7")
    rack.operations.reload("FAST", SourceText("FAST.BLK", lower), keep_state=True)
    assert (fast.value("GAIN%"), fast.value("OWN%")) == (1, 100), "8 lies outside the limits now"
    rack.operations.reload("FAST", SourceText("FAST.BLK", EDITED))
    assert (fast.value("OWN%"), fast.value("BEGUN%")) == (0, 1), "an installation"
    assert [what for what, _, ok in notes.operations if ok] == ["reload"] * 3


def test_a_reload_in_the_middle_of_a_modeled_scan_carries_over_whole_values(tmp_path):
    long = "".join(f"{line} OWN% = OWN% + 1\n" for line in range(110, 510))
    text = f"10 LOCAL OWN%\n100 CALL SCAN_LOOP(TICKS=2)\n{long}900 END\n"
    yaml = YAML.replace("rack: LINE1\n", "rack: LINE1\nexecution: modeled\n").replace("tick_ms: 5.5", "tick_ms: 10")
    rack, notes = build(tmp_path, yaml=yaml, FAST=text)
    rack.start()
    rack.run(0.0005)
    rack.operations.reload("FAST", SourceText("FAST.BLK", text + "\n"), keep_state=True)
    fast = rack.task("FAST")
    done = fast.value("OWN%")
    assert done in (0, 400), "locals of a whole scan, or of none"
    rack.run(0.0295)
    assert fast.value("OWN%") == done + 400, "one whole scan since, from 10 ms on"
    assert [scan for name, scan, _ in notes.scans if name == "FAST"] == [0, 0, 1]


OPERATIONS = st.lists(
    st.tuples(
        st.sampled_from(
            ["run", "stop", "reload", "delete", "run_all", "stop_all", "clear", "off", "on", "auto", "power", "wait"]
        ),
        st.sampled_from(sorted(SOURCES)),
        st.integers(0, 30),
    ),
    max_size=12,
)


def operate(rack: Rack, what: str, task: str) -> None:
    operations = rack.operations
    calls = {
        "run": lambda: operations.run(task),
        "stop": lambda: operations.stop(task),
        "reload": lambda: operations.reload(task, SourceText(f"{task}.BLK", SOURCES[task])),
        "run_all": operations.run_all,
        "stop_all": lambda: operations.stop_all("test"),
        "clear": operations.clear_errors,
        "off": operations.power_off,
        "on": operations.power_on,
        "auto": lambda: operations.power_on(auto_run=True),
        "power": lambda: operations.power(7_300_000),
        "delete": lambda: operations.delete(task),
        "wait": lambda: None,
    }
    with contextlib.suppress(OperationRefused):
        calls[what]()


@given(OPERATIONS)
@settings(deadline=None, derandomize=True, max_examples=40, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_whatever_is_done_scans_stand_on_the_grid_and_never_twice(tmp_path, steps):
    rack, notes = build(tmp_path)
    rack.start()
    for what, task, milliseconds in steps:
        operate(rack, what, task)
        rack.run(milliseconds / 1000)
    for name in SOURCES:
        scans = [(scan, time) for task, scan, time in notes.scans if task == name]
        for (scan, time), (following, later) in itertools.pairwise(scans):
            if following:
                assert following == scan + 1
                assert later - time == PERIODS[name] if scan else 0 <= later - time <= TICKS[name]
            assert later % TICKS[name] == 0 if following else later >= time
    assert rack.value("COUNT%") <= sum(1 for name, scan, _ in notes.scans if name == "FAST" and scan)


@given(OPERATIONS, st.integers(0, 40))
@settings(deadline=None, derandomize=True, max_examples=25, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_a_rack_goes_on_from_its_state_bit_for_bit(tmp_path, steps, more):
    rack, notes = build(tmp_path)
    rack.start()
    rack.write("START@", bool(more % 2))
    if more % 3 == 0:
        rack.force("COUNT%", more)
    for what, task, milliseconds in steps:
        if what != "reload":
            operate(rack, what, task)
        rack.run(milliseconds / 1000)
    twin, twins_notes = build(tmp_path)
    twin.load(rack.state())
    assert twin.state() == rack.state()
    told = len(notes.scans), len(notes.operations)
    for one in (rack, twin):
        one.run(more / 1000)
        operate(one, "run_all", "")
        one.run(0.02)
    assert twins_notes.scans == notes.scans[told[0] :]
    assert twins_notes.operations == notes.operations[told[1] :]
    assert twin.state() == rack.state()


def test_a_state_is_refused_by_a_rack_that_runs_or_has_other_modules(made, tmp_path):
    rack, _ = made
    with pytest.raises(ValueError, match="runs already"):
        rack.load(rack.state())
    other = YAML.replace("  6: {module: 57C403}\n", "").replace(
        "  LAMP@: {slot: 6, register: 0, bit: 1}\n", "  LAMP@:\n"
    )
    (tmp_path / "other.yaml").write_text(other.replace("  LAMPS%: {slot: 6, register: 0}\n", ""))
    config = config_at(tmp_path / "other.yaml")
    with pytest.raises(ValueError, match="other modules"):
        Rack(config).load(rack.state())


def test_the_state_of_a_reloaded_task_needs_its_source(made, tmp_path):
    rack, _ = made
    source = SourceText("new/FAST.BLK", FAST.replace("COUNT% + 1", "COUNT% + 2"))
    rack.operations.reload("FAST", source)
    rack.run(0.02)
    twin, _ = build(tmp_path)
    with pytest.raises(ValueError, match="task FAST had another source: reload it first"):
        twin.load(rack.state())
    twin, _ = build(tmp_path)
    twin.operations.reload("FAST", source)
    twin.load(rack.state())
    for one in (rack, twin):
        one.run(0.02)
    assert twin.state() == rack.state()


def test_forcing_status_cannot_be_forced_itself(made):
    rack, _ = made
    with pytest.raises(MemoryValueError, match="shows whether anything is forced"):
        rack.force("FORCINGSTATUS@", False)
    assert not rack.memory.forced


def test_a_state_with_a_status_that_no_task_has_is_refused(made, tmp_path):
    state = made[0].scheduled[0].state()
    rack, _ = build(tmp_path)
    with pytest.raises(ValueError, match="FAST cannot be 'ASLEEP'"):
        rack.scheduled[0].load({**state, "status": "ASLEEP"})
