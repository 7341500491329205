"""The 57C405: the armature voltage of a drive, scaled by the transformer of 52.6.1, and inputs from outside."""

from __future__ import annotations

import pytest
from rack.modules.drive_racks import YAML, Hand, built, turning

from automax_ros.drive.current_loop.signals import VOLTAGE, VOLTS
from automax_ros.rack.modules.drive_io import GAINS, voltage_counts, voltage_gain

TRANSFORMERS = [(240, 230, 250.0), (397, 380, 413.54), (480, 460, 500.0), (575, 550, 598.96), (690, 660, 718.75)]
"""Rating, nominal voltage and the input for 5 V (52.6.1)."""


@pytest.mark.parametrize(("rating", "nominal", "input_v"), TRANSFORMERS)
def test_gains_make_5_v_of_the_manuals_inputs(rating, nominal, input_v):
    assert pytest.approx(5.0, rel=2e-3) == input_v * GAINS[nominal]
    assert pytest.approx(input_v, rel=0.045) == rating
    half_scale = voltage_counts(input_v, nominal)
    assert abs(half_scale - 4095 / 2) < 5
    assert voltage_counts(-input_v, nominal) == -half_scale
    assert voltage_counts(3 * input_v, nominal) == 4095
    assert voltage_counts(-3 * input_v, nominal) == -4095


@pytest.mark.parametrize(
    ("line_v", "gain"), [(208, 0.02), (230, 0.02), (305, 0.02), (306, 0.0121), (440, 0.01), (480, 0.01), (575, 0.00835)]
)
def test_the_transformer_is_the_one_nearest_to_the_line(line_v, gain):
    assert voltage_gain(line_v) == gain


def test_register_0_shows_what_the_loop_gets(tmp_path):
    rack, hand = turning(tmp_path)
    _, measured, _ = hand.seen[-1]
    volts = measured.voltage * 460 / VOLTS
    assert volts > 50
    assert rack.value("ARM_V%") == voltage_counts(volts, 460)
    # Counts are volts at a gain of 1/100 and 4095 counts at 10 V.
    assert rack.value("ARM_V%") == pytest.approx(volts * 4.095, abs=1)
    emf = rack.plants["UNWIND"].circuit.emf_v
    assert 0.7 * emf < volts < 1.5 * emf
    hand.port.disarm()
    rack.run(0.3)
    assert rack.value("ARM_V%") == pytest.approx(rack.plants["UNWIND"].circuit.emf_v * 4.095, abs=1)
    rack.operations.stop_all("an input stays")
    assert rack.value("ARM_V%") > 0


def test_without_it_the_loop_has_no_voltage(tmp_path):
    rack = built(tmp_path, yaml=YAML.replace("57C405, drive: 7", "57C405"))
    rack.start()
    hand = Hand(rack)
    hand.arm(0)
    rack.write("ARM_V%", 1234)
    rack.run(0.1)
    assert all(not measured.status & VOLTAGE and measured.voltage == 0 for _, measured, _ in hand.seen)
    assert rack.value("ARM_V%") == 1234


def test_the_other_inputs_come_from_outside(tmp_path):
    rack = built(tmp_path, yaml=YAML + "  SPARE%: {slot: 9, register: 3, ros: in}\n")
    rack.start()
    rack.write("SPARE%", -77)
    rack.run(0.1)
    assert rack.value("SPARE%") == -77
