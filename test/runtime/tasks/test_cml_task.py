"""A current minor loop task against a plant: what it tells its 57C406, what it keeps, what forces do to it."""

from __future__ import annotations

import json
from itertools import islice

import pytest
from compile.support import OTHER

from automax_ros.drive.current_loop.inputs import Inputs
from automax_ros.drive.current_loop.minor_loop import NUMBERS, CurrentMinorLoop, Outcome
from automax_ros.drive.current_loop.signals import Command
from automax_ros.runtime.scan.drive_record import COMMAND_VIEW, MEASURED_VIEW, command_of, measured_of
from automax_ros.runtime.scan.error_log import LOG_FIELD
from automax_ros.runtime.scan.scan_record import Status
from runtime.drives import CML, cml_task, finished, scans

MS = 1_000_000
STEPS = 4
"""Of a scan in modeled time: before the latch, the loop, the read of DELTA%, the commit."""
RUNNING = {"REF%": 1500, "RUN@": True, "SPEED%": 2000}


def started(until_ns: int, **commons):
    """A task in RUN that has scanned up to an instant; its drive is asked to run after 0.6 s."""
    task, memory, port = cml_task(**{"SPEED%": 2000, "REF%": 1500, **commons})
    task.run(0)
    for _ in scans(task, port, min(until_ns, 600 * MS)):
        pass
    memory.write_from_outside(memory.view("RUN@"), True, OTHER)
    for _ in scans(task, port, until_ns):
        pass
    return task, memory, port


def value(memory, name, element=0):
    return memory.read_now(memory.view(name), element)


def test_drive_runs_and_its_outputs_are_common():
    task, memory, port = started(1200 * MS)
    assert value(memory, "STATE@") is True
    assert value(memory, "LOCKED@") is True
    assert value(memory, "PERIOD%") == 16667
    assert value(memory, "CURRENT%") == pytest.approx(1500, abs=150)
    assert task.value("LAST_DELTA%") == value(memory, "DELTA%") > 1000
    assert port.dig_slots == {8}


def test_scans_run_from_the_call_to_end_and_what_stands_before_runs_once():
    task, _, port = cml_task()
    task.run(0)
    list(scans(task, port, 99 * MS))
    # Six scans per cycle of 60 Hz, the first at 0; the task counts in an INTEGER that its first line has set to 0.
    assert task.value("SCANS%") == task.scan_number == len(port.commands) == 36
    assert task.period_ns == 2_777_777


def test_run_initialises_the_registers_and_starts_the_loop_again():
    task, _, port = started(1200 * MS)
    port.registers = (120, 80, 40, 1)
    task.stop()
    task.run(1200 * MS)
    assert port.registers == (109, 4, 2, 0)
    assert task.loop.numbers() == CurrentMinorLoop().numbers()


def test_task_that_ends_in_its_first_part_leaves_the_registers_alone():
    task, _, port = cml_task(CML.replace("30 SCANS% = 0", "30 STOP"))
    task.run(0)
    assert (task.status, port.calls) == (Status.ENDED, [])


def test_stop_in_a_scan_ends_the_drive_with_the_task():
    task, _, port = cml_task(CML.replace("1020 LAST_DELTA% = DELTA%", "1020 IF SCANS% = 3 THEN STOP"))
    task.run(0)
    list(islice(scans(task, port, 100 * MS), 3))
    assert (task.status, port.calls) == (Status.ENDED, ["initialise", "disarm"])


def test_empty_slot_measures_no_line_and_the_drive_never_runs():
    task, memory, port = cml_task(CML.replace("IO_CNTL_SLOT=7", "IO_CNTL_SLOT=6"), **RUNNING)
    task.run(0)
    for number in range(400):
        task.scan(number * 2_777_778)
    assert (value(memory, "LOCKED@"), value(memory, "STATE@"), port.commands) == (False, False, [])


@pytest.mark.parametrize("at_ms", [0, 3, 100, 599, 601, 650, 702, 705, 730, 1100])
def test_snapshot_anywhere_goes_on_the_same(at_ms):
    """Cut: state, loop and error log stand in the snapshot; the plant's is not the task's."""
    task, _, port = started(at_ms * MS)
    values = json.loads(json.dumps(task.snapshot()))
    other, *_ = cml_task()
    other.run(0)
    other.restore(values)
    assert other.snapshot() == task.snapshot()
    now_ns = port.now_ns
    port.interrupt(now_ns)
    measured = port.measure(8)
    latched = Inputs(7, 8, 60, 1500, 0.0, 400.0, 0.2, 50.0, 20, 680, True, False, False, 0.1, False, False, 180, 250,
                     150, True, 2000, True, 0, 5000, False, False, False)  # fmt: skip
    assert task.loop.scan(now_ns, measured, latched) == other.loop.scan(now_ns, measured, latched)
    assert task.loop.numbers() == other.loop.numbers()


def test_layout_tells_the_loops_numbers_and_the_log_stays_last():
    task, *_ = cml_task()
    fields = task.layout.fields
    assert [(field.name, field.size) for field in fields[-2:]] == [("DC_DRIVE_CML", NUMBERS), (LOG_FIELD, 10)]
    assert len(task.snapshot()) == sum(field.size for field in fields)


@pytest.mark.parametrize("spoilt", [float("nan"), float("inf"), 1e300])
def test_snapshot_that_no_loop_has_is_refused_and_changes_nothing(spoilt):
    task, *_ = started(100 * MS)
    values = before = task.snapshot()
    for place in range(len(values) - 10 - NUMBERS, len(values) - 10):
        values = [*before[:place], spoilt, *before[place + 1 :]]
        try:
            task.restore(values)
        except (ValueError, OverflowError):
            assert task.snapshot() == before
        else:
            task.restore(before)
    with pytest.raises(ValueError, match="does not fit"):
        task.restore(before[1:])
    assert task.snapshot() == before


def test_loop_that_has_not_scanned_is_as_installed():
    task, *_ = cml_task()
    installed = task.layout.flatten(task.layout.fresh())
    assert task.snapshot() == installed
    other, *_ = started(700 * MS)
    assert other.snapshot() != installed
    other.restore(installed)
    assert other.loop.numbers() == CurrentMinorLoop().numbers()


def test_record_has_what_was_measured_and_commanded():
    task, memory, port = started(900 * MS)
    task.record_scans()
    for record in islice(scans(task, port, 1000 * MS), 20):
        assert measured_of(record.reads) == port.measured
        assert command_of(record.reads) == port.commands[-1]
        assert sum(view == MEASURED_VIEW for view, *_ in record.reads) >= 4
    assert port.commands[-1].pulses
    memory.write_from_outside(memory.view("RUN@"), False, OTHER)
    for record in scans(task, port, 1400 * MS):
        assert command_of(record.reads) == port.commands[-1]
    # A drive at rest: status and time since sync, interrupt, level and block of the gates.
    assert len(record.reads) <= 10
    assert {view for view, *_ in record.reads} == {MEASURED_VIEW, COMMAND_VIEW, memory.view("DELTA%")}


def test_modeled_scans_do_the_same_as_ideal_ones():
    task, _, port = started(800 * MS)
    other, other_memory, other_port = cml_task(**{"SPEED%": 2000, "REF%": 1500})
    other.run(0)
    list(scans(other, other_port, 600 * MS, modeled=True))
    other_memory.write_from_outside(other_memory.view("RUN@"), True, OTHER)
    list(scans(other, other_port, 800 * MS, modeled=True))
    assert other_port.commands == port.commands
    assert other.snapshot() == task.snapshot()


def test_scan_under_way_is_given_up_without_a_trace():
    task, _, port = started(900 * MS)
    before = task.snapshot()
    for stop_after in range(1, STEPS + 1):
        port.interrupt(port.now_ns)
        steps = task.scan_modeled(port.now_ns)
        for _ in range(stop_after):
            next(steps)
        assert task.snapshot() == before, "a scan under way shows nothing"
        steps.close()
        assert task.snapshot() == before


def test_scan_under_way_goes_on_in_another_rack():
    """What a modeled scan has heard is told again: the drive is neither measured nor commanded a second time."""
    task, _, port = started(900 * MS)
    for after in range(1, STEPS + 1):
        snapshot = task.snapshot()
        port.interrupt(port.now_ns)
        steps = task.scan_modeled(port.now_ns)
        for _ in range(after):
            next(steps)
        progress = json.loads(json.dumps(task.progress))
        commands = len(port.commands)
        other, other_memory, other_port = cml_task()
        other.run(0)
        other.restore(snapshot)
        other_memory.load_image(task.memory.image())
        other_memory.now_ns = task.memory.now_ns
        other_port.interrupt(port.now_ns)
        other_port.measured = port.measure(8)
        resumed = other.resume_scan(progress)
        assert len(other_port.commands) == 0
        finished(steps)
        finished(resumed)
        assert other.snapshot()[:-10] == task.snapshot()[:-10]
        assert other.memory.image() == task.memory.image()
        assert len(other_port.commands) == len(port.commands) - commands
        port.now_ns += port.commands[-1].next_ns


def diagnostics(values):
    """The two pages of DIAG_DATA, each a list of its rows."""
    return [[values[row * 2 + page] for row in range(38)] for page in (0, 1)]


class Loop:
    """A loop whose scans are what a test says: the real one takes no other method once it is compiled ahead of time."""

    def __init__(self, loop, scan):
        self.real, self.scan = loop, scan

    def __getattr__(self, name):
        return getattr(self.real, name)


@pytest.mark.parametrize("local", [False, True])
def test_records_of_the_diagnostic_data_go_where_the_task_says(local):
    """52.3.2: as the loop's outcome says, on the page that is selected, wherever the array is declared."""
    text = CML.replace("LOCAL SCANS%", "LOCAL DIAG%(37,1), SCANS%").replace(", DIAG%(37,1)", "", 1) if local else CML
    task, memory, _ = cml_task(text)
    task.run(0)
    task.loop = Loop(task.loop, lambda *_: Outcome(Command(2_777_778), None, (-100, 200, 0x21)))

    def array():
        return task.value("DIAG%") if local else memory.present(memory.view("DIAG%"))

    for number in range(13):
        task.scan(number)
    first, second = diagnostics(array())
    assert first[1] == 2
    assert first[2:] == [-100, 200, 0x21] * 12
    assert second == [0] * 38
    assert task.snapshot() is not None


def test_writes_of_diagnostic_data_are_those_of_the_task():
    task, memory, _ = cml_task()
    task.run(0)
    task.loop = Loop(task.loop, lambda *_: Outcome(Command(2_777_778), None, (-100, 200, 0x21)))
    task.record_scans()
    memory.write_from_outside(memory.view("DIAG%"), 1, OTHER, 0)
    memory.write_from_outside(memory.view("DIAG%"), 12, OTHER, 3)
    record = task.scan(0)
    view = memory.view("DIAG%")
    # Page 1 is selected: record 12 stands in its rows 35 to 37, and NEXT_ENTRY goes back to 1.
    assert record.writes == [(view, 71, -100), (view, 73, 200), (view, 75, 0x21), (view, 3, 1)]


def test_problems_are_logged_at_the_line_of_the_call():
    task, *_ = cml_task()
    task.run(0)
    task.loop = Loop(task.loop, lambda *_: Outcome(Command(2_777_778), None, None, (7001, 7002)))
    task.scan(0)
    assert [(entry.line, entry.code, entry.scan) for entry in task.errors.entries] == [(1000, 7001, 1), (1000, 7002, 1)]


def inputs_seen(task):
    """What the loop is given at the next scan."""
    seen = []
    task.loop = Loop(task.loop, lambda *given: seen.append(given[2]) or Outcome(Command(2_777_778)))
    task.scan(0)
    return seen[0]


def test_force_holds_inputs_but_not_the_speed_and_voltage_that_faults_look_at():
    """52.1.5: FORCE is supported for inputs, but not for SPEED_FDBK and OSV_FDBK."""
    task, memory, _ = cml_task(**{"REF%": 1, "SPEED%": 2, "OSV%": 3})
    task.run(0)
    for name, held in (("REF%", 100), ("SPEED%", 200), ("OSV%", 300)):
        memory.force(memory.view(name), held)
        memory.write_now(memory.view(name), 7, OTHER)
    seen = inputs_seen(task)
    assert (seen.reference, seen.speed_fdbk, seen.osv_fdbk) == (100, 7, 7)
    assert value(memory, "SPEED%") == 200, "everybody else sees the force"
    for name in ("REF%", "SPEED%", "OSV%"):
        memory.release(memory.view(name))
    seen = inputs_seen(task)
    assert (seen.reference, seen.speed_fdbk, seen.osv_fdbk) == (100, 200, 300)


def test_value_before_a_force_is_what_the_loop_sees_until_the_next_write():
    task, memory, _ = cml_task(**{"SPEED%": 2})
    task.run(0)
    task.record_scans()
    memory.force(memory.view("SPEED%"), 200)
    memory.force(memory.view("SPEED%"), 300)
    assert inputs_seen(task).speed_fdbk == 2
    record = task.scan(1)
    assert (memory.view("SPEED%"), 0, 2) in record.reads, "a replay is told it too"
    other, other_memory, _ = cml_task()
    other_memory.load_image(memory.image())
    other_memory.hold(memory.forced, memory.under_forces)
    other.run(0)
    assert inputs_seen(other).speed_fdbk == 2
