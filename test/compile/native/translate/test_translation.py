"""What is native and what is not, and why; what the translation takes for granted."""

from __future__ import annotations

import pytest

from automax_ros.blocks.declare.declaration import Platform
from automax_ros.compile.base.native_source import NotNative
from automax_ros.compile.native.translate.translation import translate
from compile.support import basic_task_of, compiled_of, lines


@pytest.mark.parametrize(
    ("statement", "reason", "line"),
    [
        ("PRINT A%", "PRINT", 30),
        ("S$ = STR$(A%)", "the string S$", 0),
        ('A% = LEN%("AB")', "a string", 30),
        ("SET GO", "SET of an event", 30),
    ],
)
def test_what_c_cannot_do_is_named_with_its_line(statement: str, reason: str, line: int) -> None:
    declare = "LOCAL A%, S$" if "$ =" in statement else "LOCAL A%"
    text = lines(statement, declare=declare)
    if "SET" in statement:
        text = "5 EVENT NAME=GO\n" + text
    with pytest.raises(NotNative) as refused:
        translate(compiled_of(text))
    assert (refused.value.reason, refused.value.line) == (reason, line)


def test_a_basic_task_is_not_native() -> None:
    task, _ = basic_task_of("10 LOCAL A%\n20 A% = 1\n30 END\n")
    with pytest.raises(NotNative, match="a BASIC task"):
        translate(task.compiled)


@pytest.mark.parametrize(
    "value",
    ["BIT_SET%(A%, B%)", "BIT_CLR%(A%, B%)", "SHIFTL%(A%, B%)", "SHIFTR%(A%, B%)", "ROTATEL%(A%, B%)"]
    + ["ROTATER%(A%, B%)", "A% ** B%", "A% / B%", "SGN(A%)", "ABS(A%)", "MIN(A%, B%)", "INT(R)"]
    + [f"INT({name}(R))" for name in ("SQRT", "SIN", "COS", "TAN", "ATN", "LN", "EXP", "R **")],
)
def test_what_computes_with_numbers_is_native(value: str) -> None:
    assert "static int scan(" in translate(compiled_of(lines(f"A% = {value}", declare="LOCAL A%, B%, R"))).text


@pytest.mark.parametrize("test", ["KA% > 3", "A% > KA%", "KX@", "A% / B% > 1", "T%(A%) = 2", "SQRT(R) > 1.0 AND KX@"])
def test_a_test_may_read_commons_and_elements_however_long_its_branches_are(test: str) -> None:
    text = lines(
        "9 COMMON KA%, KX@",
        f"30 IF {test} THEN", "40 A% = B% * 7", "50 ELSE", "60 A% = B% - 1", "70 END_IF", "80 B% = A%",
        declare="LOCAL A%, B%, R, T%(3)",
    )  # fmt: skip
    compiled = compiled_of("\n".join(sorted(text.splitlines(), key=lambda line: int(line.split()[0]))) + "\n")
    assert "static int scan(" in translate(compiled).text


def test_limits_are_those_of_types_and_of_what_scans_leave() -> None:
    text = lines(
        "CALL COUNTER(INPUT_PLUS=A%, INPUT_MINUS=B%, RESET=X@, OUTPUT=C%)",
        "CALL TRANSITION(INPUT=X@, OUTPUT=Y@)",
        declare="LOCAL A%, B%, C%, D!, R, X@, Y@",
    )
    compiled = compiled_of(text)
    limits = dict(zip((field.name for field in compiled.layout.fields), translate(compiled).limits, strict=True))
    assert limits["A%"] == (-32768, 32767)
    assert limits["D!"] == (-(2**31), 2**31 - 1)
    assert limits["X@"] == (0, 1)
    assert limits["R"] == (0, 0)  # any REAL
    assert limits["30 COUNTER.count"] == (-(2**31), 2**31 - 1)
    assert limits["40 TRANSITION.last"] == (0, 1)


def test_the_text_is_the_same_each_time_and_reads_as_the_scan() -> None:
    text = lines("CALL SUMMER(INPUT1=A%, INPUT2=B%, OUTPUT=C%)", "D! = A% * 1000 / 7", declare="LOCAL A%, B%, C%, D!")
    one, other = (translate(compiled_of(text)).text for _ in range(2))
    assert one == other
    assert "s->C_i = s->A_i + s->B_i;" in one
    assert "log_error(host, 30, 7001, ended);" in one


def test_a_udc_task_is_native() -> None:
    text = (
        "10 LOCAL A%, B%\n20 CALL SCAN_LOOP(TICKS=4)\n30 CALL LOW_PASS_FILTER(INPUT=A%, WLG=5.0, OUTPUT=B%)\n40 END\n"
    )
    assert "static int scan(" in translate(compiled_of(text, target=Platform.UDC)).text
