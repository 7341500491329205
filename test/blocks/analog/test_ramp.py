import pytest
from hypothesis import given
from hypothesis import strategies as st

from blocks.support import int16, repeatable, run


def scans(block, count, **inputs):
    return [block.scan(**inputs)["output"] for _ in range(count)]


def test_ramps_up_and_down_at_its_rates():
    block = run("RAMP", accel_rate=400, decel_rate=300)
    assert scans(block, 4, input=1000) == [400, 800, 1000, 1000]
    assert scans(block, 5, input=0) == [700, 400, 100, 0, 0]


def test_normal_ramp_accelerates_upward_only():
    block = run("RAMP", abs_ramp=False, accel_rate=400, decel_rate=300)
    assert scans(block, 3, input=-700) == [-300, -600, -700]
    assert scans(block, 3, input=200) == [-300, 100, 200]


def test_absolute_ramp_accelerates_away_from_zero_and_stops_there_for_one_scan():
    block = run("RAMP", accel_rate=400, decel_rate=300)
    assert scans(block, 3, input=-700) == [-400, -700, -700]
    assert scans(block, 5, input=500) == [-400, -100, 0, 400, 500]
    assert scans(block, 5, input=-500) == [200, 0, -400, -500, -500]


def test_a_rate_of_zero_holds_that_direction():
    block = run("RAMP", abs_ramp=False)
    assert scans(block, 2, input=100, accel_rate=0, decel_rate=10) == [0, 0]
    assert scans(block, 2, input=-100, accel_rate=0, decel_rate=10) == [-10, -20]
    assert scans(block, 2, input=-100, accel_rate=0, decel_rate=0) == [-20, -20]


def test_rates_are_magnitudes():
    block = run("RAMP", abs_ramp=False)
    assert scans(block, 2, input=1000, accel_rate=-400, decel_rate=-300) == [400, 800]
    assert scans(block, 2, input=0, accel_rate=-400, decel_rate=-300) == [500, 200]


def test_a_rate_of_minus_32768_counts_as_32768_and_rate_clamps():
    block = run("RAMP", abs_ramp=False, accel_rate=-32768, decel_rate=-32768)
    assert block.scan(input=-32768) == {"output": -32768, "rate": -32768}
    assert block.scan(input=32767) == {"output": 0, "rate": 32767}
    assert block.scan(input=32767) == {"output": 32767, "rate": 32767}


def test_scale_makes_the_rates_counts_per_second():
    """The manual's example: 100 scans per second, 500 counts/s move 5 counts per scan."""
    block = run("RAMP", accel_rate=500, scale=100)
    assert scans(block, 3, input=1000) == [5, 10, 15]
    assert block.scan(input=1000)["rate"] == 500
    assert scans(block, 96, input=1000)[-1] == 500


def test_output_truncates_toward_zero():
    block = run("RAMP", accel_rate=1, scale=3)
    assert scans(block, 4, input=5) == [0, 0, 1, 1]
    block = run("RAMP", accel_rate=1, scale=3)
    assert scans(block, 4, input=-5) == [0, 0, -1, -1]


@pytest.mark.parametrize(
    ("rate", "scale", "scans_to_move", "moved", "counts_per_second"),
    [(1, 32767, 32767, 1, 0.00554882), (32767, 1, 1, 32767, 5957636.4)],
)
def test_slowest_and_fastest_rate_at_5_5_ms(rate, scale, scans_to_move, moved, counts_per_second):
    block = run("RAMP", accel_rate=rate, scale=scale)
    outputs = scans(block, scans_to_move, input=32767)
    assert outputs[-1] == moved
    assert outputs[:-1] == [0] * (scans_to_move - 1)
    assert moved / (scans_to_move * 0.0055) == pytest.approx(counts_per_second, rel=1e-6)


def test_hold_keeps_the_fraction_and_shows_no_rate():
    block = run("RAMP", accel_rate=2, scale=4)
    assert block.scan(input=10) == {"output": 0, "rate": 2}
    assert block.scan(input=10, hold=True) == {"output": 0, "rate": 0}
    assert block.scan(input=10) == {"output": 1, "rate": 2}


def test_reset_wins_over_hold_and_the_ramp_goes_on_from_initial_value():
    block = run("RAMP", accel_rate=10, decel_rate=20)
    assert block.scan(input=500, reset=True, hold=True, initial_value=300) == {"output": 300, "rate": 0}
    assert block.scan(input=500, reset=True, hold=True, initial_value=-300) == {"output": -300, "rate": 0}
    assert block.scan(input=500, initial_value=300) == {"output": -280, "rate": 20}


def test_defaults_reach_any_value_within_two_scans():
    assert scans(run("RAMP"), 2, input=-32768) == [-32767, -32768]


def walk(register, target, absolute, accel, decel):
    """Move one register count at a time: an independent model of one scan."""
    direction = (target > register) - (target < register)
    toward_zero = register * direction < 0
    rate = (decel if toward_zero else accel) if absolute else (accel if direction > 0 else decel)
    for _ in range(abs(rate)):
        if register == target or (absolute and toward_zero and register == 0):
            break
        register += direction
    return register


small = st.integers(-40, 40)


@repeatable
@given(
    st.booleans(),
    st.integers(1, 7),
    st.lists(st.tuples(small, small, small, st.booleans(), st.booleans(), small), max_size=25),
)
def test_against_a_walk_count_by_count(absolute, scale, rows):
    block = run("RAMP", abs_ramp=absolute, scale=scale)
    register = 0
    for target, accel, decel, hold, reset, initial in rows:
        before = register
        if reset:
            register = initial * scale
        elif not hold:
            register = walk(register, target * scale, absolute, accel, decel)
        result = block.scan(
            input=target, accel_rate=accel, decel_rate=decel, hold=hold, reset=reset, initial_value=initial
        )
        assert block.state["register"] == register
        assert result == {"output": int(register / scale), "rate": 0 if reset else register - before}


@repeatable
@given(st.booleans(), st.integers(1, 32767), st.lists(st.tuples(int16, int16, int16), max_size=30))
def test_never_exceeds_its_rates_overshoots_or_leaves_its_ranges(absolute, scale, rows):
    block = run("RAMP", abs_ramp=absolute, scale=scale)
    before, shown = 0, 0
    for target, accel, decel in rows:
        result = block.scan(input=target, accel_rate=accel, decel_rate=decel)
        after = block.state["register"]
        toward_zero = abs(after) < abs(before)
        allowed = (decel if toward_zero else accel) if absolute else (accel if after > before else decel)
        assert abs(after - before) <= abs(allowed)
        assert min(before, target * scale) <= after <= max(before, target * scale)
        if absolute:
            assert before * after >= 0
        assert min(shown, target) <= result["output"] <= max(shown, target)
        assert -(2**31) <= after < 2**31
        assert result["rate"] == min(after - before, 32767)
        before, shown = after, result["output"]
