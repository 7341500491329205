"""The formulas of 52.4 to 52.6 against the manual's numbers, and against the circuit that the emulator solves."""

from math import acos, cos, degrees, pi, radians, sqrt

import pytest

from automax_ros.drive.assess.limits import (
    TABLE_3_MH_A,
    boundary_amps,
    delta_bound_deg,
    jbar_s,
    largest_inductance_mh,
    ripple_amps,
    table_3_line_v,
)
from automax_ros.drive.base.errors import ParameterError
from automax_ros.drive.base.nameplate import EXAMPLES, derive
from automax_ros.drive.circuit.steady import BridgeCase, steady_state

TABLE_3 = """
    1500.0 0.8431 1.5644 2.1079 2.3466
    1400.0 0.9034 1.6761 2.2584 2.5142
    1300.0 0.9729 1.8051 2.4321 2.7076
    1200.0 1.0539 1.9555 2.6348 2.9332
    1100.0 1.1497 2.1332 2.8743 3.1999
    1000.0 1.2647 2.3466 3.1618 3.5199
    950.0 1.3313 2.4701 3.3282 3.7051
    900.0 1.4052 2.6073 3.5131 3.9110
    850.0 1.4879 2.7607 3.7197 4.1410
    800.0 1.5809 2.9332 3.9522 4.3998
    750.0 1.6863 3.1288 4.2157 4.6932
    700.0 1.8067 3.3522 4.5168 5.0284
    650.0 1.9457 3.6101 4.8643 5.4152
    600.0 2.1079 3.9110 5.2696 5.8664
    550.0 2.2995 4.2665 5.7487 6.3998
    500.0 2.5294 4.6932 6.3236 7.0397
    475.0 2.6626 4.9402 6.6564 7.4102
    450.0 2.8105 5.2146 7.0262 7.8219
    425.0 2.9758 5.5214 7.4395 8.2820
    400.0 3.1618 5.8664 7.9045 8.7997
    375.0 3.3726 6.2575 8.4314 9.3863
    350.0 3.6135 6.7045 9.0337 10.0568
    325.0 3.8914 7.2202 9.7286 10.8303
    300.0 4.2157 7.8219 10.5393 11.7329
    275.0 4.5990 8.5330 11.4974 12.7995
    250.0 5.0589 9.3863 12.6471 14.0794
    225.0 5.6209 10.4292 14.0524 15.6438
    200.0 6.3236 11.7329 15.8089 17.5993
    190.0 6.6564 12.3504 16.6410 18.5256
    180.0 7.0262 13.0365 17.5654 19.5548
    170.0 7.4395 13.8034 18.5987 20.7051
    160.0 7.9045 14.6661 19.7611 21.9991
    150.0 8.4314 15.6438 21.0785 23.4657
    140.0 9.0337 16.7613 22.5842 25.1419
    130.0 9.7286 18.0506 24.3214 27.0759
    120.0 10.5393 19.5548 26.3482 29.3322
    110.0 11.4974 21.3325 28.7435 31.9988
    100.0 12.6471 23.4658 31.6178 35.1986
    90.0 14.0524 26.0731 35.1309 39.1096
    80.0 15.8089 29.3322 39.5223 43.9983
    70.0 18.0673 33.5225 45.1683 50.2838
    60.0 21.0785 39.1096 52.6964 58.6644
    50.0 25.2943 46.9315 63.2356 70.3972
    40.0 31.6178 58.6644 79.0445 87.9966
    30.0 42.1571 78.2192 105.3927 117.3288
    20.0 63.2356 117.3288 158.0891 175.9931
    10.0 126.4713 234.6575 316.1781 351.9863
"""
"""The manual's table 3: rated current in A; largest inductance in mH at 230, 460, 575 and 660 V."""
CELLS = [
    (float(row.split()[0]), line_v, text)
    for row in TABLE_3.strip().splitlines()
    for line_v, text in zip((230.0, 460.0, 575.0, 660.0), row.split()[1:], strict=True)
]


def test_table_3_has_47_rows_of_4_line_voltages():
    assert len(CELLS) == 188
    assert sorted({amps for amps, _, _ in CELLS})[::46] == [10.0, 1500.0]


@pytest.mark.parametrize("line_v", TABLE_3_MH_A)
def test_every_cell_of_table_3_within_its_rounding(line_v):
    cells = [(amps, float(text)) for amps, column, text in CELLS if column == line_v]
    worst = max(abs(largest_inductance_mh(line_v, amps) - printed) for amps, printed in cells)
    assert worst <= 0.5e-4 + 1e-9


def test_between_the_rows_the_limit_lies_between_theirs():
    assert (
        largest_inductance_mh(460.0, 250) > largest_inductance_mh(460.0, 245.8 + 10) > largest_inductance_mh(460, 275)
    )
    assert largest_inductance_mh(460.0, 245.8) == pytest.approx(9.5467, abs=1e-4)


@pytest.mark.parametrize(
    ("line_v", "column"),
    [(460, 460), (480, 460), (440, 460), (600, 575), (690, 660), (230, 230), (380, None), (800, None)],
)
def test_a_line_takes_the_column_near_its_voltage(line_v, column):
    assert table_3_line_v(line_v) == column


@pytest.mark.parametrize(
    ("armature_v", "line_v", "bound"), [(500, 460, 127.1), (240, 230, 125.4), (600, 575, 125.4), (700, 660, 126.1)]
)
def test_equation_1_at_the_usual_voltages(armature_v, line_v, bound):
    found = delta_bound_deg(armature_v, line_v)
    assert round(found, 1) == bound
    # DELTA is 180 degrees less alpha, and there the ideal bridge gives three quarters of the armature's voltage
    assert 1.35 * line_v * cos(radians(180 - found)) == pytest.approx(0.75 * armature_v)


def test_equation_1_asks_for_a_line_that_can_drive_the_motor():
    assert delta_bound_deg(1.8 * 460, 460) == pytest.approx(180)
    with pytest.raises(ParameterError, match="does not belong on this line"):
        delta_bound_deg(1.81 * 460, 460)


@pytest.mark.parametrize(("name", "jbar"), [("10hp", 0.19), ("150hp", 0.29), ("800hp", 0.31)])
def test_equation_2_at_150_percent_of_the_example_motors(name, jbar):
    plate, parameters = EXAMPLES[name], derive(EXAMPLES[name])
    torque = 1.5 * parameters.values["shaft_torque_n_m"].value
    assert round(jbar_s(parameters.motor.inertia_kg_m2, plate.rpm, torque), 2) == jbar


def test_jbar_is_the_time_to_base_speed_at_that_torque():
    """308 is 60 / (2 pi) x 32.17 ft/s2, a quarter of a percent up: WR2 SB / (308 T) is J w / T."""
    inertia, rpm, torque = 2.3, 1200.0, 450.0
    assert jbar_s(inertia, rpm, torque) == pytest.approx(inertia * rpm * pi / 30 / torque, rel=3e-3)


@pytest.mark.parametrize("name", EXAMPLES)
def test_boundary_and_ripple_are_those_of_the_circuit(name):
    """An ideal source and a time constant of 1 s: the formulas' assumptions, solved by the plant's own circuit."""
    parameters = derive(EXAMPLES[name])
    inductance, line_v = parameters.motor.inductance_h + 2 * parameters.source_h, parameters.line_v
    boundary = boundary_amps(line_v, 60.0, inductance)
    ohm = inductance
    # at a little more than alpha 90 the mean voltage drives the boundary current through that resistance
    ideal = 3 * sqrt(2) / pi * line_v
    alpha = degrees(acos(1.02 * boundary * ohm / ideal))
    state = steady_state(BridgeCase(line_v, 60.0, resistance_ohm=ohm, inductance_h=inductance, alpha_deg=alpha))
    assert state.continuous
    assert state.mean_current_a == pytest.approx(1.02 * boundary, rel=2e-3)
    assert state.start_current_a == pytest.approx(0.02 * boundary, abs=0.01 * boundary)
    assert state.ripple_pp_a == pytest.approx(boundary + ripple_amps(line_v, 60.0, inductance), rel=2e-3)


def test_boundary_of_the_150_hp_example():
    assert boundary_amps(460, 60, 2.22e-3 + 2 * 0.14e-3) == pytest.approx(61.4, abs=0.1)
