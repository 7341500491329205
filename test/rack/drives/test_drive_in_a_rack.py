"""A drive in a rack, end to end: a CML task, its 57C406, 57C408 and 57C405, a plant, a BASIC task, stimuli."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from itertools import cycle

import pytest

from automax_ros.rack.modules.drive import DriveControllerModule
from automax_ros.rack.rack import Rack
from automax_ros.runtime.tasks.task import Status
from automax_ros.scenario.stimuli.player import StimuliPlayer
from automax_ros.scenario.stimuli.reader import read_for_rack
from rack.helpers import rack_at, run_for
from rack.modules.cml_racks import ALONE, CML, COMMONS, NEAR, built, started


@pytest.mark.parametrize("execution", ["ideal", "modeled"])
def test_a_drive_starts_and_keeps_its_current(tmp_path, execution):
    rack = started(tmp_path, execution=execution)
    assert rack.value("I_FDBK%") == pytest.approx(1500, rel=0.1)
    assert rack.value("PERIOD%") == 16667
    assert [rack.value(name) for name in ("LOCKED@", "FMCR@", "OK@", "IOC@", "SYNC@", "TACH@")] == [
        True, True, True, False, False, False,
    ]  # fmt: skip
    task = rack.task("CML")
    assert task.errors.count == 0
    assert task.scan_number == pytest.approx(1.6 * 360, abs=2)
    assert rack.plants["UNWIND"].motor.speed_rad_s > 10


def test_modeled_and_ideal_execution_turn_the_motor_alike(tmp_path):
    """A command that comes some hundred microseconds later delays the first firing only: both regulate the current."""
    ideal, modeled = (started(tmp_path, execution=item) for item in ("ideal", "modeled"))
    one, other = (rack.plants["UNWIND"].motor.speed_rad_s for rack in (ideal, modeled))
    assert one != other
    assert other == pytest.approx(one, rel=0.05)


def test_interrupts_come_amid_a_long_scan_of_another_task(tmp_path):
    """In modeled time a task that computes for longer than two interrupts are apart is suspended at each of them."""
    loop = "110 FOR N% = 1 TO 600\n120 SUM! = SUM! + N%\n130 NEXT N%\n"
    work = f"10 COMMON PERMIT@\n20 LOCAL N%, SUM!\n100 CALL SCAN_LOOP(TICKS=8)\n{loop}150 END\n"
    rack = started(tmp_path, execution="modeled", work=work)
    by_name = {item.name: item.statistics for item in rack.scheduled}
    assert by_name["WORK"].longest_ns > 2 * 2_777_778
    assert rack.task("CML").scan_number == pytest.approx(1.6 * 360, abs=2)
    assert rack.task("CML").errors.count == rack.task("WORK").errors.count == 0


def test_the_motor_coasts_when_its_task_stops_and_does_not_restart_by_itself(tmp_path):
    rack = started(tmp_path)
    rack.operations.stop("CML")
    assert [rack.value(name) for name in ("FMCR@", "OK@")] == [False, False]
    plant = rack.plants["UNWIND"]
    rack.run(0.05)
    assert not plant.bridge.wiring.armature_closed
    assert plant.circuit.current_a == 0
    scans = rack.task("CML").scan_number
    rack.run(0.5)
    assert rack.task("CML").scan_number == scans
    rack.operations.run("CML")
    rack.run(1.0)
    assert rack.value("LOCKED@") is True
    assert [rack.value(name) for name in ("STATE@", "FMCR@", "OK@")] == [False, False, True]


@pytest.mark.parametrize("how", ["stop_all", "power", "fault"])
def test_whatever_stops_the_rack_stops_the_drive(tmp_path, how):
    rack = started(tmp_path)
    if how == "stop_all":
        rack.operations.stop_all("test")
    elif how == "power":
        rack.operations.power(200_000_000)
    else:
        rack.task("WORK").fault(14, rack.now_ns)
        rack.scheduled[1].fault(14)
    rack.run(0.1)
    plant = rack.plants["UNWIND"]
    assert not plant.bridge.wiring.armature_closed
    assert plant.circuit.current_a == 0
    assert [rack.value(name) for name in ("FMCR@", "OK@", "TLD%", "STATE@")] == [False, False, 0, False]
    assert rack.value("PERMIT@") is True
    speed = plant.motor.speed_rad_s
    rack.run(0.3)
    assert plant.now_ns >= rack.now_ns - 5_500_000
    assert plant.motor.speed_rad_s <= speed


def test_a_force_on_a_relay_changes_what_its_point_shows_only(tmp_path):
    rack = started(tmp_path)
    rack.force("FMCR@", False)
    rack.run(0.1)
    assert [rack.value(name) for name in ("FMCR@", "STATE@")] == [False, True]
    assert rack.plants["UNWIND"].bridge.wiring.armature_closed
    rack.unforce("FMCR@")
    rack.run(0.01)
    assert rack.value("FMCR@") is True


def test_losing_the_permissive_stops_the_drive(tmp_path):
    rack = started(tmp_path)
    rack.write("PERMIT@", False)
    rack.run(0.3)
    assert [rack.value(name) for name in ("STATE@", "FMCR@")] == [False, False]
    rack.write("PERMIT@", True)
    rack.run(0.5)
    assert rack.value("STATE@") is False
    rack.write("RUN@", False)
    rack.run(0.02)
    rack.write("RUN@", True)
    rack.run(0.5)
    assert rack.value("STATE@") is True


def test_an_external_trip_stops_the_drive_until_it_is_reset(tmp_path):
    rack = started(tmp_path)
    rack.write("TRIP@", True)
    rack.run(0.05)
    assert [rack.value(name) for name in ("STATE@", "IET@", "OK@", "FMCR@")] == [False, True, False, False]
    rack.write("RUN@", False)
    rack.write("RESET@", True)
    rack.run(0.05)
    assert rack.value("IET@") is True
    rack.write("TRIP@", False)
    rack.run(0.05)
    assert [rack.value(name) for name in ("IET@", "OK@")] == [False, True]


def test_only_what_a_lower_priority_writes_later_takes_effect(tmp_path):
    """52.4.1: the start-up part of the CML task writes the defaults after that of a task of higher priority."""
    writes = "20 TLD% = 120\n30 PHASE% = 80\n40 STEP% = 40\n"
    work = f"10 COMMON TLD%, PHASE%, STEP%\n{writes}100 CALL SCAN_LOOP(TICKS=1)\n110 END\n"

    def registers(rack: Rack) -> list[object]:
        return [rack.value(name) for name in ("TLD%", "PHASE%", "STEP%", "FAST@")]

    lower = built(tmp_path, work=work)
    higher = built(tmp_path, work=work, slots=ALONE.replace("WORK: {priority: 8}", "WORK: {priority: 4}"))
    for rack in (lower, higher):
        rack.start()
        rack.run(0.1)
    assert registers(lower) == [120, 80, 40, False]
    assert registers(higher) == [109, 4, 2, False]
    lower.write("FAST@", True)
    lower.operations.stop("CML")
    assert registers(lower) == [120, 80, 40, True]
    lower.operations.run("CML")
    lower.run(0.1)
    assert registers(lower) == [109, 4, 2, False]


def test_a_basic_task_sets_the_registers_once_as_the_manual_advises(tmp_path):
    """52.7: it writes and ends; the drive runs with what it wrote."""
    (tmp_path / "WORK.BAS").write_text("10 COMMON TLD%, PHASE%, STEP%, FAST@\n20 TLD% = 120\n30 FAST@ = TRUE\n40 END\n")
    slots = ALONE.replace("WORK: {priority: 8}", "WORK: {priority: 8, file: WORK.BAS}")
    rack = started(tmp_path, slots=slots)
    assert [rack.value(name) for name in ("TLD%", "PHASE%", "STEP%", "FAST@")] == [120, 4, 2, True]
    assert rack.task("WORK").status is Status.ENDED


@pytest.mark.parametrize(("name", "value"), [("PHASE%", 0), ("STEP%", 0), ("PHASE%", -4), ("STEP%", -1)])
def test_a_filter_limit_of_zero_or_less_loses_the_line(tmp_path, name, value):
    rack = started(tmp_path)
    rack.write(name, value)
    rack.run(0.1)
    assert [rack.value(item) for item in ("SYNC@", "STATE@", "LOCKED@", "OK@")] == [True, False, False, False]
    assert rack.value(name) == value


@pytest.mark.parametrize(("degrees", "trips"), [(20, True), (126, False), (300, False), (-5, True)])
def test_the_tach_loss_threshold_is_limited_in_use_and_stays_as_written(tmp_path, degrees, trips):
    """DELTA is about 100 degrees, and there is less than 5 % of speed feedback: 300 counts as 127, -5 as 0."""
    rack = started(tmp_path)
    delta = rack.value("DELTA%") * 360 / 16667
    assert 90 < delta < 120
    rack.write("TLD%", degrees)
    rack.write("SPEED%", 100)
    rack.run(0.1)
    assert rack.value("TACH@") is trips
    assert rack.value("TLD%") == degrees


STIMULI = """\
- {at: 0.1, module: {7: {test_switch: A}}}
- {at: 0.2, module: {7: {test_switch: B}}}
- {at: 0.3, module: {7: {test_switch: centre, fault_reset_switch: true}}}
"""


def test_stimuli_move_the_switches_that_the_block_shows(tmp_path):
    rack = built(tmp_path)
    (tmp_path / "switches.yaml").write_text(STIMULI)
    file = read_for_rack(tmp_path / "switches.yaml", rack)
    assert file.stimuli is not None, file.diagnostics
    player = StimuliPlayer(file.stimuli, rack.scheduler)
    player.begin()
    rack.start()
    seen = []
    for _ in range(12):
        rack.run(0.1)
        seen.append(tuple(rack.value(name) for name in ("POSA@", "POSB@", "RESET_SW@")))
    none, a, b, reset = (False, False, False), (True, False, False), (False, True, False), (False, False, True)
    assert seen == [none, a, b] + [reset] * 5 + [none] * 4


@pytest.mark.parametrize(("slots", "drive"), [(ALONE, 7), (NEAR, 2)])
@pytest.mark.parametrize("execution", ["ideal", "modeled"])
@pytest.mark.parametrize("cut_s", [0.0, 0.0999, 0.6301, 0.7502, 1.2013])
def test_a_rack_with_a_drive_goes_on_from_a_state_bit_for_bit(tmp_path, slots, drive, execution, cut_s):
    def make() -> Rack:
        return built(tmp_path, slots=slots, drive=drive, execution=execution)

    rack = run_for(make())
    rack.write("PERMIT@", True)
    rack.write("SPEED%", 2000)
    rack.write("REF%", 1500)
    rack.run(min(0.6, cut_s))
    if cut_s > 0.6:
        rack.write("RUN@", True)
        rack.run(cut_s - 0.6)
    state = rack.state()
    other = make()
    other.load(replace(state, plants=json.loads(json.dumps(state.plants))))
    for one in (rack, other):
        one.run(0.3)
        one.write("RUN@", True)
        one.run(0.6)
    assert rack.state() == other.state()
    assert rack.value("STATE@") is True
    assert rack.task("CML").scan_number == other.task("CML").scan_number > 300


@pytest.mark.parametrize("late_ms", [[0.3, 1.1], [2.9, 7.0, 0.05], [40.0, 1.0, 13.7]])
def test_however_late_the_host_is_the_drive_does_the_same(tmp_path, late_ms):
    """On the wall clock interrupts that are late are carried out in order, with the instants of rack time."""
    slots = ALONE.replace(", WORK: {priority: 8}", "")
    simulated, live = built(tmp_path, slots=slots), built(tmp_path, slots=slots)

    def pass_to(seconds: float) -> None:
        until_ns = round(seconds * 1e9) + 1
        simulated.scheduler.run_until(until_ns)
        lateness = cycle(late_ms)
        while live.now_ns < until_ns:
            live.scheduler.run_due(min(until_ns, live.now_ns + round(next(lateness) * 1e6)))

    def set_both(name: str, value: object) -> None:
        for rack in (simulated, live):
            rack.write(name, value)

    for rack in (simulated, live):
        rack.start()
    set_both("PERMIT@", True)
    set_both("SPEED%", 2000)
    pass_to(0.6)
    set_both("RUN@", True)
    pass_to(1.1)
    set_both("REF%", 1500)
    pass_to(1.5)
    assert live.value("STATE@") is True
    assert live.plants["UNWIND"].motor.speed_rad_s > 5
    assert simulated.task("CML").scan_number == live.task("CML").scan_number
    simulated.plants["UNWIND"].advance(1_500_000_001)
    live.plants["UNWIND"].advance(1_500_000_001)
    assert simulated.plants.state() == live.plants.state()
    greatest_ns = next(
        module.timing for module in live.modules if isinstance(module, DriveControllerModule)
    ).greatest_ns
    assert greatest_ns <= max(late_ms) * 1e6


TWO = """\
0: {module: 57C413}
  1: {module: 57C435, tasks: {CML: {priority: 5}}}
  2: {module: 57C435, tasks: {SECOND: {priority: 4}, WORK: {priority: 8}}}
  7: {module: 57C406, plant: UNWIND}
  6: {module: 57C406, plant: WINDER}
  10: {module: 57C408}"""


def test_two_drives_of_a_rack_do_not_disturb_each_other(tmp_path):
    """The first one is, bit for bit, what it is alone, though both interrupt at the same instants."""
    own = [name for name in COMMONS if name != "REF%"]
    second = re.sub("|".join(own), lambda found: f"{found[0][:-1]}2{found[0][-1]}", CML)
    second = second.replace("IO_CNTL_SLOT=SLOT", "IO_CNTL_SLOT=6").replace("DIG_IO_SLOT=8", "DIG_IO_SLOT=10")
    (tmp_path / "SECOND.BLK").write_text(second)
    alone = started(tmp_path)
    commons = "".join(f"  {name[:-1]}2{name[-1]}: {{}}\n" for name in own)
    commons += "  PERMIT2@: {slot: 10, register: 0, bit: 0}\n"
    built(tmp_path)
    text = (tmp_path / "rack.yaml").read_text().replace(ALONE, TWO) + commons
    (tmp_path / "rack.yaml").write_text(text.replace("plants:\n", "plants:\n  WINDER: {motor: dc_10hp_240v}\n"))
    both = run_for(rack_at(tmp_path / "rack.yaml"))
    for name in ("PERMIT@", "PERMIT2@"):
        both.write(name, True)
    both.write("SPEED%", 2000)
    both.write("SPEED2%", 2000)
    both.run(0.6)
    both.write("RUN@", True)
    both.write("RUN2@", True)
    both.run(0.5)
    both.write("REF%", 1500)
    both.run(0.5)
    assert both.value("STATE2@") is True
    assert both.plants["WINDER"].motor.speed_rad_s > 10
    assert both.plants["UNWIND"].state() == alone.plants["UNWIND"].state()
