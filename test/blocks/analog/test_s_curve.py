"""S_CURVE: laws of any motion (section 26 and its decisions), its times (note 6), and RAMP as the borderline case."""

from math import sqrt

import pytest
from hypothesis import given
from hypothesis import strategies as st

from blocks.support import int16, repeatable, run

CLAMPED = 7001
LOW, HIGH = -32768, 32767


class Watched:
    """A block whose every scan is held against the laws; ``rate`` is the last move of the register."""

    def __init__(self, scale=1):
        self.block = run("S_CURVE", scale=scale)
        self.scale = scale
        self.register = 0
        self.rate = 0

    def scan(self, **row):
        before, rate_before = self.register, self.rate
        result = self.block.scan(**row)
        self.register = self.block.state["register"]
        self.rate = self.register - before
        end = self._end_beyond(before + braked(rate_before, row)) if not row["reset"] else None
        assert LOW * self.scale <= self.register <= HIGH * self.scale
        assert result["output"] == int(self.register / self.scale)
        if end is not None:
            assert self.register == end
            self.rate = 0
            return result
        assert self.block.error == 0
        if row["reset"]:
            assert self.register == row["initial_value"] * self.scale
            self.rate = 0
        else:
            check_motion(rate_before, self.rate, row)
        assert result["rate"] == min(self.rate, HIGH)
        return result

    def _end_beyond(self, place):
        """The end of the range that a register would pass, None where it stays inside."""
        low, high = LOW * self.scale, HIGH * self.scale
        return low if place < low else high if place > high else None


def braked(rate, row):
    """The least rate after this one."""
    least = max(0, abs(rate) - abs(row["jerk_rate"]))
    return 0 if is_ramp(row) else least if rate > 0 else -least


def is_ramp(row):
    return abs(row["jerk_rate"]) >= max(abs(row["accel_rate"]), abs(row["decel_rate"]))


def limits(row):
    """Rate limits of row: upward, downward."""
    up, down = abs(row["accel_rate"]), abs(row["decel_rate"])
    return (down, up) if row["reverse"] else (up, down)


def check_motion(before, after, row):
    jerk = abs(row["jerk_rate"])
    up, down = limits(row)
    if is_ramp(row):
        assert -down <= after <= up
        assert not (row["hold"] and after)
        return
    assert abs(after - before) <= jerk
    if not -down <= after <= up:
        assert before * after > 0
        assert abs(after) == abs(before) - jerk
    if row["hold"]:
        assert before * after >= 0
        assert abs(after) == max(0, abs(before) - jerk)


def at(block, start):
    """Put a block at rest at a value."""
    block.scan(input=start, reset=True, initial_value=start)
    return block


def row_of(**given):
    """All inputs of a scan."""
    defaults = {"input": 0, "reset": False, "initial_value": 0, "hold": False, "reverse": False}
    return {**defaults, "accel_rate": 100, "decel_rate": 100, "jerk_rate": 10, **given}


def moves(block, count, **row):
    """The outputs and rates of some scans."""
    results = [block.scan(**row) for _ in range(count)]
    return [result["output"] for result in results], [result["rate"] for result in results]


counts = st.integers(-60, 60) | st.integers(-2000, 2000) | int16
rates = st.integers(-30, 30) | st.integers(-600, 600) | int16
often = st.booleans()
seldom = st.integers(0, 9).map(lambda number: number == 0)
scales = st.sampled_from([1, 1, 2, 7, 100]) | st.integers(1, 32767)
lengths = st.integers(1, 3) | st.integers(1, 30)


def profiles(**fixed):
    """Stretches of scans (length, inputs): each input another one from stretch to stretch, or as ``fixed``."""
    drawn = {
        "input": counts,
        "accel_rate": rates,
        "decel_rate": rates,
        "jerk_rate": rates,
        "initial_value": counts,
        "reverse": often,
        "hold": seldom,
        "reset": seldom,
        **{name: st.just(value) for name, value in fixed.items()},
    }
    return st.lists(st.tuples(lengths, st.fixed_dictionaries(drawn)), max_size=8)


def duration(distance, rate, jerk):
    """Scans from rest to rest: the two equations of note 6."""
    if distance >= rate * rate / jerk:
        return distance / rate + rate / jerk
    return 2 * sqrt(distance / jerk)


def stopping_distance(rate, jerk):
    """How far a rate still carries that falls by the jerk rate every scan."""
    full = abs(rate) // jerk
    return full * abs(rate) - jerk * full * (full + 1) // 2


def test_a_profile_that_fits_exactly():
    """Accel 20, jerk 5, over 100 counts: no other profile of eight scans keeps the jerk rate."""
    outputs, speeds = moves(run("S_CURVE", accel_rate=20, jerk_rate=5), 10, input=100)
    assert speeds == [5, 10, 15, 20, 20, 15, 10, 5, 0, 0]
    assert outputs == [5, 15, 30, 50, 70, 85, 95, 100, 100, 100]


def test_decel_rate_is_the_limit_downward_whatever_the_sign():
    block = at(run("S_CURVE"), 50)
    outputs, speeds = moves(block, 10, input=-50, accel_rate=7, decel_rate=20, jerk_rate=5)
    assert speeds == [-5, -10, -15, -20, -20, -15, -10, -5, 0, 0]
    assert outputs[-1] == -50
    assert max(moves(block, 40, input=50, accel_rate=7, decel_rate=20, jerk_rate=5)[1]) == 7


def test_reverse_exchanges_the_two_limits():
    given = {"accel_rate": 20, "decel_rate": 4, "jerk_rate": 2}
    assert max(moves(run("S_CURVE"), 60, input=200, reverse=True, **given)[1]) == 4
    assert min(moves(run("S_CURVE"), 60, input=-200, reverse=True, **given)[1]) == -20
    assert min(moves(run("S_CURVE"), 60, input=-200, reverse=False, **given)[1]) == -4


@pytest.mark.parametrize(
    ("jerk", "moved"), [(-32768, [32768, 32768]), (32767, [32767, 32768]), (16384, [16384, 32768])]
)
def test_rates_of_minus_32768_count_as_32768(jerk, moved):
    block = run("S_CURVE", scale=100, accel_rate=-32768, decel_rate=-32768, jerk_rate=jerk)
    found = []
    for _ in moved:
        before = block.state["register"]
        assert block.scan(input=32767)["rate"] == min(block.state["register"] - before, 32767)
        found.append(block.state["register"] - before)
    assert found == moved


def test_a_jerk_of_minus_32768_counts_as_32768():
    """The rates are as large, so this is RAMP: no scan is lost on the way to the rate."""
    assert moves(run("S_CURVE", accel_rate=-32768, jerk_rate=-32768), 2, input=32767)[0] == [32767, 32767]


@pytest.mark.parametrize(("target", "stands"), [(100, 0), (-100, -100)])
def test_an_accel_rate_of_zero_permits_no_move_upward(target, stands):
    block = run("S_CURVE", accel_rate=0, decel_rate=10, jerk_rate=3)
    assert moves(block, 40, input=target)[0][-1] == stands


def test_a_limit_lowered_in_motion_is_reached_at_the_jerk_rate():
    block = run("S_CURVE", jerk_rate=10)
    assert moves(block, 5, input=30000, accel_rate=50)[1] == [10, 20, 30, 40, 50]
    assert moves(block, 4, input=30000, accel_rate=25)[1] == [40, 30, 25, 25]
    assert moves(block, 4, input=30000, accel_rate=0)[1] == [15, 5, 0, 0]


def test_scale_makes_rates_and_jerk_counts_per_second():
    """As in the manual's example: 100 scans per second, 500 counts/s move 5 counts per scan."""
    block = run("S_CURVE", scale=100, accel_rate=500, jerk_rate=250)
    outputs, speeds = moves(block, 5, input=1000)
    assert speeds == [250, 500, 500, 500, 500]
    assert outputs == [2, 7, 12, 17, 22]


def test_hold_takes_the_rate_to_zero_at_the_jerk_rate_and_keeps_the_output_there():
    block = run("S_CURVE", accel_rate=30, jerk_rate=10)
    assert moves(block, 4, input=500)[0] == [10, 30, 60, 90]
    assert moves(block, 5, input=500, hold=True) == ([110, 120, 120, 120, 120], [20, 10, 0, 0, 0])
    assert moves(block, 3, input=500) == ([130, 150, 180], [10, 20, 30])


def test_reset_shows_initial_value_at_once_and_the_block_goes_on_from_there_at_rest():
    block = run("S_CURVE", accel_rate=30, jerk_rate=10)
    moves(block, 6, input=5000)
    assert block.scan(input=5000, reset=True, hold=True, initial_value=-200) == {"output": -200, "rate": 0}
    assert block.scan(input=5000, reset=True, initial_value=300) == {"output": 300, "rate": 0}
    assert moves(block, 3, input=5000, initial_value=300) == ([310, 330, 360], [10, 20, 30])


def test_a_jerk_of_zero_keeps_the_rate_past_the_input_up_to_the_end_of_the_range():
    assert moves(run("S_CURVE", jerk_rate=0), 3, input=100)[0] == [0, 0, 0]
    block = at(run("S_CURVE", accel_rate=3000), 0)
    assert moves(block, 2, input=20000, jerk_rate=1500)[1] == [1500, 3000]
    outputs, speeds = moves(block, 9, input=20000, jerk_rate=0)
    assert speeds == [3000] * 9
    assert outputs[-1] == 31500
    assert block.scan(input=20000, jerk_rate=0, hold=True)["output"] == 32767
    assert block.scan(input=20000, jerk_rate=0) == {"output": 32767, "rate": 0}


def at_the_end(sign):
    """A block that the jerk rate does not stop inside the range, and its output in the scan that reaches the end."""
    block = at(run("S_CURVE", accel_rate=2000, decel_rate=2000), sign * 10000)
    assert moves(block, 4, input=sign * 32000, jerk_rate=500)[1] == [sign * speed for speed in (500, 1000, 1500, 2000)]
    for _ in range(9):
        result = block.scan(input=sign * 32000, jerk_rate=10)
        assert block.error == 0
    assert result == {"output": sign * (15000 + 1990 * 9 - 10 * 36), "rate": sign * 1910}
    return block, block.scan(input=sign * 32000, jerk_rate=10)


@pytest.mark.parametrize(("sign", "end"), [(1, HIGH), (-1, LOW)])
def test_at_the_end_of_the_range_the_block_stops_and_returns_from_rest(sign, end):
    block, result = at_the_end(sign)
    assert result["output"] == end
    assert moves(block, 2, input=sign * 32000, jerk_rate=10)[1] == [-10 * sign, -20 * sign]


@pytest.mark.parametrize("sign", [1, -1])
def test_the_clamp_at_the_end_of_the_range_is_logged_once(sign):
    """Note 5: the output is clamped, and an error will be logged."""
    block, _ = at_the_end(sign)
    assert block.error == CLAMPED
    block.scan(input=sign * 32000, jerk_rate=10)
    assert block.error == 0


@pytest.mark.parametrize("sign", [1, -1])
def test_the_rate_is_zero_at_the_end_of_the_range(sign):
    """Note 5: the RATE will be set to zero."""
    assert at_the_end(sign)[1]["rate"] == 0


def test_lowering_the_jerk_in_motion_overshoots_by_no_more_than_the_new_jerk_enforces():
    watched = Watched()
    row = row_of(input=1000, jerk_rate=50)
    for _ in range(6):
        watched.scan(**row)
    assert (watched.register, watched.rate) == (550, 100)
    row["jerk_rate"] = 2
    peak = 550 + stopping_distance(100, 2)
    outputs = [watched.scan(**row)["output"] for _ in range(300)]
    assert max(outputs) == outputs[49] == peak == 3000
    assert outputs == [*sorted(outputs[:50]), *sorted(outputs[50:], reverse=True)]
    assert outputs[-1] == 1000


@repeatable
@given(scales, profiles())
def test_laws_of_any_motion(scale, profile):
    watched = Watched(scale)
    for length, row in profile:
        for _ in range(length):
            watched.scan(**row)


@repeatable
@given(scales, counts, counts, rates, st.data())
def test_no_overshoot_from_rest_while_input_and_jerk_are_constant(scale, start, target, jerk, data):
    profile = data.draw(profiles(input=target, jerk_rate=jerk, reset=False))
    block = at(run("S_CURVE", scale=scale), start)
    before = start * scale
    for length, row in profile:
        for _ in range(length):
            block.scan(**row)
            after = block.state["register"]
            assert min(before, target * scale) <= after <= max(before, target * scale)
            before = after


@repeatable
@given(scales, rates, st.data())
def test_never_beyond_the_range_while_the_jerk_is_constant(scale, jerk, data):
    watched = Watched(scale)
    for length, row in data.draw(profiles(jerk_rate=jerk)):
        for _ in range(length):
            braking = watched.register + braked(watched.rate, row)
            assert row["reset"] or LOW * scale <= braking <= HIGH * scale
            watched.scan(**row)


@repeatable
@given(profiles(), counts, st.integers(1, 32767), st.integers(1, 32767), st.integers(1, 32767), st.booleans())
def test_ends_on_input_in_time_and_stays_from_any_motion(profile, target, accel, decel, jerk, reverse):
    """At worst the block stops first, then moves by note 6 with the lower rate; turning through zero is faster."""
    watched = Watched()
    for length, row in profile:
        for _ in range(length):
            watched.scan(**row)
    speed = watched.rate
    stand = watched.register + (1 if speed > 0 else -1) * stopping_distance(speed, jerk)
    rate = min(accel, decel)
    moving = max(duration(abs(target - place), rate, jerk) for place in (stand, watched.register))
    scans = int(abs(speed) / jerk + moving) + 3
    if scans > 500:
        return
    row = row_of(input=target, accel_rate=accel, decel_rate=decel, jerk_rate=jerk, reverse=reverse)
    for _ in range(scans):
        watched.scan(**row)
    assert [watched.scan(**row) for _ in range(3)] == [{"output": target, "rate": 0}] * 3


def scans_to(start, target, rate, jerk, scale=1):
    """Number of scans from rest until the register is INPUT x SCALE; the other direction has a small limit."""
    up, down = (rate, 3) if target > start else (3, rate)
    block = at(run("S_CURVE", scale=scale, accel_rate=up, decel_rate=down, jerk_rate=jerk), start)
    scans = 0
    while block.state["register"] != target * scale:
        block.scan(input=target)
        scans += 1
        assert scans < 1_000_000
    assert block.scan(input=target)["output"] == target
    assert block.scan(input=target) == {"output": target, "rate": 0}
    return scans


EXAMPLES = [(1000, 100, 10), (1000, 10, 1), (999, 100, 9), (65535, 1000, 7), (65535, 32767, 1), (37, 13, 5), (3, 2, 1)]


@pytest.mark.parametrize(
    ("distance", "rate", "jerk"), [*EXAMPLES, (1, 1, 1), (60000, 30000, 20000), (500, 32767, 30000)]
)
@pytest.mark.parametrize("upward", [True, False])
def test_times_of_note_6(distance, rate, jerk, upward):
    ends = (-32768, distance - 32768) if upward else (32767, 32767 - distance)
    assert abs(scans_to(*ends, rate, jerk) - duration(distance, rate, jerk)) <= 2


sizes = st.integers(1, 40) | st.integers(1, 1500) | st.integers(1, 32767)


@repeatable
@given(int16, int16, sizes, sizes)
def test_times_of_note_6_for_any_move(start, target, rate, jerk):
    expected = duration(abs(target - start), rate, jerk)
    if start != target and expected < 1000:
        assert abs(scans_to(start, target, rate, jerk) - expected) <= 2


@repeatable
@given(counts, counts, sizes, sizes, st.integers(1, 50))
def test_from_rest_the_rate_rises_once_and_falls_once(start, target, rate, jerk, scale):
    """Up at the jerk rate to the limit, which is kept, then down; rising again would be a step too early down."""
    if duration(abs(target - start) * scale, rate, jerk) > 500:
        return
    block = at(run("S_CURVE", scale=scale, accel_rate=rate, decel_rate=rate, jerk_rate=jerk), start)
    speeds = [0]
    while block.state["register"] != target * scale:
        speeds.append(abs(block.scan(input=target)["rate"]))
    top = speeds.index(max(speeds))
    assert speeds == [*sorted(speeds[:top]), *sorted(speeds[top:], reverse=True)]


@pytest.mark.soak
@pytest.mark.parametrize("scale", [1, 2, 100, 181, 32767])
@pytest.mark.parametrize("jerk", [1, 2, 3, 10, 97, 1000, 10007, 32767])
def test_times_of_note_6_over_a_wide_grid(jerk, scale):
    for rate in (1, 2, 5, 10, 31, 100, 317, 1000, 3163, 10000, 32767):
        for start, target in ((0, 1), (1, 0), (-5, 5), (100, -100), (0, 1000), (-3000, 4001), (32767, -32768)):
            expected = duration(abs(target - start) * scale, rate, jerk)
            if expected < 20_000:
                assert abs(scans_to(start, target, rate, jerk, scale) - expected) <= 2, (start, target, rate)


@repeatable
@given(scales, profiles())
def test_equals_the_algebraic_ramp_where_the_jerk_is_as_large_as_both_rates(scale, profile):
    curve, ramp = run("S_CURVE", scale=scale), run("RAMP", scale=scale, abs_ramp=False)
    for length, drawn in profile:
        up, down = limits(drawn)
        row = {**drawn, "jerk_rate": -max(up, down) if max(up, down) == 32768 else max(up, down)}
        for _ in range(length):
            shown = curve.scan(**row)
            assert shown == ramp.scan(
                **{name: row[name] for name in ("input", "reset", "initial_value", "hold")},
                accel_rate=up,
                decel_rate=down,
            )
            assert curve.state["register"] == ramp.state["register"]
            assert curve.error == 0


@repeatable
@given(profiles())
def test_reverse_is_the_other_rate_in_each_place(profile):
    reversing, plain = run("S_CURVE"), run("S_CURVE")
    for length, row in profile:
        up, down = row["accel_rate"], row["decel_rate"]
        exchanged = {**row, "accel_rate": down, "decel_rate": up} if row["reverse"] else row
        for _ in range(length):
            assert reversing.scan(**row) == plain.scan(**{**exchanged, "reverse": False})
