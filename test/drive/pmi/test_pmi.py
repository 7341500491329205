"""The PMI of an SD3000 drive on the bench: parameters, test mode, scalings of its registers, faults of its link."""

from __future__ import annotations

from math import exp

import pytest

from automax_ros.drive.base.errors import ParameterError
from automax_ros.drive.base.nameplate import EXAMPLES, derive
from automax_ros.drive.current_loop.inputs import Latched
from automax_ros.drive.plant.plant import DrivePlant, LoadData, PlantData
from automax_ros.drive.pmi import registers as table
from automax_ros.drive.pmi.pmi import Commands, Pmi, inputs_of

READY = Commands(inputs=table.PERMITTED, linked=True, fed=True)


def plant(size: str = "150hp", **load: float) -> DrivePlant:
    return DrivePlant(PlantData(derive(EXAMPLES[size]), load=LoadData(**load)))


class Bench:
    """A PMI that scans at its interrupts."""

    def __init__(self, plant: DrivePlant, ratio: int | None = None) -> None:
        self.plant, self.pmi = plant, Pmi(plant, ratio)
        self.now_ns = 0
        self.commands = READY

    def run(self, seconds: float, control: int = 0, **changes: int | bool) -> Bench:
        """Command something for a time."""
        self.commands = self.commands._replace(control=control, **changes)
        end_ns = self.now_ns + round(seconds * 1e9)
        while self.now_ns < end_ns:
            self.now_ns += self.pmi.interrupt(self.now_ns, self.commands)
        return self

    def __getitem__(self, register: int) -> int:
        return self.pmi.feedback(self.now_ns)[register]


@pytest.mark.parametrize("size", sorted(EXAMPLES))
@pytest.mark.parametrize("ratio", [115, 150, 225, 325, 400])
def test_its_parameters_are_good_ones_for_every_motor_and_ratio(size, ratio):
    inputs = inputs_of(plant(size), ratio)
    assert Latched().start(inputs) == []
    assert inputs.lim_bar == ratio
    assert inputs.ioc_thresh == {115: 190, 150: 225, 225: 300, 325: 400, 400: 400}[ratio]


def test_without_a_ratio_it_is_150():
    assert Pmi(plant()).ratio == 150


def test_test_mode_fires_at_the_angle_of_its_register_without_regulation():
    bench = Bench(plant(held_rpm=0.0)).run(0.4, table.TEST, alpha=180)
    bench.run(0.5, table.TEST | table.RUN, alpha=95)
    assert bench[table.STATUS] & table.RUNNING
    assert bench[table.DELTA] == pytest.approx(85 / 360 * 16_667, abs=1)
    assert bench[table.CURRENT] > 0
    forward = bench[table.CURRENT]
    bench.run(0.2, table.TEST | table.TEST_BRIDGE_2, alpha=95)
    bench.run(0.5, table.TEST | table.TEST_BRIDGE_2 | table.RUN, alpha=95)
    assert bench[table.CURRENT] == pytest.approx(-forward, rel=0.02)
    assert bench[table.STATUS] & table.ON_BRIDGE_2


def test_the_reverse_contactor_is_chosen_at_the_start():
    bench = Bench(plant(held_rpm=0.0)).run(0.4)
    bench.run(0.3, table.RUN | table.REVERSE_CONTACTOR)
    assert bench[table.STATUS] & (table.FORWARD_ON | table.REVERSE_ON) == table.REVERSE_ON
    bench.run(0.1, table.RUN)
    assert bench[table.STATUS] & (table.FORWARD_ON | table.REVERSE_ON) == table.REVERSE_ON


def test_a_coast_stop_leaves_no_fault_and_needs_another_edge():
    bench = Bench(plant(held_rpm=0.0)).run(0.4).run(0.4, table.RUN, reference=1000)
    assert bench[table.STATUS] & table.RUNNING
    bench.run(0.02, table.RUN | table.COAST)
    assert not bench[table.STATUS] & table.RUNNING
    bench.run(0.5, table.RUN)
    assert not bench[table.STATUS] & (table.RUNNING | table.FAULT)
    bench.run(0.02).run(0.4, table.RUN)
    assert bench[table.STATUS] & table.RUNNING


def test_a_reference_beyond_the_ratio_counts_as_the_ratio_with_a_warning():
    bench = Bench(plant(held_rpm=0.0)).run(0.4).run(0.9, table.RUN, reference=20_000)
    assert bench[table.WARNINGS] == table.REFERENCE_LIMITED
    assert bench[table.REF_LAG_OUT] == 4095
    assert bench[table.CURRENT] == pytest.approx(4095, rel=0.01)
    bench.run(0.3, table.RUN, reference=-20_000)
    assert bench[table.REF_LAG_OUT] == -4095


@pytest.mark.parametrize("rpm", [-1750.0, -437.5, 0.0, 875.0, 1750.0])
def test_speed_position_and_voltage_of_a_shaft_that_something_turns(rpm):
    """Nobody fires: the armature shows its EMF, 477.9 V at base speed, in volts and at 3000 counts for 500 V."""
    bench = Bench(plant(held_rpm=rpm)).run(0.5)
    part = rpm / 1750
    emf_v = 500 - 0.045 * 500
    assert bench[table.SPEED] == pytest.approx(4095 * part, abs=1)
    assert bench[table.VOLTS] == pytest.approx(emf_v * part, abs=1)
    assert bench[table.VOLTAGE] == pytest.approx(emf_v * part / 500 * 3000, abs=1)
    assert bench[table.CURRENT] == bench[table.DELTA] == bench[table.REF_LAG_OUT] == 0
    turns = bench.now_ns * 1e-9 * rpm / 60
    assert bench[table.POSITION] == pytest.approx(turns % 1.0 * 4096, abs=2)


def test_speed_and_position_are_those_of_the_instant_of_the_scan():
    bench = Bench(plant(held_rpm=60.0)).run(0.1)
    first = bench.pmi.feedback(bench.now_ns + 250_000)[table.POSITION]
    second = bench.pmi.feedback(bench.now_ns + 1_250_000)[table.POSITION]
    assert (second - first) % 4096 == pytest.approx(4.096, abs=1)  # a turn per second


def test_a_reversal_of_the_current_at_standstill_looks_like_no_lost_tachometer():
    """TACHLOSS_OVERSPEED finds one where speed is below 205 and voltage above 1200, in a single scan (35)."""
    bench = Bench(plant(held_rpm=0.0)).run(0.4).run(0.6, table.RUN, reference=4095)
    shown, real = 0, 0.0
    for _ in range(40):
        bench.run(0.002, table.RUN, reference=-4095)
        shown = max(shown, abs(bench[table.VOLTAGE]))
        real = max(real, abs(bench.plant.circuit.armature_v))
    assert real > 400
    assert shown < 1200


def test_the_voltage_follows_with_a_lag_of_20_ms():
    bench = Bench(plant(held_rpm=0.0)).run(0.4, table.TEST, alpha=90)
    bench.run(0.6, table.TEST | table.RUN, alpha=90)
    bench.pmi.voltage = 1e4
    steady = bench[table.VOLTS]
    bench.run(0.02, table.TEST | table.RUN, alpha=90)
    assert steady == 460
    assert bench[table.VOLTS] == pytest.approx(460 * exp(-1), rel=0.15)


def test_dc_time_is_the_time_without_current():
    bench = Bench(plant(held_rpm=0.0)).run(0.4)
    assert bench[table.DC_TIME] == pytest.approx(2778, abs=1)
    bench.run(0.8, table.RUN, reference=3000)
    assert bench[table.DC_TIME] == 0


@pytest.mark.parametrize(
    ("lost", "bit"), [({"linked": False}, table.COMMUNICATION), ({"fed": False}, table.UDC_RUN)], ids=["link", "task"]
)
def test_a_drive_that_nobody_commands_trips_and_is_reset_in_standby(lost, bit):
    bench = Bench(plant(held_rpm=0.0)).run(0.4).run(0.5, table.RUN, reference=2000)
    assert bench.plant.circuit.current_a > 50
    bench.run(0.05, table.RUN, **lost)
    assert bench.plant.circuit.current_a == 0
    assert bench.pmi.faults == bit
    bench.run(0.05, table.FAULT_RESET, linked=False)
    assert bench.pmi.faults == bit, "without a link nothing resets"
    bench.run(0.01, table.FAULT_RESET, linked=True, fed=True)
    assert bench.pmi.faults == 0
    bench.run(0.02).run(0.4, table.RUN)
    assert bench[table.STATUS] & table.RUNNING


def test_standby_without_a_link_is_not_a_fault():
    bench = Bench(plant()).run(0.5, linked=False, fed=False)
    assert bench.pmi.faults == 0
    assert not bench[table.STATUS] & table.READY
    assert bench[table.STATUS] & table.LOCKED
    bench.run(0.01, linked=True, fed=True)
    assert bench[table.STATUS] & table.READY


def test_fast_bridge_change_takes_less_than_half_the_dead_time():
    def dead_ms(control: int) -> float:
        bench = Bench(plant(held_rpm=875.0)).run(0.4, control).run(0.7, control | table.RUN, reference=2000)
        bench.commands = bench.commands._replace(reference=-2000)
        idle_ns, before = 0, bench.now_ns
        while bench.plant.circuit.current_a >= -1.0:
            bench.now_ns += bench.pmi.interrupt(bench.now_ns, bench.commands)
            bench.plant.advance(bench.now_ns)
            idle_ns = max(idle_ns, int(bench.plant.circuit.idle_s * 1e9))
            assert bench.now_ns - before < 200_000_000
        return idle_ns / 1e6

    assert dead_ms(table.FAST_CHANGE) < dead_ms(0) / 2


def test_a_state_goes_on_bit_for_bit_and_another_is_refused():
    bench = Bench(plant(held_rpm=0.0)).run(0.4).run(0.31, table.RUN, reference=2000)
    other = Bench(plant(held_rpm=0.0))
    other.pmi.restore(bench.pmi.state())
    other.plant.restore(bench.plant.state())
    other.now_ns, other.commands = bench.now_ns, bench.commands
    for item in (bench, other):
        item.run(0.2, table.RUN, reference=-1500)
    assert other.pmi.state() == bench.pmi.state()
    assert other.plant.state() == bench.plant.state()
    with pytest.raises(ParameterError):
        other.pmi.restore(bench.pmi.state() | {"loop": [1.0]})
    with pytest.raises(ParameterError):
        other.pmi.restore({"loop": []})


def test_no_bit_or_register_has_two_meanings():
    registers = (*table.COMMAND_REGISTERS, *table.FEEDBACK_REGISTERS, *table.LINK_REGISTERS)
    numbers = [item.number for item in registers]
    assert len(set(numbers)) == len(numbers)
    for item in registers:
        bits = [bit for bit, _ in item.bits]
        assert sorted(set(bits)) == bits
    assert set(Pmi(plant()).feedback(0)) == {item.number for item in table.FEEDBACK_REGISTERS} - {table.INPUTS}
