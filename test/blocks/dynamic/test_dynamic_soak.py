"""LAG, INTEGRATE, PID and RAMP in one compiled task, run for long on a periodic input: no drift, nothing unbounded."""

import math

import pytest
from compile.support import task_of
from soaking import in_soak

PERIOD = 1000
"""Scans of the input's period."""
TEXT = f"""\
10 LOCAL N%, SQUARE%, SAW%, SLOW%, SWING%, WHOLE%, HELD%, RAMPED%, DRIVE%, PLANT%, LOOP%, UP@, DOWN@, STOP@
15 LOCAL FREE%, FULL%, PS@, MS@
20 CALL SCAN_LOOP(TICKS=2)
30 N% = N% + 1
40 IF N% >= {PERIOD} THEN N% = 0
50 SQUARE% = 3000
60 IF N% >= {PERIOD // 2} THEN SQUARE% = -3000
70 SAW% = N% * 13 - 6000
80 STOP@ = N% > 600 AND N% < 650
100 CALL LAG(INPUT=SQUARE%, WLG=1.5, OUTPUT=SLOW%)
110 CALL INTEGRATE(INPUT=SAW%, KI=0.7, LIMIT_PLUS=2500, LIMIT_MINUS=-1800, HOLD_PLUS=STOP@, HOLD_MINUS=UP@, &
    SATURATED_PLUS=DOWN@, OUTPUT=HELD%)
120 CALL INTEGRATE(INPUT=SQUARE%, KI=0.1, OUTPUT=WHOLE%)
130 CALL RAMP(INPUT=SAW%, ACCEL_RATE=1234, DECEL_RATE=777, SCALE=91, OUTPUT=RAMPED%)
140 CALL PID(KP=0.4, KI=0.9, KD=0.05, LOOP_TIME=0.011, INPUT=SAW%, FEEDBACK=SLOW%, LIMIT_PLUS=4000, LIMIT_MINUS=-4000, &
    MAX_CHANGE=200, SATURATED_PLUS=PS@, SATURATED_MINUS=MS@, OUTPUT=DRIVE%)
150 CALL PID(KP=2.0, KI=9.0, LOOP_TIME=0.011, INPUT=SQUARE%, FEEDBACK=PLANT%, OUTPUT=LOOP%)
160 CALL LAG(INPUT=LOOP%, WLG=2.0, OUTPUT=PLANT%)
170 UP@ = N% > 100 AND N% < 120
999 END
"""
REPEATED = ("SLOW%", "HELD%", "RAMPED%", "DRIVE%")
"""Outputs that must repeat to the count: their blocks forget, or meet a limit in each period."""
NEAR = ("WHOLE%", "PLANT%")
"""A pure integrator of an input without a mean, and a closed loop whose roundings circle: within 2 counts."""


def shapes(task, first):
    """The outputs over one period, from a scan number on."""
    found = {name: [] for name in (*REPEATED, *NEAR)}
    for scan in range(first, first + PERIOD):
        task.scan(scan * task.period_ns)
        for name, values in found.items():
            values.append(task.value(name))
    return found


def bounded(task):
    """All numbers of the task are finite and no larger than a few times what 16 bits hold."""
    numbers = [value for value in task.snapshot() if isinstance(value, (int, float)) and not isinstance(value, bool)]
    assert len(numbers) > 20
    for value in numbers:
        assert math.isfinite(value)
        assert abs(value) < 91 * 32768 * 2
    assert not task.errors.entries


@pytest.mark.parametrize("scans", [20_000, in_soak(10_000_000, timeout_s=3600)])
def test_scans_do_not_drift(scans):
    task, _ = task_of(TEXT)
    task.run()
    for scan in range(1, 5 * PERIOD):
        task.scan(scan * task.period_ns)
    first = shapes(task, 5 * PERIOD)
    check_first(first)
    bounded(task)
    for scan in range(6 * PERIOD, scans - PERIOD):
        task.scan(scan * task.period_ns)
    last = shapes(task, scans - PERIOD)
    bounded(task)
    for name in REPEATED:
        assert last[name] == first[name]
    for name in NEAR:
        assert max(abs(a - b) for a, b in zip(first[name], last[name], strict=True)) <= 2


def check_first(shape):
    """The signals move, meet their limits and settle: without that, repeating would say nothing."""
    assert max(shape["HELD%"]) == 2500
    assert min(shape["HELD%"]) == -1800
    assert max(shape["DRIVE%"]) == 4000
    assert min(shape["DRIVE%"]) == -4000
    for name in (*REPEATED, *NEAR):
        assert max(shape[name]) - min(shape[name]) > 500
    half = PERIOD // 2
    settled = sorted({*shape["PLANT%"][half - 30 : half - 5], *shape["PLANT%"][-30:-5]})
    assert all(abs(abs(value) - 3000) <= 2 for value in settled)
    assert max(shape["SLOW%"]) >= 2990


STEADY = """\
10 LOCAL IN%, PULSE%, SLOW%, WHOLE%, RAMPED%, LOOP%, PLANT%, FIRST@, RISING@
20 CALL SCAN_LOOP(TICKS=2)
30 IN% = 1234
40 CALL LAG(INPUT=IN%, WLG=1.5, OUTPUT=SLOW%)
42 FIRST@ = SLOW% < 600
44 RISING@ = SLOW% > 700 AND SLOW% < 900
46 CALL SWITCH(INPUT1=111, INPUT2=0, SELECT=RISING@, OUTPUT=PULSE%)
50 CALL INTEGRATE(INPUT=PULSE%, KI=0.7, INITIAL_VALUE=77, RESET=FIRST@, OUTPUT=WHOLE%)
60 CALL RAMP(INPUT=IN%, ACCEL_RATE=50, OUTPUT=RAMPED%)
70 CALL PID(KP=2.0, KI=9.0, LOOP_TIME=0.011, INPUT=IN%, FEEDBACK=PLANT%, OUTPUT=LOOP%)
80 CALL LAG(INPUT=LOOP%, WLG=2.0, OUTPUT=PLANT%)
999 END
"""


WHOLE = 77 + 24
"""0.7 / 0.9918 x 111 / s (42.3) while SLOW% goes from 700 to 900, which takes ln(534 / 334) / 1.5 s."""


@pytest.mark.parametrize("scans", [20_000, in_soak(10_000_000, timeout_s=3600)])
def test_a_steady_task_stays_steady(scans):
    task, _ = task_of(STEADY)
    task.run()
    names = ("SLOW%", "WHOLE%", "RAMPED%", "PLANT%", "LOOP%")
    for scan in range(1, 3000):
        task.scan(scan * task.period_ns)
    steady = [task.value(name) for name in names]
    # The integrator holds what the pulse left on top of INITIAL_VALUE, with a fraction of a count.
    assert steady[:4] == [1234, WHOLE, 1234, 1234]
    assert not task.value("RISING@")
    seen = set()
    for scan in range(3000, scans):
        task.scan(scan * task.period_ns)
        if scan % 997 == 0 or scan >= scans - 100:
            seen.add(tuple(task.value(name) for name in names))
    assert seen == {tuple(steady)}
    bounded(task)
