"""`automax trace --input`: tables with times, tables that lack inputs, and those of `automax export --scans`."""

import csv

import pytest
from recordings.live_racks import build

from automax_ros.messages.stream.stream import RackStream
from automax_ros.recordings.write.recorder import Recorder, RecordingOptions
from cli.support import columns_of

HOLD = "10 COMMON REF%, OUT%\n100 CALL SCAN_LOOP(TICKS=2)\n110 OUT% = REF%\n150 END\n"
LOOP = """\
10 COMMON REF%, SUM%, GAIN, TOTAL, RUN@, TABLE%(1,2), SLOW!
20 LOCAL TRIM% [CURRENT=1, HIGH=10, LOW=0], LAST%
100 CALL SCAN_LOOP(TICKS=2)
110 CALL SUMMER(INPUT1=REF%, INPUT2=TRIM%, OUTPUT=SUM%)
120 CALL LAG(INPUT=SUM%, WLG=10.0, RESET=-RUN@, OUTPUT=LAST%)
130 TOTAL = GAIN * 2.0 + TABLE%(0,1)
140 SLOW! = SLOW! + LAST%
150 TABLE%(1,1) = LAST%
160 END
"""


def test_rows_with_times_hold_until_the_next_one(automax):
    result = automax.trace("time_s,REF%\n5,100\n5.1,200\n5.104,250\n5.2,300\n", "--watch", "OUT%", task=HOLD)
    assert (result.code, result.err) == (0, "")
    out = columns_of(result.out)["OUT%"]
    # Scans every 11 ms from the first row on: 5.1 s comes before scan 10 (0.110 s), and so does 5.104 s.
    assert out == ["100"] * 10 + ["250"] * 9 + ["300"]


def test_rows_with_numbers_of_scans_are_scans(automax):
    result = automax.trace("scan,time_s,REF%\n1,0,1\n2,1,2\n3,2,3\n", "--watch", "OUT%", task=HOLD)
    assert columns_of(result.out)["OUT%"] == ["1", "2", "3"]


@pytest.mark.parametrize("rows", ["0,1\n2,2\n1,3\n", "-1,1\n", "x,1\n", ",1\n", "1e300,1\n"])
def test_times_that_are_none_are_refused(automax, rows):
    result = automax.trace(f"time_s,REF%\n{rows}", task=HOLD)
    assert result.code == 2
    assert "error[AMX6803]" in result.err


def test_inputs_that_the_table_lacks_are_named(automax):
    automax.write("HOLD.BLK", HOLD)
    automax.write("IN.csv", "time_s\n0\n0.1\n")
    assert automax("trace", "HOLD.BLK", "--input", "IN.csv").err == "HOLD: IN.csv does not set REF%: it stays 0\n"
    automax.write("IN.csv", "REF%\n1\n")
    assert automax("trace", "HOLD.BLK", "--input", "IN.csv").err == "", "it writes the other one itself"


def test_exported_scans_are_traced_again(automax):
    """What a scan saw is set, and the outputs are those of the recording, statements and arrays included."""
    rack = build(automax.folder, SPEED=LOOP)
    stream = RackStream(rack, rack.fingerprint)
    recorder = Recorder(rack, stream, automax.folder / "bag", RecordingOptions(every_state=True))
    stream.begin()
    rack.start()
    for number in range(20):
        rack.write("REF%", number * 70 - 300)
        rack.write("GAIN", number / 8)
        rack.write("RUN@", number % 5 != 4)
        rack.write("TABLE%", number * 10 - 90, element=1)
        rack.run(0.05)
    stream.end()
    recorder.close()
    assert automax("export", "bag", "--scans", "SPEED", "-o", "scans.csv").code == 0
    with (automax.folder / "scans.csv").open() as file:
        rows = list(csv.DictReader(file))
    names = [name.removeprefix("out.") for name in rows[0] if name.startswith("out.")]
    assert set(names) == {"SUM%", "TOTAL", "SLOW!", "TABLE%(1,1)"}
    assert not [name for name, cell in rows[-1].items() if cell == ""], "what is unchanged stands there"
    assert {"local.TRIM%", "local.LAST%"} <= rows[0].keys()
    result = automax("trace", "SPEED.BLK", "--input", "scans.csv", "--watch", ",".join([*names, "LAST%"]))
    assert (result.code, result.err) == (0, "")
    traced = columns_of(result.out)
    for name in names:
        assert traced[name] == [row[f"out.{name}"] for row in rows], name
    assert traced["LAST%"] == [row["local.LAST%"] for row in rows]
    assert len(set(traced["LAST%"])) > 20


def test_a_historians_table_is_rounded_and_its_other_columns_are_named(automax):
    """Rounded as by the verb `table`: halves up. Scans come every 11 ms."""
    automax.write("HOLD.BLK", HOLD)
    automax.write("IN.csv", "time_s,REF%,comment,X%\n5,166.3,a,1\n5.011,2.5,,\n5.022,-2.5,,\n5.033,-1.6,c,2\n")
    result = automax("trace", "HOLD.BLK", "--input", "IN.csv")
    assert (result.code, result.err) == (0, "HOLD: it has no variable for these columns of IN.csv: comment, X%\n")
    assert columns_of(result.out)["OUT%"] == ["166", "3", "-2", "-2"]
    automax.write("IN.csv", "REF%,comment\n1,a\n")
    assert "AMX6911" in automax("trace", "HOLD.BLK", "--input", "IN.csv").err, "by scans it is not a historian's"
    automax.write("IN.csv", "time_s,REF%\n5,32767.4\n")
    assert "it must be a number from -32768 to 32767" in automax("trace", "HOLD.BLK", "--input", "IN.csv").err


def test_a_file_that_an_error_cuts_short_is_named(automax):
    automax.write("HOLD.BLK", HOLD)
    automax.write("IN.csv", "time_s,REF%\n0,1\n0.1,Bad Input\n")
    result = automax("trace", "HOLD.BLK", "--input", "IN.csv", "--output", "OUT.csv")
    assert result.code == 2
    rows = (automax.folder / "OUT.csv").read_text().splitlines()[1:]
    assert result.err.startswith(f"OUT.csv: cut short after {len(rows)} scans by the error that follows\nIN.csv:3: ")
    assert result.err.endswith("hint: leave the cell empty where there is no value\n")
    assert len(rows) == 10


def test_two_decimal_signs_and_dates_are_refused(automax):
    told = automax.trace("time_s;REF%\n0;1,4\n0,02;1.500\n", task=HOLD).err
    assert "AMX6915" in told
    assert "the decimal sign is a comma in line 2, and here a dot" in told
    assert "docs/howto/week.md" in automax.trace("time_s,REF%\n2026-03-02,1\n", task=HOLD).err
