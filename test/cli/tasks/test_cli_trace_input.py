"""The input table of `automax trace`: everything that can be wrong with it is told with its line."""

import contextlib
import io
import re
from pathlib import Path

import pytest
from core.problem_pages import read_page
from hypothesis import given, settings
from hypothesis import strategies as st

from automax_ros.blocks.declare.declaration import Platform
from automax_ros.cli.main import main
from automax_ros.cli.options.task import TaskTarget, check_task_file
from automax_ros.cli.tasks.input_table import InputTable
from automax_ros.core.problems import PROBLEMS
from automax_ros.rackfile.reading.csv_table import MAX_LINE, CsvFault
from automax_ros.runtime.tasks.standalone_task import StandaloneTask
from cli.support import TASK, table_of

FAULTS = [code for code in PROBLEMS if "AMX6910" <= code < "AMX6950"]


@pytest.mark.parametrize(
    ("table", "place", "message"),
    [
        ("REV%\n", "1: error[AMX6911]", "no variable 'REV%'\n  hint: did you mean REF%?"),
        ("REF\n", "1: error[AMX6911]", "did you mean REF%?"),
        ("REF%\tRUN@\n", "1: error[AMX6911]", "columns are separated by commas or semicolons"),
        ("REF%;RUN@\n1;1\n1,1\n", "3: error[AMX6914]", "1 cells, the header 2"),
        ("time_s,time_s\n", "1: error[AMX6911]", "no variable 'time_s'"),
        ("GRID%(1,2)\n", "1: error[AMX6911]", 'needs quotes in a CSV table: "TABLE%(1,2)"'),
        ("REF%,\n", "1: error[AMX6911]", "no variable ''"),
        ("REF%,RUN@,ref%\n", "1: error[AMX6912]", "two columns for REF%"),
        ("TABLE%(1),TABLE%[01]\n", "1: error[AMX6912]", "two columns for TABLE%(1)"),
        ("TABLE%(11)\n", "1: error[AMX6913]", "subscript 11 of TABLE%(11) is out of range\n  hint: the largest is 10"),
        ('"GRID%(3,0)"\n', "1: error[AMX6913]", "subscript 3 of GRID%(3,0) is out of range\n  hint: the largest is 2"),
        ("TABLE%\n", "1: error[AMX6913]", "the last is TABLE%(10)"),
        ("REF%(0)\n", "1: error[AMX6913]", "write REF%"),
        ("TABLE%(-1)\n", "1: error[AMX6911]", "no variable"),
        ("REF%,RUN@\n1,1\n1\n", "3: error[AMX6914]", "1 cells, the header 2"),
        ("REF%,RUN@\n1,1,1\n", "2: error[AMX6914]", "3 cells, the header 2"),
        ("REF%,RUN@\n1,1\n\n1,1\n", "3: error[AMX6914]", "the line is empty"),
        ("REF%\n1\n32768\n", "3: error[AMX6915]", "REF% = 32768, it must be a whole number from -32768 to 32767"),
        ("REF%\n1.5\n", "2: error[AMX6915]", "whole number"),
        ("REF%\nNaN\n", "2: error[AMX6915]", "whole number"),
        ("REF%\n1e3\n", "2: error[AMX6915]", "whole number"),
        ("REF%\n" + "9" * 50 + "\n", "2: error[AMX6915]", "whole number"),
        ("REF%\n\N{ARABIC-INDIC DIGIT ONE}\n", "2: error[AMX6915]", "whole number"),
        ("COUNT!\n2147483648\n", "2: error[AMX6915]", "from -2147483648 to 2147483647"),
        ("RUN@\n2\n", "2: error[AMX6915]", "0 or 1"),
        ("SCALED\n1e19\n", "2: error[AMX6915]", "a number from -9.2233717E18"),
        ("SCALED\ninf\n", "2: error[AMX6915]", "a number"),
        ("SCALED\n1_0\n", "2: error[AMX6915]", "a number"),
        ("TEXT$\nabcdef\n", "2: error[AMX6915]", "at most 5 characters"),
        ("TABLE%(2)\nx\n", "2: error[AMX6915]", "TABLE%(2) = x"),
        ("GAIN\n10.1\n", "2: error[AMX6916]", "inside its tuning limits, 0.0 to 10.0"),
        ("STEPS%\n10\n", "2: error[AMX6916]", "inside its tuning limits, -32768 to 9"),
        ("GAIN\n1e999\n", "2: error[AMX6916]", "tuning limits"),
        ("GAIN\nfast\n", "2: error[AMX6915]", "a number"),
        ("", "1: error[AMX6910]", "the first line must name the variables"),
        ("\nREF%\n", "1: error[AMX6910]", "the first line must name the variables"),
        ('"REF%\n', "1: error[AMX6910]", "not CSV"),
        ('REF%\n"1\n', "2: error[AMX6910]", "not CSV"),
        ('REF%\n"1"2\n', "2: error[AMX6910]", "not CSV"),
        ("REF%\n1\r2\n", "2: error[AMX6910]", "not CSV"),
        ("REF%\n1\x002\n", "2: error[AMX6910]", "not CSV"),
        (b"REF%\n\xff\n", "2: error[AMX6910]", "not UTF-8: here is a byte 0xff"),
        ("REF%\n" + "1" * MAX_LINE + "\n", "2: error[AMX6910]", f"more than {MAX_LINE} bytes"),
        ("A" * 200_000 + "\n", "1: error[AMX6910]", "not CSV"),
        ("\x1b[2J\n", "1: error[AMX6911]", "no variable"),
    ],
)  # fmt: skip
def test_fault_is_told_with_file_line_code_and_cure(automax, table, place, message):
    result = automax.trace(table)
    assert result.code == 2
    assert result.err.startswith(f"IN.csv:{place}: ")
    assert message in result.err
    assert "\x1b" not in result.err
    assert len(result.err) < 400


def test_scans_before_a_fault_are_shown(automax):
    result = automax.trace("REF%\n1\n2\nx\n4\n", "--watch", "REF%")
    assert result.code == 2
    assert result.out == "scan,time_s,REF%\n1,0,1\n2,0.011,2\n"


@pytest.mark.parametrize("code", FAULTS)
def test_page_shows_a_table_with_this_fault_and_its_cure(automax, code):
    task = TASK
    page = read_page(code)
    assert page.example.language == page.cure.language == "csv"
    result = automax.trace(page.example.text, task=task)
    assert result.code == 2
    assert re.findall(r"AMX\d{4}", result.err) == [code]
    assert automax.trace(page.cure.text, task=task).code == 0


def test_page_of_the_file_name(automax):
    page = read_page("AMX6900")
    for fence, codes in ((page.example, ["AMX6900"]), (page.cure, [])):
        name = next(word.removeprefix("file=") for word in fence.words)
        assert re.findall(r"AMX\d{4}", automax("check", automax.write(name, fence.text)).out) == codes


NAMES = [
    "REF%",
    "RUN@",
    "SCALED",
    "COUNT!",
    "OUT%",
    "TABLE%(3)",
    '"GRID%(1,2)"',
    "TEXT$",
    "GAIN",
    "STEPS%",
    "NONE%",
    "",
]
CELLS = st.one_of(
    st.sampled_from(["", "0", "1", "-1", "32767", "40000", "1.5", "1e5", "TRUE", '"', '""', "x", "\r", "\x00", "é"]),
    st.text(max_size=8),
)
ROWS = st.lists(st.lists(CELLS, max_size=4).map(",".join), max_size=6)
TABLES = st.one_of(
    st.binary(max_size=200),
    st.text(max_size=200).map(lambda text: text.encode("utf-8", "surrogatepass")),
    st.builds(
        lambda header, rows: "\n".join([",".join(header), *rows]).encode("utf-8", "surrogatepass"),
        st.lists(st.sampled_from(NAMES), min_size=1, max_size=4),
        ROWS,
    ),
)


@pytest.fixture(scope="module")
def lone(tmp_path_factory):
    """A task to be set, and the path of its table."""
    folder = tmp_path_factory.mktemp("table")
    (folder / "TASK.BLK").write_text(TASK)
    _, result = check_task_file(folder / "TASK.BLK", TaskTarget(Platform.AUTOMAX, 5_500_000))
    assert result.program is not None
    task = StandaloneTask(result.program)
    task.task.run()
    return task, folder / "IN.csv"


@settings(deadline=None, derandomize=True, max_examples=500)
@given(data=TABLES)
def test_any_bytes_are_rows_or_a_fault_with_its_line(lone, data):
    task, path = lone
    path.write_bytes(data)
    lines = data.count(b"\n") + 1
    last, fault = 1, None
    try:
        with InputTable(path, task) as table:
            for line in table.rows():
                assert last < line <= lines
                last = line
                task.task.scan(0)
    except CsvFault as error:
        fault = error
    assert fault is None or (fault.code in FAULTS and last <= int(fault.place.rpartition(":")[2]) <= lines)


def traced(path, data):
    """Trace the task on a table; return the exit code and what went to standard output and error."""
    path.write_bytes(data)
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        code = main(["trace", str(path.with_name("TASK.BLK")), "--input", str(path)])
    return code, out.getvalue(), err.getvalue()


@settings(deadline=None, derandomize=True, max_examples=150)
@given(data=TABLES)
def test_any_bytes_give_a_table_and_an_exit_code(lone, data):
    _, path = lone
    code, out, err = traced(path, data)
    rows = table_of(out)
    assert all(len(row) == len(rows[0]) for row in rows)
    assert [row[0] for row in rows[1:]] == [str(number + 1) for number in range(len(rows[1:]))]
    assert ("error[AMX69" in err) == (code == 2)
    assert code in {0, 2}


@pytest.mark.soak
@settings(deadline=None, derandomize=True, max_examples=5_000)
@given(data=TABLES)
def test_any_bytes_give_an_exit_code_at_length(lone, data):
    _, path = lone
    assert traced(path, data)[0] in {0, 2}


@settings(deadline=None, derandomize=True, max_examples=200)
@given(values=st.lists(st.tuples(st.integers(-32768, 32767), st.booleans(), st.integers(0, 10)), max_size=20))
def test_rows_set_exactly_their_cells(lone, values):
    task, path = lone
    path.write_text("REF%,RUN@,GAIN\n" + "".join(f"{a},{int(b)},{c}\n" for a, b, c in values))
    names = ("REF%", "RUN@", "GAIN")
    with InputTable(path, task) as table:
        for _, row in zip(table.rows(), values, strict=True):
            assert tuple(task.variable(name).read() for name in names) == row


def test_semicolons_separate_where_the_header_has_one(automax):
    result = automax.trace("REF%;SCALED;GRID%(1,2)\n5;0,5;7\n;;\n", "--watch", "REF%,SCALED,GRID%(1,2)")
    assert (result.code, result.err) == (0, "")
    rows = table_of(result.out)
    assert [row[2] for row in rows] == ["REF%", "5", "5"]
    assert [row[4] for row in rows] == ["GRID%(1,2)", "7", "7"]
    assert automax.trace("REF%;GAIN\n5;2,5\n", "--watch", "GAIN").out.splitlines()[1].endswith(",2.5")


def test_what_export_and_trace_write_can_be_traced(automax):
    automax.write("TASK.BLK", TASK)
    automax.write(
        "rack.yaml",
        """\
rack: LINE1
slots:
  0: {module: 57C435, tasks: {TASK: {priority: 5}}}
common:
  REF%: {preset: 5}
  RUN@:
  SCALED:
  COUNT!:
""",
    )
    assert automax("run", "rack.yaml", "--simulated", "--duration", "0.1", "--record", "bag").code == 0
    assert automax("export", "bag", "-o", "out.csv", "--every", "0.011").code == 0
    assert Path("out.csv").read_text().startswith("time_s,REF%,")
    result = automax("trace", "TASK.BLK", "--input", "out.csv")
    assert (result.code, result.err) == (0, "")
    automax.write("again.csv", result.out)
    assert automax("trace", "TASK.BLK", "--input", "again.csv").code == 0
