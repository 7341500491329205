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
