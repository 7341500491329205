"""The transfer functions that the dynamic blocks declare: what the blocks do, and what scipy makes of them."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import signal

from automax_ros.blocks.catalogue import CATALOGUE
from automax_ros.blocks.declare.dynamics import bilinear
from blocks.support import repeatable, run

PERIOD_NS = 10_000_000
T = PERIOD_NS / 1e9
CASES = [
    ("DIFF_LAG", {"WLG": 5.0}),
    ("LAG", {"WLG": 5.0}),
    ("LAG", {"WLG": 5.0, "WM": 20.0}),
    ("LEAD_LAG", {"WLD": 20.0, "WLG": 5.0, "WM": 30.0}),
    ("INTEGRATE", {"KI": 0.3}),
    ("PROP_INT", {"KP": 0.7, "WLD": 0.4}),
    ("NOTCH", {"Q_FACTOR": 2.0, "WN": 30.0}),
    *(("NOTCHN", {"Q_FACTOR": 2.0, "WN": 60.0, "ORDER": order}) for order in (2, 4)),
    *(("HIGH_PASS_FILTER", {"WLD": 40.0, "ORDER": order}) for order in (1, 2, 3)),
    *(("LOW_PASS_FILTER", {"WLG": 40.0, "ORDER": order}) for order in (1, 2, 3)),
    ("PID", {"KP": 0.7, "KI": 0.4, "KD": 0.02, "LOOP_TIME": T}),
    ("PID", {"ISA": True, "KP": 0.7, "KI": 0.4, "KD": 0.02, "LOOP_TIME": T}),
]
each_case = pytest.mark.parametrize(("name", "given_values"), CASES)


def transfer_of(name, given_values):
    declared = CATALOGUE[name].coefficients
    values = {**declared.defaults(T), **{key: float(value) for key, value in given_values.items()}}
    return declared.dynamics.transfer(T, values)


def test_all_blocks_of_sections_41_to_50_declare_theirs():
    measured = {
        block.name
        for block in CATALOGUE.values()
        if block.coefficients and not block.coefficients.dynamics.not_measured
    }
    assert measured == {block.name for block in CATALOGUE.values() if 41 <= int(block.section) <= 50}
    assert measured == {name for name, _ in CASES}


@each_case
def test_the_block_does_what_its_discrete_function_says(name, given_values):
    transfer = transfer_of(name, given_values)
    inputs = [int(value) for value in 1000 * np.sin(np.arange(400) ** 1.3 / 40.0)]
    expected = signal.lfilter(transfer.b, transfer.a, inputs)
    literals = {key.lower(): value for key, value in given_values.items()}
    block = run(name, PERIOD_NS, **literals)
    rest = {"feedback": 0} if name == "PID" else {}
    outputs = [block.scan(input=value, **rest)["output"] for value in inputs]
    assert np.max(np.abs(outputs - expected)) <= 0.5 + 1e-6


@each_case
def test_responses_are_those_of_scipy(name, given_values):
    transfer = transfer_of(name, given_values)
    for rad_s in (0.5, 4.0, 29.0, 200.0):
        _, (discrete,) = signal.freqz(transfer.b, transfer.a, [rad_s * transfer.period_s])
        assert transfer.discrete_response(rad_s) == pytest.approx(discrete, rel=1e-9, abs=1e-9)
        numerator, denominator = transfer.numerator, transfer.denominator
        assert transfer.laplace_response(rad_s) == pytest.approx(
            np.polyval(numerator, 1j * rad_s) / np.polyval(denominator, 1j * rad_s), rel=1e-9
        )


@each_case
def test_laplace_and_discrete_agree_where_frequencies_are_low(name, given_values):
    transfer = transfer_of(name, given_values)
    assert transfer.discrete_response(0.5) == pytest.approx(transfer.laplace_response(0.5), rel=0.02, abs=1e-3)


@repeatable
@given(
    st.lists(st.floats(0.1, 10.0), min_size=1, max_size=4),
    st.lists(st.floats(0.1, 10.0), min_size=4, max_size=4),
    st.floats(0.5, 50.0),
)
def test_bilinear_is_scipys(numerator, denominator, c):
    b, a = bilinear(numerator, denominator, c)
    expected_b, expected_a = signal.bilinear(numerator, denominator, fs=c / 2.0)
    np.testing.assert_allclose(b, np.pad(expected_b, (0, 4 - len(expected_b))), rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(a, expected_a, rtol=1e-6, atol=1e-9)
