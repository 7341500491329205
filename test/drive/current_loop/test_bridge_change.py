"""The change of bridges: dead times, ordinary and fast, nothing fires across, and what goes wrong without voltage."""

import random
from itertools import pairwise

import pytest

from automax_ros.drive.assess.limits import largest_inductance_mh
from automax_ros.drive.circuit.conduction import EventKind
from automax_ros.drive.current_loop.bridge_change import FLOOR, BridgeChange, ChangeStage, preset_us
from automax_ros.drive.current_loop.signals import OVERCURRENT, VOLTAGE, VOLTS, Measured, gate_numbers
from drive.current_loop.support import Bench, parameters_of

EMF = {"10hp": 210.0, "150hp": 450.0, "800hp": 640.0}
FAST = 1


def running(size, hertz, emf, reference, *, fast=False, voltage=False):
    bench = Bench(size, hertz)
    bench.emf(emf)
    bench.registers = (109, 4, 2, FAST if fast else 0)
    if voltage:
        bench.status |= VOLTAGE
    bench.start()
    bench.plant.circuit.take_events()
    bench.set(reference=reference)
    bench.run(0.4)
    assert bench.plant.circuit.take_events() == []
    return bench


def dead_ms(scans, old, new):
    """The time without current from the last current of the old sign to the first of the new."""
    last = max(index for index, scan in enumerate(scans) if scan.measured.current * old > 0)
    first = min(index for index, scan in enumerate(scans) if scan.measured.current * new > 0)
    if first < last or not scans[last].measured.tail_us:
        return scans[last].measured.zero_us / 1000
    between = sum(scan.measured.zero_us for scan in scans[last + 1 : first + 1])
    return (scans[last].measured.tail_us + between) / 1000


def change(bench, old, new):
    """Change the reference; return the scans and the dead time."""
    bench.set(reference=new)
    scans = bench.run(0.4)
    for scan in scans:
        for pulse in scan.command.pulses:
            assert len({number > 10 for number in gate_numbers(pulse.gates)}) == 1
    assert scans[-1].bridge == (2 if new < 0 else 1)
    return scans, dead_ms(scans, old, new)


@pytest.mark.parametrize(("size", "hertz"), [("10hp", 60), ("150hp", 60), ("150hp", 50), ("800hp", 50)])
def test_ordinary_dead_time_is_3_to_70_ms_by_emf_and_reference(size, hertz):
    found = {}
    for part in (-1.0, -0.4, 0.0, 0.4, 1.0):
        for amount in (60, 2047, 4095):
            bench = running(size, hertz, part * EMF[size], amount)
            scans, dead = change(bench, amount, -amount)
            assert 3.0 <= dead <= 70.0
            assert bench.plant.circuit.take_events() == []
            assert not any(scan.measured.status & OVERCURRENT for scan in scans)
            assert scans[-1].feedback == pytest.approx(-amount, abs=2)
            found[part, amount] = dead
    for amount in (60, 2047, 4095):
        # Bridge 2 has to find the EMF that stands against it: -1 is a motor at full speed backwards.
        times = [found[part, amount] for part in (-1.0, -0.4, 0.0, 0.4, 1.0)]
        assert all(one > two for one, two in pairwise(times))
    for part in (-1.0, 0.0):
        assert found[part, 60] > found[part, 2047] > found[part, 4095]


def test_the_other_way_round_is_as_long():
    there = change(running("150hp", 60, 450.0, 2047), 2047, -2047)[1]
    back = change(running("150hp", 60, -450.0, -2047), -2047, 2047)[1]
    assert there == pytest.approx(back, abs=0.01)


@pytest.mark.parametrize(("size", "hertz"), [("10hp", 60), ("150hp", 60), ("150hp", 50), ("800hp", 60)])
def test_fast_change_takes_about_2_ms(size, hertz):
    times = []
    for part in (-1.0, -0.4, 0.0, 0.4, 1.0):
        for amount in (400, 2047, 4095):
            bench = running(size, hertz, part * EMF[size], amount, fast=True, voltage=True)
            scans, dead = change(bench, amount, -amount)
            assert bench.plant.circuit.take_events() == []
            assert not any(scan.measured.status & OVERCURRENT for scan in scans)
            assert scans[-1].feedback == pytest.approx(-amount, abs=2)
            assert 0.5 <= dead <= 2 * 1000 / (6 * hertz) + 0.5
            times.append(dead)
    assert 1.5 < sum(times) / len(times) < 3.5


@pytest.mark.parametrize("amount", [20, 200, 2047, 4095])
def test_fast_change_without_voltage_ends_in_an_ioc_fault_at_speed(amount):
    bench = running("150hp", 60, 450.0, amount, fast=True)
    bench.set(reference=-amount)
    scans = bench.run(0.3)
    assert any(scan.measured.status & OVERCURRENT for scan in scans)
    assert bench["IOC_OUT"]
    assert not bench["DC_CML_STATE"]


def test_fast_change_without_voltage_does_no_harm_at_standstill():
    bench = running("150hp", 60, 0.0, 2047, fast=True)
    scans, dead = change(bench, 2047, -2047)
    assert dead < 6.0
    assert not any(scan.measured.status & OVERCURRENT for scan in scans)


def crossfires(bench, emf, amount):
    """Let a drive change its bridges to and fro, fast; return how often both conduct at once."""
    bench.emf(emf)
    bench.registers = (109, 4, 2, FAST)
    bench.status |= VOLTAGE
    bench.start()
    bench.plant.circuit.take_events()
    for sign in (1, -1, 1, -1):
        bench.set(reference=sign * amount)
        bench.run(0.3)
    assert {scan.bridge for scan in bench.scans} == {1, 2}
    return sum(event.kind is EventKind.CROSS_FIRE for event in bench.plant.circuit.take_events())


@pytest.mark.parametrize("late_us", [600, 1450, 1600, 1900])
@pytest.mark.parametrize("part", [-1.0, 0.4, 1.0])
def test_a_command_that_comes_late_fires_nothing_across(late_us, part):
    """From 1.5 ms on a pulse of the old bridge, planned ahead, comes between interrupt and command."""
    for amount in (60, 800, 4095):
        assert crossfires(Bench("150hp", late_ns=late_us * 1000), part * EMF["150hp"], amount) == 0


@pytest.mark.parametrize("late_us", [0, 1900])
@pytest.mark.parametrize("times", [1.1, 2.0, 5.0, 20.0])
@pytest.mark.parametrize("size", ["10hp", "800hp"])
def test_above_the_limits_of_table_3_nothing_fires_across_either(size, times, late_us):
    """The loop of this emulator waits for the end of the current itself, not for a signal that tells of it (52.6)."""
    parameters = parameters_of(size)
    inductance_h = times * largest_inductance_mh(parameters.line_v, parameters.amps) * 1e-3
    for part, amount in ((-1.0, 800), (0.4, 2047), (1.0, 4095)):
        bench = Bench(size, inductance_h=inductance_h, late_ns=late_us * 1000)
        assert crossfires(bench, part * EMF[size], amount) == 0


def test_a_reference_that_turns_back_before_zero_current_changes_nothing():
    bench = running("150hp", 60, 450.0, 4095)
    bench.set(reference=-500)
    while bench.loop.control.change.stage == ChangeStage.NONE:
        bench.scan()
    bench.set(reference=4095)
    scans = bench.run(0.4)
    assert {scan.bridge for scan in scans} == {1}
    assert scans[-1].feedback == pytest.approx(4095, abs=2)


def test_the_sign_of_the_reference_selects_the_bridge_from_one_count_on():
    """52.1.2: a plus value turns bridge 1 on, a minus value bridge 2; 0 leaves the one that is on."""
    bench = running("150hp", 60, 200.0, 500)
    for reference, bridge in ((3, 1), (0, 1), (-1, 2), (0, 2), (1, 1)):
        bench.set(reference=reference)
        assert bench.run(0.3)[-1].bridge == bridge


def test_a_reference_that_turns_in_each_scan_is_slowed_by_the_change_itself():
    """A change waits for a scan without current: a sign that turns in each scan is not followed in each."""
    bench = running("150hp", 60, 200.0, 500)
    changes, before, most = 0, 1, 0.0
    for _ in range(180):
        bench.set(reference=-400 if bench.loop.control.bridge == 1 else 400)
        scan = bench.scan()
        changes, before, most = changes + (scan.bridge != before), scan.bridge, max(most, abs(scan.feedback))
    assert 1 <= changes < 180
    assert most < 1000


def test_old_bridge_is_blocked_until_its_scrs_have_recovered():
    change = BridgeChange()
    scan_us = 2777.8
    assert not change.scan(Measured(0, 1000), -100.0, scan_us, fast=False)
    assert change.stage == ChangeStage.BACK
    assert not change.scan(Measured(0, 100, 300, 300), -100.0, scan_us, fast=False)
    assert change.stage == ChangeStage.OFF
    assert change.scan(Measured(0, 0, 2778, 3078), -100.0, scan_us, fast=False)
    assert (change.bridge, change.stage) == (2, ChangeStage.NONE)


def test_preset_lies_at_the_angle_of_the_emf():
    period = 1e6 / 60
    at_rest = preset_us(Measured(VOLTAGE), 1, 4095.0, 700, period)
    # Alpha 90, less 40 % of the 30 degrees from first to continuous current.
    assert at_rest == pytest.approx(period * (90 - 0.4 * 30) / 360, rel=1e-6)
    half = round(0.5 * 1.3505 * VOLTS)
    assert preset_us(Measured(VOLTAGE, voltage=half), 1, 4095.0, 700, period) - at_rest == pytest.approx(
        period * 30 / 360, rel=1e-3
    )
    assert at_rest - preset_us(Measured(VOLTAGE, voltage=half), 2, 4095.0, 700, period) == pytest.approx(
        period * 30 / 360, rel=1e-3
    )
    # Without a 57C405 the voltage counts for nothing: alpha 90, for a small reference, too.
    assert {preset_us(Measured(0, voltage=half), 1, wanted, 700, period) for wanted in (0.7, 4095.0)} == {period / 4}
    # A small reference begins lower.
    assert preset_us(Measured(VOLTAGE), 1, 0.7, 700, period) == pytest.approx(period * (90 - 0.9 * 30) / 360, rel=1e-6)


@pytest.mark.parametrize("size", sorted(EMF))
def test_no_commutation_fails_whatever_the_reference_does(size):
    chance = random.Random(size)
    bench = Bench(size, chance.choice((50, 60)))
    bench.start()
    bench.plant.circuit.take_events()
    period_us = bench.loop.pll.period_us
    emf = 0.0
    for _ in range(150):
        wanted = chance.uniform(-1.05, 1.05) * EMF[size]
        bench.set(reference=chance.randint(-4095, 4095))
        for _ in range(chance.choice((4, 20, 70))):
            emf += max(-0.003 * EMF[size], min(0.003 * EMF[size], wanted - emf))
            bench.emf(emf)
            scan = bench.scan()
            if not scan.measured.zero_us and scan.measured.current:
                assert scan.delta_us >= FLOOR * period_us - 1
    assert bench.plant.circuit.take_events() == []
