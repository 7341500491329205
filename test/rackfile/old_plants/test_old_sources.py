"""Old sources made acceptable: each kind of change, and that converted tasks are the tasks they were."""

from __future__ import annotations

import re

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from automax_ros.blocks.catalogue import CATALOGUE
from automax_ros.core.diagnostics import SourceText
from automax_ros.language.checks.checker import check
from automax_ros.language.parse.parser import parse
from automax_ros.rackfile.old_plants.sources import convert

GOOD = """\
10 LOCAL OUT%, NOTE$:40, NAMES$:20(3), KP [CURRENT=1.5, HIGH=9.0]
15 ! The drive's `speed`: a remark, and "quotes
20 CALL SCAN_LOOP(TICKS=4)
25 rem lower case stays in remarks, but for their first word
30 CALL LAG(INPUT=OUT%, WLG=2.0, OUTPUT=OUT%)
40 CALL PROP_INT(INPUT=OUT%, KP=10.0, WLD=2.5, LIMIT_PLUS=4095, LIMIT_MINUS=-4095, RESET=TRUE, &
   INITIAL_VALUE=0, OUTPUT=OUT%)
50 NOTE$ = "Motor's	Tab and Ctrl"
60 IF OUT% > 3 THEN
70 OUT% = OUT% - 5
80 END_IF
90 END
"""


def diagnostics(text: str):
    return check(SourceText("TASK.BLK", text), name="TASK", catalogue=CATALOGUE).diagnostics


def converted(data: bytes | str):
    return convert(data.encode() if isinstance(data, str) else data, diagnostics)


@pytest.mark.parametrize(
    ("old", "new", "note"),
    [
        (b"10 END\r\n20 REM\r", "10 END\n20 REM\n", "2 line ends written as LF"),
        (b"10 END\n\x1a", "10 END\n", "Ctrl-Z and the 0 characters after it left out"),
        (b"10 END\n\x1a\0\0old text", "10 END\n", "Ctrl-Z and the 10 characters after it left out"),
        (b"10 A% = \x0c1\x00\n", "10 A% =  1 \n", "2 control characters"),
        (b"10 REM BELL\x07\n", "10 REM BELL \n", "1 control character"),
        (b"10\tA% = 1\n", "10      A% = 1\n", "1 tab"),
        (b"10 A%\t= 1\n", "10 A%   = 1\n", "1 tab"),
        (b"10 let a% = 0fh\n20 rem it is\n", "10 LET A% = 0FH\n20 REM it is\n", "2 lower-case lines"),
        (b"\xef\xbb\xbf10 END\n", "10 END\n", "byte order mark left out"),
        ("10 END\n".encode("utf-16"), "10 END\n", "UTF-16 written as UTF-8"),
        (b"10 LOCAL S$:300, T$:0(2)\n", "10 LOCAL S$:255, T$(2)\n", "2 string lengths"),
        (b"10 PRINT '" + b"x" * 133 + b"', 1\n", f"10 PRINT '{'x' * 132}'; 'x', 1\n", "1 text in parts"),
        (b"10 LET A$ = '" + b"x" * 133 + b"'\n", f"10 LET A$ = '{'x' * 133}'\n", None),
        (b'10 PRINT "a\tb\x07c"\n', '10 PRINT "a\tb c"\n', "1 control character"),
        (b"10 PRINT 'not closed\t\n", "10 PRINT 'not closed\t\n", None),
        (b"10 REM \xe4\xf6 Latin-1\n", "10 REM \xe4\xf6 Latin-1\n", None),
        (b"10 REM on and &\n  on\tand on\n20 end\n", "10 REM on and &\n  on    and on\n20 END\n", "1 tab"),
    ],
)  # fmt: skip
def test_each_kind_of_change(old, new, note):
    result = converted(old)
    assert result.after == new
    assert note is None or note in result.notes
    assert result.changed == (note is not None)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("WLG=2", "WLG=2.0"),
        ("WLG=2, WM=50", "WLG=2.0, WM=50.0"),
        ("WLG=+2", "WLG=+2.0"),
        ("WLG=1E1", "WLG=1.0E1"),
        ("WLG=2.", "WLG=2."),
        ("WLG=.5", "WLG=.5"),
    ],
)
def test_decimal_points_of_blocks(old, new):
    text = "10 LOCAL OUT%\n20 CALL SCAN_LOOP(TICKS=4)\n30 CALL LAG(INPUT=OUT%, {}, OUTPUT=OUT%)\n40 END\n"
    assert converted(text.format(old)).after == text.format(new)


def test_integers_of_blocks_stay():
    text = GOOD.replace("4095", "100")
    assert "LIMIT_PLUS=100," in converted(text).after


def test_latin_1_bytes_come_out_as_they_went_in():
    data = b"10 REM caf\xe9 \xff\r\n20 CALL SCAN_LOOP(TICKS=4)\r\n30 PRINT '\xe9'\r\n40 END\r\n"
    assert converted(data).data == data.replace(b"\r\n", b"\n")


def test_nothing_changes_in_a_good_task():
    text = GOOD.replace("rem", "REM")
    result = converted(text)
    assert (result.after, result.notes, result.changed) == (text, (), False)


SPACES = st.sampled_from([" ", "\t", " \t ", "\x00", " \x0c"])


@st.composite
def worn(draw) -> bytes:
    """The good task as an old plant may have it: every change is one that the conversion knows."""
    text = GOOD
    for literal in ("2.0", "10.0"):
        if draw(st.booleans()):
            text = text.replace(f"={literal},", f"={literal.partition('.')[0]},")
    rows = []
    for row in text.split("\n"):
        parts = re.split(r"(\".*|'.*|!.*|rem .*)", row, maxsplit=1)
        if draw(st.booleans()):
            parts[0] = parts[0].lower()
        parts[0] = re.sub(" ", lambda _: draw(SPACES), parts[0])
        rows.append("".join(parts))
    data = draw(st.sampled_from(["\n", "\r\n", "\r"])).join(rows).encode()
    return data + draw(st.sampled_from([b"", b"\x1a", b"\x1a\x1a\x00\x00 rest"]))


@given(worn())
@settings(max_examples=150, deadline=None, derandomize=True, database=None)
def test_a_worn_task_becomes_the_task_it_was(data):
    result = converted(data)
    assert diagnostics(result.after) == []
    assert parse(SourceText("", result.after))[0] == parse(SourceText("", GOOD))[0]
    again = converted(result.data)
    assert (again.data, again.notes) == (result.data, ())


@given(st.binary(max_size=200) | st.text(alphabet="1 2'\"!&\t\n\r\x00\x07\x1arem&REMa%=", max_size=80).map(str.encode))
@settings(max_examples=300, deadline=None, derandomize=True, database=None)
def test_whatever_the_bytes_conversion_is_final_and_keeps_lines(data):
    result = converted(data)
    assert result.after.count("\n") == result.before.count("\n")
    again = converted(result.data)
    assert again.data == result.data
