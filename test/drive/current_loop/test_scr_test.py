"""The shorted SCR diagnostic (52.3.1) on simulated plants: every SCR, what it costs, what it says at speed."""

from dataclasses import replace

import pytest

from automax_ros.core.problems import PROBLEMS
from automax_ros.drive.base.nameplate import EXAMPLES, derive
from automax_ros.drive.current_loop.scr_test import GO_ON, THRESHOLD, ScrTest
from automax_ros.drive.current_loop.signals import Measured, gate_numbers
from automax_ros.drive.plant.plant import DrivePlant, PlantData
from drive.current_loop.protected import LOCKED_S, Drive

SUSPECTS = {1: {1, 14}, 2: {2, 15}, 3: {3, 16}, 4: {4, 11}, 5: {5, 12}, 6: {6, 13}}
"""The manual's table."""
PAIR = {scr: pair for pair, scrs in SUSPECTS.items() for scr in scrs}
LONGEST_S = {0: 0.04 + 0.15, 2: 0.04 + 0.3}
"""From the edge to the run, by register 4146: the contactor, and 9 or 18 cycles at 60 Hz."""


def after_start(drive, seconds=0.45, options=0):
    """The drive after a start with the test; the outcomes of its scans."""
    drive.registers = (109, 4, 2, options)
    drive.run(LOCKED_S)
    return drive.run(seconds, cml_run=True)


def fired_alone(outcomes):
    """The SCRs that were fired in each scan of a test, with DELTA in us."""
    found = []
    for outcome in outcomes:
        for pulse in outcome.command.pulses if outcome.command.block else ():
            (number,) = gate_numbers(pulse.gates)
            after_us = pulse.after_ns / 1000
            found.append((number, round(outcome.command.next_ns / 1000 - after_us) if after_us else 0))
    return found


@pytest.mark.parametrize("size", ["10hp", "150hp", "800hp"])
@pytest.mark.parametrize("scr", PAIR)
def test_each_shorted_scr_is_found(size, scr):
    drive = Drive(size, tests_scrs=True)
    drive.plant.circuit.short_scr(scr)
    after_start(drive)
    assert (drive["BAD_SCR_OUT"], drive["BAD_SCR_NUM"]) == (True, PAIR[scr])
    assert drive.codes == ["AMX7116"]
    assert PROBLEMS["AMX7116"].hardware == "87"
    assert not drive.relay
    assert not any(row["DC_CML_STATE"] for _, row in drive.rows)


@pytest.mark.parametrize("scr", PAIR)
def test_the_other_rotation_makes_no_difference(scr):
    plant = DrivePlant(PlantData(derive(EXAMPLES["150hp"]), standard_rotation=False))
    drive = Drive(plant=plant, tests_scrs=True, nonstand_phrot=True)
    plant.circuit.short_scr(scr)
    after_start(drive)
    assert (drive.faults, drive["BAD_SCR_NUM"]) == ({"BAD_SCR_OUT"}, PAIR[scr])


@pytest.mark.parametrize("hertz", [48, 50, 62])
@pytest.mark.parametrize("scr", [None, *PAIR])
def test_neither_does_the_frequency(scr, hertz):
    plant = DrivePlant(PlantData(derive(replace(EXAMPLES["150hp"], line_hz=hertz))))
    drive = Drive(plant=plant, tests_scrs=True, ac_line_freq=hertz)
    if scr:
        plant.circuit.short_scr(scr)
    after_start(drive)
    assert (drive["BAD_SCR_NUM"], drive["DC_CML_STATE"]) == (PAIR.get(scr, 0), scr is None)


@pytest.mark.parametrize("emf", [120.0, 300.0, 470.0, -120.0, -300.0, -480.0])
@pytest.mark.parametrize("scr", PAIR)
def test_a_motor_that_turns_hides_no_short(scr, emf):
    drive = Drive(tests_scrs=True)
    drive.plant.motor.speed_rad_s = emf / drive.plant.data.parameters.motor.k_v_s
    drive.plant.circuit.short_scr(scr)
    after_start(drive)
    assert ("BAD_SCR_OUT" in drive.faults, drive["BAD_SCR_NUM"]) == (True, PAIR[scr])


# Where current flows once an SCR is fired alone on a line A, B, C, and the leg that must be shorted for it:
# (fired, currents of line and armature at the interrupt, pair). SCR 1 leads A to P, 2 leads M to C (docs/drive.md).
WAYS = [
    (1, "line", 5), (1, "both", 2), (1, "armature", 4),
    (2, "line", 6), (2, "both", 3), (2, "armature", 5),
    (3, "line", 1), (3, "both", 4), (3, "armature", 6),
    (6, "line", 4), (6, "both", 1), (6, "armature", 3),
    (11, "line", 2), (11, "both", 5), (11, "armature", 1),
    (16, "line", 1), (16, "both", 4), (16, "armature", 6),
]  # fmt: skip


@pytest.mark.parametrize(("fired", "way", "pair"), WAYS)
def test_the_way_of_the_current_names_the_leg(fired, way, pair):
    test = ScrTest()
    test.begin(both=True)
    numbers = ()
    for position in range(108):
        (pulse,) = test.fire(position % 6, 16_666_667, reverse=False)
        numbers = gate_numbers(pulse.gates)
        if numbers == (fired,):
            break
        assert test.judge(Measured(0, tail_us=2778), reverse=False) == GO_ON
    assert numbers == (fired,)
    ways = {"line": (THRESHOLD, 0, 2778), "both": (THRESHOLD, 900, 0), "armature": (0, -THRESHOLD, 0)}
    line, current, tail_us = ways[way]
    assert test.judge(Measured(0, current, 0, tail_us, line=line), reverse=False) == pair
    assert test.judge(Measured(0, current // 2, 0, tail_us, line=line // 2), reverse=False) == GO_ON


@pytest.mark.parametrize("size", ["10hp", "150hp", "800hp"])
@pytest.mark.parametrize("options", [0, 2])
@pytest.mark.parametrize("speed_rad_s", [0.0, 60.0, -60.0])
def test_a_sound_bridge_starts(size, options, speed_rad_s):
    drive = Drive(size, tests_scrs=True)
    drive.plant.motor.speed_rad_s = speed_rad_s
    after_start(drive, LONGEST_S[options], options)
    assert (drive["DC_CML_STATE"], drive.faults, drive.codes) == (True, set(), [])


def test_gates_are_fired_one_by_one_with_a_growing_delta():
    drive = Drive(tests_scrs=True)
    fired = fired_alone(after_start(drive, 0.235))
    assert len(fired) == 54
    for cycle in range(9):
        numbers, deltas = zip(*fired[6 * cycle : 6 * cycle + 6], strict=True)
        assert set(numbers) == {1, 2, 3, 4, 5, 6}
        assert set(deltas) == {100 * cycle}


def test_the_dierikon_variant_fires_both_bridges():
    drive = Drive(tests_scrs=True)
    fired = fired_alone(after_start(drive, 0.385, options=2))
    assert len(fired) == 108
    assert {number for number, _ in fired[:54]} == {1, 2, 3, 4, 5, 6}
    assert {number for number, _ in fired[54:]} == {11, 12, 13, 14, 15, 16}
    assert [delta for _, delta in fired[54:]] == [delta for _, delta in fired[:54]]


@pytest.mark.parametrize(("options", "cycles"), [(0, 9), (2, 18)])
def test_it_delays_the_run_by_its_cycles(options, cycles):
    def ran_ns(*, tests_scrs):
        drive = Drive(tests_scrs=tests_scrs)
        drive.registers = (109, 4, 2, options)
        drive.run(LOCKED_S)
        edge_ns = drive.now_ns
        drive.inputs = drive.inputs._replace(cml_run=True)
        while not drive.loop.sequence.running:
            drive.scan()
        return drive.now_ns - edge_ns

    added_us = (ran_ns(tests_scrs=True) - ran_ns(tests_scrs=False)) / 1000
    assert added_us == pytest.approx(cycles * 16666.667, abs=1)
    if options == 0:  # 52.3.1: approximately 180 ms
        assert ran_ns(tests_scrs=True) / 1e9 == pytest.approx(0.18, abs=0.01)


def test_it_ends_at_the_first_failure():
    drive = Drive(tests_scrs=True)
    drive.plant.circuit.short_scr(3)
    fired = fired_alone(after_start(drive))
    numbers, deltas = zip(*fired, strict=True)
    # Pair 3 is the one that 5 takes over from: nothing is fired after it at the DELTA that showed the short.
    assert numbers[-1] == 5
    assert deltas.count(deltas[-1]) <= 6
    assert max(deltas) <= 300


def test_without_the_output_there_is_no_test():
    drive = Drive(tests_scrs=False)
    drive.plant.circuit.short_scr(3)
    after_start(drive, 0.1)
    assert (drive["DC_CML_STATE"], drive["BAD_SCR_OUT"], drive.codes) == (True, False, [])


def test_a_repaired_scr_is_tested_again():
    drive = Drive(tests_scrs=True)
    drive.plant.circuit.short_scr(12)
    after_start(drive)
    drive.run(0.1, fault_reset=True)
    assert (drive.faults, drive["BAD_SCR_NUM"]) == (set(), 0)
    drive.run(0.1, fault_reset=False, cml_run=False)
    drive.run(0.4, cml_run=True)
    assert (drive.codes, drive["BAD_SCR_NUM"]) == (["AMX7116"] * 2, 5)
    drive.run(0.1, fault_reset=True, cml_run=False)
    drive.plant.circuit.short_scr(12, shorted=False)
    drive.run(0.4, fault_reset=False, cml_run=True)
    assert (drive["DC_CML_STATE"], drive.faults) == (True, set())
