"""TACHLOSS_OVERSPEED (section 35)."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from blocks.support import int16, repeatable, run

NAMES = ("overspeed_lim", "tl_spd_llim", "av_spd_llim", "tl_vfb_llim", "arm_vfb_llim")
PRINTED = dict(zip(NAMES, (4505, 205, 1638, 1200, 150), strict=True))
"""The defaults printed in the section."""


def found(block, speed, volts, **limits):
    """OVERSPEED, TACH_LOSS and ARM_VFB_LOSS; SPEED_FAULT must be their OR."""
    result = block.scan(speed_fdbk=speed, arm_voltage_fdbk=volts, **limits)
    faults = (result["overspeed"], result["tach_loss"], result["arm_vfb_loss"])
    assert result["speed_fault"] is any(faults)
    assert block.error == 0
    return faults


NONE, OVERSPEED, TACH_LOSS, VOLTAGE_LOSS = (
    (False, False, False),
    (True, False, False),
    (False, True, False),
    (False, False, True),
)
FROM_BOTH_SIDES = [
    (4505, 3000, NONE),
    (4506, 3000, OVERSPEED),
    (205, 1201, NONE),
    (204, 1201, TACH_LOSS),
    (204, 1200, NONE),
    (0, 32767, TACH_LOSS),
    (1639, 150, NONE),
    (1639, 149, VOLTAGE_LOSS),
    (1638, 149, NONE),
    (4505, 0, VOLTAGE_LOSS),
    (4506, 149, (True, False, True)),
    (0, 0, NONE),
    (-32768, 3000, OVERSPEED),
    (-32768, 0, (True, False, True)),
    (0, -32768, TACH_LOSS),
]


@pytest.mark.parametrize("turned", [(1, 1), (-1, 1), (1, -1), (-1, -1)])
@pytest.mark.parametrize(("speed", "volts", "faults"), FROM_BOTH_SIDES)
def test_default_limits_from_both_sides_and_in_both_directions(speed, volts, faults, turned):
    speed, volts = (
        value if value == -32768 else value * sign for value, sign in zip((speed, volts), turned, strict=True)
    )
    assert found(run("TACHLOSS_OVERSPEED"), speed, volts) == faults


@pytest.mark.parametrize("literal", [True, False])
@pytest.mark.parametrize(
    ("name", "limit", "speed", "volts", "faults"),
    [
        ("overspeed_lim", 4504, 4505, 3000, OVERSPEED),
        ("overspeed_lim", 4506, 4506, 3000, NONE),
        ("overspeed_lim", 0, -1, 3000, (True, True, False)),
        ("tl_spd_llim", 206, 205, 1201, TACH_LOSS),
        ("tl_spd_llim", 204, 204, 1201, NONE),
        ("tl_vfb_llim", 1199, 204, 1200, TACH_LOSS),
        ("tl_vfb_llim", 1201, 204, 1201, NONE),
        ("av_spd_llim", 1637, 1638, 149, VOLTAGE_LOSS),
        ("av_spd_llim", 1639, 1639, 149, NONE),
        ("arm_vfb_llim", 151, 1639, 150, VOLTAGE_LOSS),
        ("arm_vfb_llim", 149, 1639, 149, NONE),
    ],
)
def test_each_limit_can_be_programmed(name, limit, speed, volts, faults, literal):
    if literal:
        assert found(run("TACHLOSS_OVERSPEED", **{name: limit}), speed, volts) == faults
    else:
        assert found(run("TACHLOSS_OVERSPEED"), speed, volts, **{name: limit}) == faults


def test_the_magnitude_of_minus_32768_lies_above_every_limit():
    block = run("TACHLOSS_OVERSPEED", overspeed_lim=32767, tl_vfb_llim=32767, tl_spd_llim=32767, arm_vfb_llim=32767)
    assert found(block, -32768, -32768) == OVERSPEED
    assert found(block, 32766, -32768) == TACH_LOSS
    assert found(block, 32767, -32767) == NONE


def test_negative_limits_are_taken_as_they_stand():
    """A magnitude lies above each of them."""
    block = run("TACHLOSS_OVERSPEED", overspeed_lim=-1, tl_spd_llim=-5, av_spd_llim=-5, tl_vfb_llim=-5, arm_vfb_llim=-5)
    assert found(block, 0, 0) == OVERSPEED


def test_faults_go_with_their_cause():
    block = run("TACHLOSS_OVERSPEED")
    assert [found(block, speed, 3000)[0] for speed in (4506, 4505, 4506, 0)] == [True, False, True, False]
    assert [found(block, speed, 3000)[1] for speed in (0, 205, 0)] == [True, False, True]


near = {name: st.integers(limit - 2, limit + 2) for name, limit in PRINTED.items()}


@repeatable
@given(
    st.sampled_from([*PRINTED.values()]).flatmap(lambda limit: st.integers(limit - 2, limit + 2)) | int16,
    st.sampled_from([*PRINTED.values()]).flatmap(lambda limit: st.integers(limit - 2, limit + 2)) | int16,
    st.fixed_dictionaries({}, optional={name: near[name] | int16 for name in NAMES}),
)
def test_the_equations_of_35_1(speed, volts, limits):
    lim = {**PRINTED, **limits}
    overspeed = speed > lim["overspeed_lim"] or -speed > lim["overspeed_lim"]
    slow = -lim["tl_spd_llim"] < speed < lim["tl_spd_llim"]
    fast = speed > lim["av_spd_llim"] or -speed > lim["av_spd_llim"]
    high = volts > lim["tl_vfb_llim"] or -volts > lim["tl_vfb_llim"]
    low = -lim["arm_vfb_llim"] < volts < lim["arm_vfb_llim"]
    assert found(run("TACHLOSS_OVERSPEED"), speed, volts, **limits) == (overspeed, slow and high, fast and low)
