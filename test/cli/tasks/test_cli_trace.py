"""`automax trace`: what a row sets, what a scan shows, and how a trace ends."""

import math

import pytest

from cli.support import TASK, columns_of, table_of

COPY = """\
10 COMMON A%, B%, N!
20 LOCAL ONCE%
30 ONCE% = A% + 1 \\ N! = 70000
40 CALL SCAN_LOOP(TICKS=3)
50 CALL SUMMER(INPUT1=A%, INPUT2=ONCE%, OUTPUT=B%)
60 N! = N! * 2
70 END
"""
COUNTER = "10 COMMON GO@\n20 LOCAL N%\n30 CALL SCAN_LOOP(TICKS=1)\n40 N% = N% + 1\n{}50 END\n"


def test_one_scan_a_row_and_every_simple_variable_in_the_order_of_declaration(automax):
    result = automax.trace("REF%,RUN@,GAIN,TABLE%(3)\n100,1,,\n,,2.5,7\n-5,0,,\n")
    assert (result.code, result.err) == (0, "")
    assert result.out == (
        "scan,time_s,REF%,RUN@,SCALED,COUNT!,OUT%,TEXT$,GAIN,STEPS%\n"
        "1,0,100,1,150.0,3,100,,1.5,3\n"
        "2,0.011,100,1,267.5,6,107,,2.5,3\n"
        "3,0.022,-5,0,5.0,9,2,,2.5,3\n"
    )


def test_part_before_scan_loop_runs_before_the_first_cells(automax):
    """ONCE% is made of A% before the first row sets it, and N! keeps what that part wrote."""
    out = automax.trace("A%\n41\n\n", task=COPY).out
    assert columns_of(out)["ONCE%"] == ["1"]
    assert columns_of(out)["B%"] == ["42"]
    assert columns_of(out)["N!"] == ["140000"]


def test_cell_is_set_before_the_latch_of_the_same_scan(automax):
    assert columns_of(automax.trace("A%\n1\n2\n3\n", task=COPY).out)["B%"] == ["2", "3", "4"]


def test_empty_cell_leaves_what_the_task_itself_wrote(automax):
    assert columns_of(automax.trace("N!,A%\n,1\n,1\n5,1\n,1\n", task=COPY).out)["N!"] == [
        "140000",
        "280000",
        "10",
        "20",
    ]


@pytest.mark.parametrize(
    ("options", "period_ns"),
    [
        ([], 16_500_000),
        (["--tick-ms", "0.5"], 1_500_000),
        (["--target", "udc"], 1_500_000),
        (["--tick-ms", "10"], 30_000_000),
    ],
)
def test_times_are_exact_multiples_of_the_period(automax, options, period_ns):
    """No sum of binary fractions: 0.1 + 0.2 never shows."""
    rows = 1000
    out = automax.trace("A%\n" + "1\n" * rows, *options, task=COPY).out
    times = columns_of(out)["time_s"]
    assert len(times) == rows
    for number, text in enumerate(times):
        whole, _, fraction = text.partition(".")
        assert int(whole) * 10**9 + int(fraction.ljust(9, "0") or "0") == number * period_ns
        assert not fraction.endswith("0")


def test_watch_chooses_columns_in_its_order(automax):
    out = automax.trace('"GRID%(1,2)",REF%\n9,4\n', "--watch", "ref%, GRID%(1,2),table%[3]", "--watch", "RUN@,REF%").out
    assert table_of(out) == [
        ["scan", "time_s", "REF%", "GRID%(1,2)", "TABLE%(3)", "RUN@"],
        ["1", "0", "4", "9", "0", "0"],
    ]


def test_header_may_be_in_lower_case_with_blanks_brackets_and_a_byte_order_mark(automax):
    result = automax.trace(b'\xef\xbb\xbf ref% , "grid%[ 1, 2 ]"\r\n 4 , 9 \r\n', "--watch", "REF%,GRID%(1,2)")
    assert table_of(result.out)[1] == ["1", "0", "4", "9"]


@pytest.mark.parametrize(
    ("column", "cell", "shown"),
    [
        ("REF%", "-32768", "-32768"),
        ("REF%", "+7", "7"),
        ("REF%", "100.0", "100"),
        ("COUNT!", "2147483640", "2147483643"),
        ("RUN@", "TRUE", "1"),
        ("RUN@", "off", "0"),
        ("RUN@", "1.0", "1"),
        ("SCALED", "0.1", "0.0"),
        ("GAIN", "10", "10.0"),
        ("GAIN", "0.1", "0.1"),
        ("STEPS%", "9", "9"),
        ("TEXT$", '" a""b"', ' a"b'),
    ],
)
def test_cells_of_every_type(automax, column, cell, shown):
    """COUNT! gains STEPS% = 3 in the scan and SCALED is computed again; the others are left alone."""
    assert columns_of(automax.trace(f"{column}\n{cell}\n").out)[column] == [shown]


REALS = "10 LOCAL X, Y\n20 CALL SCAN_LOOP(TICKS=1)\n30 Y = X\n40 END\n"


@pytest.mark.parametrize(
    ("cell", "shown"),
    [
        ("0.1", "0.1"),
        ("2", "2.0"),
        ("16777217", "16777216.0"),
        ("3.14159265358979", "3.1415927"),
        ("1e-15", "1e-15"),
        ("-1E18", "-1e+18"),
        ("1e-25", "0.0"),
        (".5", "0.5"),
        ("5.", "5.0"),
    ],
)
def test_reals_have_no_more_digits_than_a_single(automax, cell, shown):
    columns = columns_of(automax.trace(f"X\n{cell}\n", task=REALS).out)
    assert (columns["X"], columns["Y"]) == ([shown], [shown])


def test_tables_go_to_files(automax):
    shown = automax.trace("REF%\n5\n")
    result = automax.trace("REF%\n5\n", "--output", "OUT.csv")
    assert (result.code, result.out, result.err) == (0, "", "")
    assert (automax.folder / "OUT.csv").read_text() == shown.out


def test_header_alone_gives_a_header(automax):
    assert automax.trace("REF%", "--watch", "REF%") == (0, "scan,time_s,REF%\n", "")


def test_empty_lines_at_the_end_are_no_scans(automax):
    assert columns_of(automax.trace("REF%,RUN@\n1,1\n\n  \n").out)["scan"] == ["1"]


def test_empty_line_of_one_column_is_an_empty_cell(automax):
    columns = columns_of(automax.trace("REF%\n1\n\n\n4\n\n").out)
    assert columns["REF%"] == ["1", "1", "1", "4"]


def test_errors_of_each_scan(automax):
    """OUT% clamps in scan 2 and 3; the log of the task itself would only keep the first, second and last."""
    start = "5 LOCAL A%, B%, N!\n6 N! = A% / A%\n10 CALL SCAN_LOOP(TICKS=1)\n"
    task = start + "20 CALL SUMMER(INPUT1=A%, INPUT2=A%, OUTPUT=B%)\n30 END\n"
    table = "A%\n1\n20000\n-20000\n1\n30000\n"
    result = automax.trace(table, "--errors", "ERR.csv", task=task)
    assert (result.code, result.err) == (0, "")
    assert (automax.folder / "ERR.csv").read_text() == (
        "scan,line,code,message\n"
        "0,6,AMX7024,division by zero in an expression\n"
        "2,20,AMX7001,output of a block clamped to 16 bits\n"
        "3,20,AMX7001,output of a block clamped to 16 bits\n"
        "5,20,AMX7001,output of a block clamped to 16 bits\n"
    )
    quiet = automax.trace(table, task=task)
    assert quiet.out == result.out
    assert quiet.err == (
        "TASK: 4 run-time errors; the first: scan 0, line 6: AMX7024 division by zero in an expression\n"
    )


def test_errors_file_of_a_clean_task_is_a_header(automax):
    automax.trace("REF%\n1\n", "--errors", "ERR.csv")
    assert (automax.folder / "ERR.csv").read_text() == "scan,line,code,message\n"


def test_stop_ends_the_trace_with_its_scan(automax):
    result = automax.trace("GO@\n0\n0\n1\n0\n0\n", task=COUNTER.format("45 IF GO@ THEN STOP\n"))
    assert result.code == 1
    assert columns_of(result.out)["N%"] == ["1", "2", "3"]
    assert result.err == "TASK: ended by STOP in scan 3\n"


def test_stop_before_the_first_scan(automax):
    result = automax.trace("GO@\n0\n", task=COUNTER.format("").replace("30 CALL", "25 IF NOT GO@ THEN STOP\n30 CALL"))
    assert (result.code, result.out) == (1, "scan,time_s,GO@,N%\n")
    assert result.err == "TASK: ended by STOP before the first scan\n"


def test_endless_loop_is_a_fault_that_ends_the_trace(automax):
    task = COUNTER.format("45 IF GO@ THEN 45\n")
    result = automax.trace("GO@\n0\n1\n0\n", "--errors", "ERR.csv", task=task)
    assert result.code == 1
    assert columns_of(result.out)["scan"] == ["1", "2"]
    assert "TASK: faulted in scan 2: scan 2, line 45: AMX7040" in result.err
    assert "(code 14 on the rack)" in result.err
    assert table_of((automax.folder / "ERR.csv").read_text())[1][:3] == ["2", "45", "AMX7040"]


def test_task_with_errors_is_told_as_check_does(automax):
    wrong = TASK.replace("OUT% * GAIN", "OUTPT% * GAIN")
    result = automax.trace("REF%\n1\n", "--output", "OUT.csv", task=wrong)
    assert (result.code, result.out) == (1, "")
    assert result.err == automax("check", "TASK.BLK").out
    assert "AMX4001" in result.err
    assert not (automax.folder / "OUT.csv").exists()


@pytest.mark.parametrize(
    ("watch", "message"),
    [
        ("REV%", "did you mean REF%?"),
        ("REF", "did you mean REF%?"),
        ("TABLE%", "TABLE% is an array"),
        ("TABLE%(11)", "subscript 11 of TABLE%(11) is out of range"),
        ("GRID%(1)", "GRID% has 2 subscripts"),
        ("REF%(0)", "REF% is not an array"),
        ("REF% RUN@", "no variable"),
        ("\x1b[2J", "no variable"),
        ("ß" * 500, "no variable"),
    ],
)
def test_watch_of_nothing_is_wrong_usage(automax, watch, message):
    result = automax.trace("REF%\n1\n", "--watch", watch)
    assert (result.code, result.out) == (2, "")
    assert result.err.startswith("automax trace: error: --watch: ")
    assert message in result.err
    assert "\x1b" not in result.err


def test_missing_files(automax):
    automax.write("TASK.BLK", TASK)
    automax.write("IN.csv", "REF%,RUN@\n1,0\n")
    assert automax("trace", "NONE.BLK", "--input", "IN.csv").code == 2
    missing = automax("trace", "TASK.BLK", "--input", "NONE.csv")
    assert missing == (2, "", "automax trace: error: NONE.csv cannot be read: No such file or directory\n")
    assert automax("trace", "TASK.BLK", "--input", ".").code == 2
    nowhere = automax("trace", "TASK.BLK", "--input", "IN.csv", "--output", "none/OUT.csv")
    assert nowhere == (2, "", "automax trace: error: none/OUT.csv cannot be written: No such file or directory\n")
    assert automax("trace", "TASK.BLK", "--input", "IN.csv", "--tick-ms", "11").code == 2
    assert automax("trace", "TASK.BAS", "--input", "IN.csv").code == 2


@pytest.mark.parametrize(
    "options",
    [
        ["--output", "IN.csv"],
        ["--output", "./TASK.BLK"],
        ["--errors", "IN.csv"],
        ["--output", "X.csv", "--errors", "./X.csv"],
    ],
)
def test_no_table_is_written_over_another(automax, options):
    result = automax.trace("REF%\n1\n", *options)
    assert (result.code, result.out) == (2, "")
    assert "are the same file" in result.err
    assert (automax.folder / "IN.csv").read_text() == "REF%\n1\n"
    assert (automax.folder / "TASK.BLK").read_text() == TASK


def test_wrong_header_keeps_the_old_output(automax):
    automax.write("OUT.csv", "precious")
    assert automax.trace("REV%\n1\n", "--output", "OUT.csv").code == 2
    assert (automax.folder / "OUT.csv").read_text() == "precious"


def test_trace_of_a_filter_follows_its_formula(automax):
    """LAG under s = C (z - 1)/(z + 1) (section 43), computed here in floating point."""
    task = "10 COMMON A%, B%\n20 CALL SCAN_LOOP(TICKS=2)\n30 CALL LAG(INPUT=A%, WLG=10.0, OUTPUT=B%)\n40 END\n"
    out = automax.trace("A%\n" + "0\n" + "8000\n" * 60, task=task).out
    period = 0.011
    c = (2 * math.pi / period / 20) / math.tan(math.pi / 20)
    x1 = y1 = 0.0
    for shown, x in zip(columns_of(out)["B%"], [0.0] + [8000.0] * 60, strict=True):
        y1 = (10.0 * (x + x1) - (10.0 - c) * y1) / (10.0 + c)
        x1 = x
        assert abs(int(shown) - y1) <= 0.5 + 1e-6


@pytest.mark.soak
def test_memory_does_not_grow_with_the_table(automax):
    import tracemalloc

    def peak(rows):
        automax.write("IN.csv", "REF%,RUN@\n" + "1,0\n" * rows)
        tracemalloc.start()
        assert automax("trace", "TASK.BLK", "--input", "IN.csv", "--output", "OUT.csv").code == 0
        _, highest = tracemalloc.get_traced_memory()
        tracemalloc.stop()
        return highest

    automax.write("TASK.BLK", TASK)
    peak(10)
    assert peak(300_000) < peak(3_000) + 3_000_000
