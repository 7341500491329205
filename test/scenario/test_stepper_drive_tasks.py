"""A current minor loop task in a rack, from the interrupts of its 57C406 to the contactor, and who operates it."""

from __future__ import annotations

import json
import re

import pytest
from rack.drives.drive_tasks import CML, SPEED, YAML, folder_of, permit, rack_of, running
from rack.helpers import rack_at
from replay.replays import edited

from automax_ros.core.diagnostics import SourceText
from automax_ros.core.ticks import NS_PER_S
from automax_ros.drive.current_loop.minor_loop import CurrentMinorLoop
from automax_ros.rack.operator.retention import Retention
from automax_ros.rack.rack import Rack
from automax_ros.rack.tasks.installation import RackError
from automax_ros.runtime.memory.views import MemoryValueError
from automax_ros.runtime.scan.scan_record import Status
from automax_ros.scenario.stepper import Stepper, Why

MS = 1_000_000
MODELED = "execution: modeled\n"


def amps(rack):
    return abs(rack.plants["UNWIND"].circuit.current_a)


def source(text, name="CML.BLK"):
    return SourceText(name, text)


def test_drive_keeps_the_reference_that_another_task_gives(tmp_path):
    rack = running(tmp_path)
    assert rack.value("CURRENT%") == pytest.approx(rack.value("REF%"), rel=0.01)
    assert rack.value("REF%") > 2000
    # 4095 counts are LIM_BAR, 150 % of the motor's 245.8 A.
    assert amps(rack) == pytest.approx(rack.value("REF%") / 4095 * 1.5 * 245.8, rel=0.15)


def test_scans_come_six_times_a_cycle_and_count_as_such(tmp_path):
    rack = rack_of(tmp_path)
    permit(rack)
    rack.run(1.999)
    # The first at 0; each 2.777778 ms as the loop follows the line.
    assert rack.statistics["CML"].scans == rack.task("CML").scan_number == rack.task("CML").value("SCANS%") == 720
    assert rack.statistics["CML"].skipped == 0


def test_registers_get_their_defaults_at_run_and_a_lower_task_writes_them_after(tmp_path):
    """52.4.1, 52.7."""
    rack = rack_of(tmp_path)
    permit(rack)
    rack.run(0.1)
    assert rack.value("TLD%") == 120, "the BASIC task has a lower priority"
    rack.operations.stop("CML")
    assert rack.value("TLD%") == 120
    rack.operations.run("CML")
    assert rack.value("TLD%") == 109
    rack.run(0.1)
    assert rack.value("TLD%") == 109, "the BASIC task has ended: it is put into RUN again after the loop's task"
    rack.operations.run("REGS")
    rack.run(0.1)
    assert rack.value("TLD%") == 120


def test_first_part_of_a_lower_control_block_task_counts_too(tmp_path):
    """52.4.1 has the statement in the initialization section of a task of lower priority."""
    speed = SPEED.replace("10 COMMON ", "10 COMMON TLD%, ").replace("1000 CALL", "900 TLD% = 125\n1000 CALL")
    rack = rack_of(tmp_path, speed=speed)
    rack.start()
    assert rack.value("TLD%") == 125


@pytest.mark.parametrize("extra", ["", MODELED])
@pytest.mark.parametrize("how", ["stop", "stop_all", "power_off", "delete", "fault"])
def test_drive_does_not_go_on_without_its_task(tmp_path, how, extra):
    rack = running(tmp_path, extra=extra)
    assert amps(rack) > 100
    operations = rack.operations
    if how in ("stop", "delete"):
        operations.stop("CML")
    if how == "delete":
        operations.delete("CML")
    elif how == "stop_all":
        operations.stop_all("test")
    elif how == "power_off":
        operations.power_off()
    elif how == "fault":
        next(item for item in rack.scheduled if item.name == "SPEED").fault(7070)
        assert rack.stop_reason is not None
    scans = rack.statistics["CML"].scans
    assert rack.value("FMCR@") is False, "the relay is off at once"
    rack.run(0.5)
    assert amps(rack) == 0
    assert rack.statistics["CML"].scans == scans


@pytest.mark.parametrize("keep_state", [False, True])
def test_reload_stops_the_drive_and_wants_a_new_edge(tmp_path, keep_state):
    rack = running(tmp_path)
    scans = rack.task("CML").value("SCANS%")
    rack.operations.reload("CML", source(CML.replace("KP=0.2", "KP=0.3")), keep_state=keep_state)
    assert rack.value("FMCR@") is False
    rack.run(1.5)
    assert (rack.task("CML").status, rack.value("LOCKED@"), rack.value("STATE@")) == (Status.RUNNING, True, False)
    assert (rack.task("CML").value("SCANS%") > 500 + scans) is keep_state
    assert amps(rack) == 0
    rack.write("START@", False)
    rack.run(0.1)
    rack.write("START@", True)
    rack.run(0.5)
    assert rack.value("STATE@") is True


def test_reload_of_another_kind_of_task_is_refused_and_the_drive_runs_on(tmp_path):
    rack = running(tmp_path)
    with pytest.raises(RackError, match="a task of DC_DRIVE_CML"):
        rack.operations.reload("CML", source("1000 CALL SCAN_LOOP(TICKS=2)\n1010 END\n"))
    with pytest.raises(RackError, match=r"SPEED\.BLK has errors"):
        rack.operations.reload("SPEED", source(CML.replace("SLOT=7", "SLOT=6"), "SPEED.BLK"))
    rack.run(0.2)
    assert rack.value("STATE@") is True


def test_reload_onto_a_slot_without_a_57c406_is_refused(tmp_path):
    rack = running(tmp_path)
    with pytest.raises(RackError) as caught:
        rack.operations.reload("CML", source(CML.replace("IO_CNTL_SLOT=7", "IO_CNTL_SLOT=8")))
    assert [item.code for _, found in caught.value.findings for item in found] == ["AMX6486"]
    rack.run(0.1)
    assert rack.value("STATE@") is True


@pytest.mark.parametrize("auto_run", [False, True])
def test_power_comes_back(tmp_path, auto_run):
    rack = running(tmp_path)
    rack.operations.power_off()
    rack.run(0.5)
    rack.operations.power_on(auto_run=auto_run)
    rack.run(0.5)
    assert (rack.task("CML").status is Status.RUNNING, rack.value("LOCKED@")) == (auto_run, auto_run)
    assert amps(rack) == 0


def test_drive_fault_is_logged_and_stops_neither_the_task_nor_the_rack(tmp_path):
    rack = running(tmp_path)
    rack.write("SPEED%", 0)
    rack.run(0.5)
    log = rack.task("CML").errors
    assert (rack.value("TACH@"), rack.value("STATE@"), rack.stop_reason) == (False, True, None), "the motor stands"
    rack.write("OSV%", 6000)
    rack.run(0.5)
    assert (rack.value("STATE@"), rack.value("FMCR@"), rack.stop_reason) == (False, False, None)
    assert rack.task("CML").status is Status.RUNNING
    assert (log.first.line, log.first.problem) == (1000, "AMX7113")


def test_modeled_scans_take_their_time_and_the_drive_runs_all_the_same(tmp_path):
    rack = running(tmp_path, extra=MODELED)
    assert rack.value("CURRENT%") == pytest.approx(rack.value("REF%"), rel=0.02)
    statistics = rack.statistics["CML"]
    assert 0 < statistics.longest_ns < 2_777_778
    assert rack.stop_reason is None


def comparable(rack):
    """All that a rack's future depends on; a BASIC task that has ended may wait or not, it does nothing more."""
    state = rack.state()
    tasks = {
        name: {**task, "next_ns": None} if task["status"] == "ENDED" else task
        for name, task in state.modules[0].items()
    }
    return json.dumps([state.now_ns, state.image, {**state.modules, 0: tasks}, state.plants])


@pytest.mark.parametrize("extra", ["", MODELED])
@pytest.mark.parametrize("at_ns", [0, 1, 2_777_778, 55_000_000, 599_999_999, 611_000_001, 655_432_109, 709_800_000,
                                   711_234_567, 800_000_123])  # fmt: skip
def test_rack_goes_on_from_a_state_bit_for_bit(tmp_path, at_ns, extra):
    """Cut anywhere in a start: registers, loop, plant, the next interrupt, and a scan under way."""
    rack = rack_of(tmp_path, extra=extra)
    permit(rack)
    rack.scheduler.run_until(min(at_ns, 600_000_000))
    if at_ns >= 600_000_000:
        rack.write("START@", True)
        rack.scheduler.run_until(at_ns)
    other = Rack(rack.config)
    other.load(rack.state())
    for item in (rack, other):
        item.write("START@", True)
        item.scheduler.run_until(at_ns + NS_PER_S // 3)
    assert comparable(other) == comparable(rack)


@pytest.mark.parametrize("after_ns", [1, 100_000, 300_000])
def test_a_scan_under_way_has_nothing_of_the_scan_before_in_its_state(tmp_path, after_ns):
    """Whether or not it has latched: a rack that was cut before that scan has the same state in it."""
    rack = rack_of(tmp_path, extra=MODELED)
    permit(rack)
    rack.scheduler.run_until(52 * MS)
    other = Rack(rack.config)
    other.load(rack.state())
    interrupt_ns = rack.drives.port(7).next_ns
    assert interrupt_ns is not None
    for item in (rack, other):
        item.scheduler.run_until(interrupt_ns + after_ns)
    assert rack.task("CML").progress is not None
    assert comparable(other) == comparable(rack)


def test_forces_reach_inputs_and_no_output(tmp_path):
    """52.0: FORCE is supported for inputs, not for outputs; 52.1.5: not for SPEED_FDBK and OSV_FDBK."""
    rack = running(tmp_path)
    for name in ("STATE@", "CURRENT%", "DELTA%"):
        with pytest.raises(MemoryValueError, match=r"output of DC_DRIVE_CML in task CML \(line 1000\)"):
            rack.force(name, 1)
    with pytest.raises(MemoryValueError, match="output of DC_DRIVE_CML"):
        rack.force("CML.NOTE_BRIDGE@", True)
    rack.force("CML.SCANS%", 5)
    rack.force("REF%", 1000)
    rack.force("OSV%", 6000)
    rack.run(0.3)
    assert rack.value("CURRENT%") == pytest.approx(1000, abs=20)
    assert rack.value("STATE@") is True, "OSV does not look at a forced OSV_FDBK"
    rack.write("OSV%", 5500)
    rack.run(0.1)
    assert (rack.value("OSV%"), rack.value("STATE@")) == (6000, False), "what is under the force trips it"


def test_forced_run_and_its_release(tmp_path):
    rack = rack_of(tmp_path)
    permit(rack)
    rack.run(0.6)
    rack.force("RUN@", True)
    rack.run(0.5)
    assert rack.value("STATE@") is True
    rack.unforce("RUN@")
    rack.run(0.5)
    assert rack.value("STATE@") is False, "the task that writes RUN@ has it FALSE"


def test_local_of_a_fault_input_cannot_be_forced(tmp_path):
    cml = CML.replace("SPEED%, OSV%", "OSV%").replace("LOCAL SCANS%", "LOCAL SPEED%, SCANS%")
    rack = rack_of(tmp_path, cml=cml)
    rack.start()
    with pytest.raises(MemoryValueError, match="an input of DC_DRIVE_CML"):
        rack.force("CML.SPEED%", 1)
    rack.force("SPEED%", 1)


def test_kept_state_has_locals_and_log_and_no_loop(tmp_path):
    """2.4.5: what a power cycle keeps; the loop itself begins again."""
    rack = rack_of(tmp_path)
    kept = Retention(rack, tmp_path / "state")
    permit(rack)
    rack.write("OSV%", 6000)
    rack.run(1.5)
    assert kept.save()
    again = rack_of(tmp_path)
    assert Retention(again, tmp_path / "state").restore().notes == ()
    assert again.task("CML").errors.first.problem == "AMX7113"
    assert again.task("CML").value("SCANS%") == rack.task("CML").value("SCANS%") > 500
    assert again.task("CML").loop.numbers() == CurrentMinorLoop().numbers()
    permit(again)
    again.run(0.6)
    assert again.value("LOCKED@") is True


def test_loop_is_stepped_line_by_line_and_does_the_same(tmp_path):
    rack = rack_of(tmp_path)
    permit(rack)
    rack.scheduler.run_until(30 * MS)
    stepper = Stepper(rack.config)
    stepper.start((("PERMIT@", True), ("SPEED%", 1000), ("SPEED_REF%", 3000)))
    for line in (1000, 1010):
        stepper.break_at("CML", line)
    for scan in range(1, 12):
        call, after = stepper.until(30 * MS), stepper.until(30 * MS)
        assert [(halt.why, halt.task, halt.line) for halt in (call, after)] == [
            (Why.LINE, "CML", 1000), (Why.LINE, "CML", 1010)
        ]  # fmt: skip
        assert stepper.value("CML.SCANS%") == scan - 1
    assert stepper.until(30 * MS).why is Why.TIME
    assert comparable(stepper.rack) == comparable(rack)


TWO = """\
rack: PM1
slots:
  0: {module: 57C413}
  1: {module: 57C435, tasks: {CML: {priority: 4}}}
  2: {module: 57C435, tasks: {CML2: {priority: 4}}}
  7: {module: 57C406, plant: UNWIND}
  8: {module: 57C408}
  9: {module: 57C406, plant: WINDER}
  10: {module: 57C408}
plants:
  UNWIND: {motor: dc_150hp_500v, inertia: 100.0}
  WINDER: {motor: dc_10hp_240v, inertia: 100.0, line: {hz: 50}}
common:
  PERMIT@: {slot: 8, register: 0, bit: 0, ros: in}
  FMCR@: {slot: 8, register: 1, bit: 0}
  PERMIT2@: {slot: 10, register: 0, bit: 0, ros: in}
  FMCR2@: {slot: 10, register: 1, bit: 0}
"""
NAMES = ("REF", "RUN", "RESET", "SPEED", "OSV", "STATE", "LOCKED", "PERIOD", "CURRENT", "DELTA", "TACH")


def second(text):
    """The same task for the other drive: its commons end with 2, its line has 50 Hz."""
    for name in (*NAMES, "DIAG"):
        text = re.sub(rf"\b{name}(?=[%@])", f"{name}2", text)
    return text.replace("SLOT=7", "SLOT=9").replace("SLOT=8", "SLOT=10, AC_LINE_FREQ=50")


def two_drives(folder):
    kinds = {name: "%" if name in ("REF", "SPEED", "OSV", "PERIOD", "CURRENT", "DELTA") else "@" for name in NAMES}
    commons = "".join(f"  {name}{number}{kind}: {{}}\n" for number in ("", "2") for name, kind in kinds.items())
    path = folder_of(folder, yaml=f"{TWO}{commons}  DIAG%(37,1): {{}}\n  DIAG2%(37,1): {{}}\n")
    (folder / "CML2.BLK").write_text(second(CML))
    return rack_at(path)


def test_two_drives_run_each_on_its_own_line(tmp_path):
    rack = two_drives(tmp_path)
    rack.start((("PERMIT@", True), ("PERMIT2@", True), ("REF%", 1500), ("SPEED%", 1000), ("SPEED2%", 1000)))
    rack.run(0.599)
    assert (rack.value("PERIOD%"), rack.value("PERIOD2%")) == (16667, 20000)
    assert (rack.statistics["CML"].scans, rack.statistics["CML2"].scans) == (216, 180)
    rack.write("RUN@", True)
    rack.run(0.5)
    assert (rack.value("STATE@"), rack.value("FMCR@")) == (True, True)
    assert (rack.value("STATE2@"), rack.value("FMCR2@")) == (False, False)
    rack.write("RUN2@", True)
    rack.run(0.5)
    assert rack.value("STATE2@") is True
    rack.operations.stop("CML")
    rack.run(0.2)
    assert (rack.value("FMCR@"), rack.value("FMCR2@"), rack.value("STATE2@")) == (False, True, True)


def test_rack_without_a_plant_has_no_line(tmp_path):
    rack = rack_of(tmp_path, yaml=edited(YAML, ("57C406, plant: UNWIND", "57C406")))
    permit(rack)
    rack.run(1.0)
    assert rack.value("LOCKED@") is False
    assert rack.statistics["CML"].scans > 300
    assert rack.stop_reason is None
