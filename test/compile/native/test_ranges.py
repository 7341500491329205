"""What the translation shows of values must hold: of what is not a number, of indices, and in a text of some length."""

from __future__ import annotations

import shutil

import pytest

from automax_ros.compile.native import NativeCache, native_form, translate

from ..support import compiled_of, lines
from .identity import assert_same

needs_gcc = pytest.mark.skipif(shutil.which("gcc") is None, reason="native code needs a C compiler")

NAN = f"{'*'.join(['BIG'] * 19)}*0.0"
"""An infinite REAL times 0: not a number, which MIN and MAX pass on if it stands first."""


def clamped(value: str) -> str:
    """An expression that looks as if it could only be ``value``."""
    return f"MAX(MIN({NAN}, {value}), {value})"


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
