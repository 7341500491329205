"""`automax compare pulse`: its report, its table, exit codes, and everything that can be wrong with its input."""

import contextlib
import io
import json
import re
import shlex
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from automax_ros.blocks.catalogue import CATALOGUE
from automax_ros.blocks.declare.instance import Instance
from automax_ros.cli.main import main
from automax_ros.cli.tasks import compare_pulse
from automax_ros.logix.pmul import PulseMultiplier
from cli.support import columns_of, table_of

PAGE = Path(__file__).parents[3] / "docs" / "logix.md"
QUARTERS = "POSITION%\n0\n1\n2\n3\n4\n5\n"
TURNING = "POSITION%\n0\n768\n1536\n-1792\n-1024\n-256\n512\n"


def compared(automax, table, *options):
    return automax("compare", "pulse", "--input", automax.write("IN.csv", table), *options)


def session():
    """The commands of the page's session with what they print."""
    text = re.search(r"```console\n(\$ .*?)```", PAGE.read_text(encoding="utf-8"), re.S)[1]
    parts = re.split(r"^\$ (.*)\n", text, flags=re.M)[1:]
    return list(zip(parts[::2], parts[1::2], strict=True))


def test_session_of_the_page_prints_what_it_shows(automax):
    codes = []
    for command, shown in session():
        program, *arguments = shlex.split(command)
        if program == "cat":
            automax.write(arguments[0], shown)
            continue
        assert program == "automax"
        result = automax(*arguments)
        assert (result.out, result.err) == (shown, "")
        codes.append(result.code)
    assert codes == [0, 1]


def test_python_of_the_page_prints_what_it_says(capsys):
    text = PAGE.read_text(encoding="utf-8")
    exec(compile(re.search(r"```python\n(.*?)```", text, re.S)[1], str(PAGE), "exec"), {})
    last = re.search(r"# the last line: (.*)", text)[1]
    assert capsys.readouterr().out.splitlines()[-1] == last


def test_page_has_every_option(automax):
    options = re.findall(r"^\| `(--[\w-]+)", PAGE.read_text(encoding="utf-8"), re.M)
    assert sorted(options) == sorted(
        set(re.findall(r"--[a-z-]+", automax("compare", "pulse", "--help").out)) - {"--help"}
    )


def test_report_without_a_difference(automax):
    result = compared(automax, QUARTERS, "--word-size", "12", "--multiplier", "8192")
    assert (result.code, result.err) == (0, "")
    assert result.out == (
        "PULSE_MULT  WORD_SIZE=12, MULTIPLIER=8192\n"
        "PMUL        Mode=1, WordSize=12, Multiplier=25000\n"
        "ratio       8192/32768 = 25000/100000 exactly\n"
        "\n"
        "6 scans of POSITION% compared: no output differs\n"
        "\n"
        "                  scan  PULSE_MULT  PMUL  difference\n"
        "total at the end     6           1     1           0\n"
    )


def test_report_of_absolute_mode_with_a_reset_and_one_difference(automax):
    """32768 counts at once are one more than an INTEGER holds; the reset comes before PULSE_MULT gives it out."""
    table = "COUNTS%,CLEAR@\n-32768,0\n5,1\n"
    result = compared(automax, table, "--reset", "clear@", "--multiplier", "-32768", "--initial-value", "-3")
    assert (result.code, result.err) == (1, "")
    assert result.out == (
        "PULSE_MULT  WORD_SIZE=0, MULTIPLIER=-32768, INITIAL_VALUE=-3\n"
        "PMUL        Mode=0, Multiplier=-100000, InitialValue=-3\n"
        "ratio       -32768/32768 = -100000/100000 exactly\n"
        "\n"
        "2 scans of COUNTS% compared: 1 output differs\n"
        "\n"
        "                                  scan  PULSE_MULT   PMUL  difference\n"
        "first output that differs            1       32767  32768          +1\n"
        "greatest difference in one scan      1       32767  32768          +1\n"
        "first total that differs             1       32767  32768          +1\n"
        "greatest difference of the total     1       32767  32768          +1\n"
        "total at the end                     2       32767  32768          +1\n"
    )


def test_json(automax):
    result = compared(automax, TURNING, "--word-size", "12", "--multiplier", "12000", "--json")
    assert (result.code, result.err) == (1, "")
    output = {"scan": 5, "pulse_mult": 282, "pmul": 281, "difference": -1}
    total = {"scan": 5, "pulse_mult": 1125, "pmul": 1124, "difference": -1}
    assert json.loads(result.out) == {
        "input": "IN.csv",
        "column": "POSITION%",
        "reset": None,
        "pulse_mult": {"WORD_SIZE": 12, "MULTIPLIER": 12000, "INITIAL_VALUE": 0},
        "pmul": {"Mode": True, "WordSize": 12, "Multiplier": 36621, "InitialValue": 0},
        "error_per_million": -0.9375,
        "scans": 7,
        "differing": 2,
        "first_output_difference": output,
        "greatest_output_difference": output,
        "first_total_difference": total,
        "greatest_total_difference": total,
        "total": {"scan": 7, "pulse_mult": 1687, "pmul": 1687, "difference": 0},
    }


def test_json_has_the_same_keys_without_a_difference(automax):
    same = compared(automax, QUARTERS, "--json")
    other = compared(automax, TURNING, "--word-size", "12", "--multiplier", "12000", "--json")
    assert same.code == 0
    first, second = json.loads(same.out), json.loads(other.out)
    assert list(first) == list(second)
    assert first["first_output_difference"] is first["greatest_total_difference"] is None


def test_left_out_parameters_are_those_of_the_block(automax):
    record = json.loads(compared(automax, QUARTERS, "--json").out)
    assert record["pulse_mult"] == {"WORD_SIZE": 0, "MULTIPLIER": 32768, "INITIAL_VALUE": 0}
    assert record["pmul"] == {"Mode": False, "WordSize": 14, "Multiplier": 100000, "InitialValue": 0}
    assert "MULTIPLIER left out" in compared(automax, QUARTERS).out


def test_output_has_both_outputs_and_totals_of_every_scan(automax):
    rows = [(0, 0), (768, 0), (1536, 1), (-1792, 1), (-1024, 0), (-256, 0), (512, 0), (1280, 0), (2040, 0)]
    table = "SPEED%,POSITION%,CLEAR@\n" + "".join(f"x,{value},{reset}\n" for value, reset in rows)
    options = ("--column", "position%", "--reset", "CLEAR@", "--word-size", "12", "--multiplier", "12000")
    result = compared(automax, table, *options, "--initial-value", "-1500", "--output", "OUT.csv")
    text = (automax.folder / "OUT.csv").read_text()
    header, *cells = table_of(text)
    assert header[:6] == ["scan", "feedback", "reset", "pulse_mult", "pmul", "difference"]
    assert header[6:] == ["pulse_mult_total", "pmul_total", "total_difference"]
    block = Instance(CATALOGUE["PULSE_MULT"], 5_500_000, word_size=12, multiplier=12000, initial_value=-1500)
    tag = PulseMultiplier(WordSize=12, Multiplier=36621, InitialValue=-1500)
    totals = [0, 0]
    for number, ((tag.In, tag.Initialize), row) in enumerate(zip(rows, cells, strict=True), start=1):
        tag.scan()
        pair = [block.scan(input=tag.In, reset=bool(tag.Initialize))["output"], int(tag.Out)]
        totals = [total + value for total, value in zip(totals, pair, strict=True)]
        expected = [number, tag.In, tag.Initialize, *pair, pair[1] - pair[0], *totals, totals[1] - totals[0]]
        assert [int(cell) for cell in row] == expected
    assert result.code == any(int(row[5]) for row in cells)
    assert columns_of(text)["pulse_mult"][4] == "174"  # 476 counts from INITIAL_VALUE


def test_trace_and_compare_fit_together(automax):
    """The output of a trace has columns that are not feedback, and times."""
    task = (
        "10 COMMON STEP%, POSITION%\n20 CALL SCAN_LOOP(TICKS=1)\n"
        "30 CALL SUMMER(INPUT1=POSITION%, INPUT2=STEP%, OUTPUT=POSITION%)\n40 END\n"
    )
    automax.trace("STEP%\n" + "100\n" * 20, "--output", "TRACED.csv", task=task)
    result = automax("compare", "pulse", "--input", "TRACED.csv", "--column", "POSITION%", "--word-size", "16")
    assert result.code == 0
    assert "20 scans of POSITION% compared" in result.out
    assert "total at the end    20        1900  1900" in result.out


def test_empty_cells_repeat_the_row_before(automax):
    """At first 0 and no reset; spreadsheets write 5.0 next to empty cells."""
    table = b"\xef\xbb\xbf POSITION% ,CLEAR@\r\n,\r\n5.0,\r\n,1.0\r\n,\r\n8,OFF\r\n\r\n"
    compared(automax, table, "--column", "POSITION%", "--reset", "CLEAR@", "--word-size", "12", "--output", "OUT.csv")
    columns = columns_of((automax.folder / "OUT.csv").read_text())
    assert columns["feedback"] == ["0", "5", "5", "5", "8"]
    assert columns["reset"] == ["0", "0", "1", "1", "0"]
    assert columns["pulse_mult"] == columns["pmul"] == ["0", "5", "0", "0", "8"]


def test_column_beside_the_reset_needs_no_name(automax):
    result = compared(automax, "CLEAR@,POSITION%\n0,1\n", "--reset", "CLEAR@")
    assert result.code == 0
    assert "1 scan of POSITION% compared" in result.out


@pytest.mark.parametrize(
    ("table", "options", "message"),
    [
        (QUARTERS, ["--word-size", "1"], "WORD_SIZE 1 has no equivalent: PMUL's WordSize is at least 2"),
        (QUARTERS, ["--word-size", "17"], "WORD_SIZE lies between 0 and 16, 17 does not"),
        (QUARTERS, ["--word-size", "x"], "--word-size: 'x' is not a whole number"),
        (QUARTERS, ["--word-size", "9" * 5000], "--word-size: '99999"),
        (QUARTERS, ["--multiplier", "32768"], "a gain of exactly 1 is MULTIPLIER left out"),
        (QUARTERS, ["--multiplier", "-32769"], "MULTIPLIER is an INTEGER, -32768 to 32767, -32769 is not"),
        (QUARTERS, ["--multiplier", "0.25"], "--multiplier: '0.25' is not a whole number"),
        (QUARTERS, ["--initial-value", "5"], "name the column of resets: --reset"),
        (QUARTERS, ["--reset", "POSITION%"], "--reset has the only one"),
        (QUARTERS, ["--reset", "POSITION%", "--column", "POSITION%"], "--column and --reset are the same column"),
        (QUARTERS, ["--column", "POSITON%"], "has no column 'POSITON%'\n  hint: did you mean POSITION%?"),
        (QUARTERS, ["--reset", "Q"], "--reset: IN.csv has no column 'Q'\n  hint: there is POSITION%"),
        ("A%,B%\n1,2\n", [], "which column of IN.csv is the feedback?\n  hint: name one of A%, B% with --column"),
        (",".join(f"C{n}%" for n in range(99)) + "\n", ["--column", "?"], "C11%, ...\n"),
        ("POSITION%\n", [], "IN.csv has no rows, there is nothing to compare"),
        (QUARTERS, ["--output", "IN.csv"], "--output and --input are the same file, IN.csv"),
        (QUARTERS, ["--output", "none/OUT.csv"], "none/OUT.csv cannot be written: No such file or directory"),
    ],
)  # fmt: skip
def test_wrong_usage(automax, table, options, message):
    result = compared(automax, table, *options)
    assert (result.code, result.out) == (2, "")
    assert result.err.startswith("automax compare: error: ")
    assert message in result.err
    assert len(result.err) < 400


def test_unreadable_table(automax):
    result = automax("compare", "pulse", "--input", "NONE.csv")
    assert result == (2, "", "automax compare: error: NONE.csv cannot be read: No such file or directory\n")


@pytest.mark.parametrize("arguments", [[], ["pulse"], ["puls"], ["pulse", "--input", "A", "--nonsense"]])
def test_wrong_words(automax, arguments):
    result = automax("compare", *arguments)
    assert (result.code, result.out) == (2, "")
    assert "usage: automax compare" in result.err


@pytest.mark.parametrize(
    ("table", "fault"),
    [
        ("A%\n1\n32768\n", "3: error[AMX6915]: A% = 32768, it must be a whole number from -32768 to 32767\n  hint: "),
        ("A%\n65536\n", "2: error[AMX6915]: A% = 65536, it must be a whole number from -32768 to 32767\n"),
        ("A%\n-32769\n", "2: error[AMX6915]: A% = -32769, it must be a whole number from -32768 to 32767\n"),
        ("A%\n1.5\n", "2: error[AMX6915]: A% = 1.5, it must be"),
        ("A%\n1\x1b[2J\n", "2: error[AMX6915]: A% = 1\N{REPLACEMENT CHARACTER}[2J, it must be"),
        ("A%,R@\n1,0\n1,2\n", "3: error[AMX6915]: R@ = 2, it must be 0 or 1, FALSE or TRUE\n"),
        ("A%,R@\n1\n", "2: error[AMX6914]: the row has 1 cells, the header 2\n"),
        ("A%,a%\n1,1\n", "1: error[AMX6912]: there are two columns for A%\n"),
        ("", "1: error[AMX6910]: the first line must name the variables\n"),
        (b"A%\n\xff\n", "2: error[AMX6910]: the table is not UTF-8"),
    ],
)  # fmt: skip
def test_fault_of_the_table_is_told_with_its_line(automax, table, fault):
    options = ["--column", "A%"] + (["--reset", "R@"] if "R@" in str(table) else [])
    result = compared(automax, table, *options)
    assert (result.code, result.out) == (2, "")
    assert result.err.startswith(f"IN.csv:{fault}")
    assert "\x1b" not in result.err


def test_word_without_sign_is_told_with_its_value(automax):
    assert compared(automax, "A%\n65535\n").err.endswith("\n  hint: as a word of 16 bits this is -1\n")


def test_scans_before_a_fault_are_in_the_output(automax):
    assert compared(automax, "A%\n1\n2\nx\n4\n", "--output", "OUT.csv").code == 2
    assert columns_of((automax.folder / "OUT.csv").read_text())["feedback"] == ["1", "2"]


def test_long_work_shows_its_progress(automax, monkeypatch):
    shown = []
    monkeypatch.setattr(compare_pulse.ProgressBar, "show", lambda _, done: shown.append(done))
    table = "A%\n" + "1\n" * 1000
    assert compared(automax, table).code == 0
    assert len(shown) == 1000 // 256
    assert shown == sorted(shown)
    assert 0 < shown[0] <= len(table)


CELLS = st.sampled_from(["", "0", "1", "-1", "32767", "40000", "1.5", "TRUE", '"', "x", "\r", "\x00", "é"])
TABLES = st.one_of(
    st.binary(max_size=100),
    st.lists(st.lists(CELLS, min_size=2, max_size=2).map(",".join), max_size=6).map(
        lambda rows: "\n".join(["A%,R@", *rows]).encode()
    ),
)


@settings(deadline=None, derandomize=True, database=None, max_examples=200)
@given(data=TABLES, size=st.integers(-1, 17), options=st.sampled_from([[], ["--reset", "R@"], ["--column", "A%"]]))
def test_any_bytes_give_a_report_or_a_reason(tmp_path_factory, data, size, options):
    path = tmp_path_factory.getbasetemp() / "ANY.csv"
    path.write_bytes(data)
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        code = main(["compare", "pulse", "--input", str(path), "--word-size", str(size), *options])
    assert code in {0, 1, 2}
    assert bool(out.getvalue()) == (code != 2)
    assert bool(err.getvalue()) == (code == 2)
