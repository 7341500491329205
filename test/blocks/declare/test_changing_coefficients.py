"""Coefficients that change all the time, inside their limits: the states stay finite, and settle again."""

import math
import random

import pytest

from automax_ros.blocks.catalogue import CATALOGUE
from blocks.support import run

PERIOD_NS = 22_000_000
CASES = [
    ("NOTCH", {"q_factor": 5.0}, "wn", (5.0, 28.0), 0),
    ("NOTCHN", {"q_factor": 5.0, "order": 2}, "wn", (5.0, 120.0), 0),
    ("NOTCHN", {"q_factor": 5.0, "order": 4}, "wn", (15.0, 120.0), 0),
    *(("LOW_PASS_FILTER", {"order": order}, "wlg", (5.0, 140.0), 8000) for order in (1, 2, 3)),
    *(("HIGH_PASS_FILTER", {"order": order}, "wld", (5.0, 140.0), 0) for order in (1, 2, 3)),
    ("LAG", {}, "wlg", (0.1, 60.0), 8000),
    ("DIFF_LAG", {}, "wlg", (0.1, 60.0), 0),
    ("LEAD_LAG", {"wlg": 20.0}, "wld", (1.1, 9.0), 8000),
    ("INTEGRATE", {}, "ki", (0.01, 100.0), None),
    ("PROP_INT", {"kp": 1.0}, "wld", (0.01, 100.0), None),
]
SETTLED = {"NOTCH": 8000, "NOTCHN": 8000}


def finite(instance):
    return all(math.isfinite(value) and abs(value) <= 2**32 for value in instance.state.values())


@pytest.mark.parametrize("every", [1, 3, 8])
@pytest.mark.parametrize(("name", "literals", "parameter", "ends", "steady"), CASES)
def test_states_stay_finite_and_the_block_settles_again(name, literals, parameter, ends, steady, every):
    block = run(name, PERIOD_NS, **literals)
    noise = random.Random(7)
    for scan in range(3000):
        block.scan(input=noise.randint(-32768, 32767), **{parameter: ends[scan // every % 2]})
        assert finite(block)
    for _ in range(4000):
        block.scan(input=8000, **{parameter: ends[1]})
    assert finite(block)
    if steady is not None:
        assert block.outputs["output"] == SETTLED.get(name, steady)


@pytest.mark.parametrize("name", [block.name for block in CATALOGUE.values() if block.coefficients])
def test_any_values_every_scan(name):
    """Values far beyond the limits too, which move to them."""
    block = CATALOGUE[name]
    literal = {"LOOP_TIME": 0.022}
    instance = run(name, PERIOD_NS, **{key.lower(): value for key, value in literal.items() if block.parameter(key)})
    choice = random.Random(11)
    reals = [
        item.variable
        for item in block.inputs
        if item.form.name != "LITERAL" and item.name in block.coefficients.parameters
    ]
    others = [
        item.variable
        for item in block.inputs
        if item.required and item.variable not in reals and item.form.name != "LITERAL"
    ]
    for _ in range(3000):
        values = {key: choice.choice([0.0, -1.0, 1e-19, 0.02, 1.0, 30.0, 140.0, 1e18]) for key in reals}
        values = {key: int(value) % 30000 for key, value in values.items()} if name == "THERMAL_OVERLOAD" else values
        instance.scan(**values, **{key: choice.choice([-32768, 32767, 0, 100]) for key in others})
        assert all(math.isfinite(value) for value in instance.state.values())
