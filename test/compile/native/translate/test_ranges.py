"""What the translation shows of values must hold: of what is not a number, of indices, and in a text of some length."""

from __future__ import annotations

import shutil

import pytest

from automax_ros.compile.base.native_source import NotNative
from automax_ros.compile.native.run.cache import NativeCache
from automax_ros.compile.native.run.task import native_form
from automax_ros.compile.native.translate.ranges import INFINITE, NumberKind, Range
from automax_ros.compile.native.translate.translation import translate
from compile.native.identity import assert_same
from compile.support import compiled_of, lines

needs_gcc = pytest.mark.skipif(shutil.which("gcc") is None, reason="native code needs a C compiler")

NAN = f"{'*'.join(['BIG'] * 19)}*0.0"
"""An infinite REAL times 0: not a number, which MIN and MAX pass on if it stands first."""


def clamped(value: str) -> str:
    """An expression that looks as if it could only be ``value``."""
    return f"MAX(MIN({NAN}, {value}), {value})"


@pytest.mark.parametrize("start", [-32768, -40, -1, 0, 1, 7])
@pytest.mark.parametrize("stop", [-32767, -30, -1, 0, 3, 32767])
@pytest.mark.parametrize("step", [-30000, -1, 1, 10000])
def test_a_loop_is_native_wherever_it_counts(start: int, stop: int, step: int) -> None:
    loop = (f"FOR A% = {start} TO {stop} STEP {step}", "D! = D! + A%", "NEXT A%")
    assert "static int scan(" in translate(compiled_of(lines(*loop, declare="LOCAL A%, D!"))).text


def test_a_loop_that_comes_to_no_end_is_given_up(monkeypatch) -> None:
    monkeypatch.setattr("automax_ros.compile.native.translate.ranges._reaching", lambda _, bound: bound)
    loop = ("FOR A% = -10 TO B%", "D! = D! + A%", "NEXT A%")
    with pytest.raises(NotNative, match="line 50: a loop in which a value has no bounds"):
        translate(compiled_of(lines(*loop, declare="LOCAL A%, B%, D!")))


@needs_gcc
def test_loops_from_below_zero_take_the_turns_that_they_take_in_python(tmp_path) -> None:
    loops = [
        (-10, -1, 1),
        (-10, 10, 3),
        (-32768, 32767, 10000),
        (-1, -32768, -10000),
        (-5, -5, 1),
        (5, -5, -3),
        (-3, -9, 1),
    ]
    statements = []
    for number, (start, stop, step) in enumerate(loops):
        statements += [f"FOR A% = {start} TO {stop} STEP {step}", f"S!({number}) = S!({number}) + A%", "NEXT A%"]
    compiled = compiled_of(lines(*statements, declare="LOCAL A%, S!(9)"))
    native = native_form(compiled, NativeCache(tmp_path / "cache"))
    assert_same(native, 2, 3)
    state = compiled.layout.fresh()
    assert native.columns(state, [], 1).done == 1
    assert state[1][:7] == [-55, -7, -19376, -60004, -5, 2, 0]


@pytest.mark.parametrize("kind", [NumberKind.INT, NumberKind.REAL])
def test_a_range_that_is_widened_holds_both_and_comes_to_an_end(kind: NumberKind) -> None:
    bounds = [
        sign * value for value in (0, 0.5, 1, 9, 32767, 32768, 40000, 2**31, 2**60, 1e200, INFINITE) for sign in (-1, 1)
    ]
    bounds = sorted(bound for bound in bounds if kind is NumberKind.REAL or bound % 1 != 0.5)
    ranges = [Range(kind, low, high) for low in bounds for high in bounds if low <= high]
    for first in ranges:
        for second in ranges:
            wider = first.widened(second)
            assert wider.holds(first)
            assert wider.holds(second)
    present = Range(kind, -9, -9)
    steps = 0
    while present.high < INFINITE:
        present, before = present.widened(Range(kind, -9, present.high + abs(present.high) / 2 + 1)), present
        assert present.high > before.high
        steps += 1
    assert steps <= 20


@needs_gcc
@pytest.mark.parametrize(
    "test",
    [
        f"I% < {clamped('1.0')} OR I% > {clamped('4.0')}",
        f"I% < {clamped('1.0')} OR {clamped('4.0')} < I%",
        f"NOT (I% >= 0 AND I% <= MIN(100.0, {clamped('4.0')}))",
        f"NOT (I% <= 4 AND I% >= MAX(-100.0, {clamped('0.0')}))",
    ],
)
def test_a_comparison_with_what_is_not_a_number_tells_nothing_of_the_other(test: str, tmp_path) -> None:
    text = lines(
        "BIG = 9.0E18",
        f"IF {test} THEN",
        "B% = 0",
        "ELSE",
        "T%(I%) = 7",
        "END_IF",
        declare="LOCAL T%(5), BIG, I%, B%, AFTER%(5)",
    )
    assert_same(native_form(compiled_of(text), NativeCache(tmp_path / "cache")), 300, 1)


@pytest.mark.parametrize(
    "statement",
    [
        "B% = MIN(" + ", ".join(f"A% + {number}" for number in range(16)) + ")",
        "B% = " + "MAX(" * 30 + "A% + 1" + ", B%)" * 30,
        "B% = " + "ABS(" * 30 + "A% + 1" + ")" * 30,
        "R = " + "MIN(" * 30 + "R + 1.0" + ", A%)" * 30,
    ],
)
def test_a_text_grows_with_its_task_alone(statement: str) -> None:
    declare = "LOCAL A%, B%, R"
    short = translate(compiled_of(lines("B% = A%", declare=declare))).text
    assert len(translate(compiled_of(lines(statement, declare=declare))).text) < len(short) + 20 * len(statement)


def test_an_index_is_asked_for_when_it_runs_unless_it_is_a_literal() -> None:
    text = translate(compiled_of(lines("T%(A% AND 3) = T%(2)", declare="LOCAL A%, T%(5)"))).text
    assert [line.strip() for line in text.splitlines() if "s->T_i" in line] == [
        "t1 = s->T_i[2];",
        "s->T_i[held(t2, 0, 5, ended)] = t1;",
    ]
