"""`automax tune-info`: what it prints of a task, its JSON, the helper of section 42.3, and what it refuses."""

import json
import math
import subprocess
import sys

import pytest
from golden_text import GOLDEN, check_golden

from cli.support import WRONG

MIX = (GOLDEN / "tuning" / "MIX.BLK").read_text()
UDC = """\
10 LOCAL A%, B%, C%, D%, W
20 COMMON IFB%, OVL@
30 CALL SCAN_LOOP(TICKS=20)
40 CALL HIGH_PASS_FILTER(INPUT=A%, WLD=20.0, ORDER=3, OUTPUT=B%)
50 CALL LOW_PASS_FILTER(INPUT=A%, WLG=W, OUTPUT=C%)
60 CALL NOTCHN(INPUT=A%, Q_FACTOR=4.0, WN=32.0, ORDER=4, OUTPUT=D%)
70 CALL THERMAL_OVERLOAD(I_FDBK=IFB%, LIM_BAR=450, OVERLOAD=OVL@)
80 END
"""


def task(lines: str, ticks: int = 4) -> str:
    declared = "10 LOCAL A%, B%, GAIN, RATES(4)\n20 LOCAL TUNED [CURRENT=2.0, HIGH=300.0, LOW=0.5]\n"
    return f"{declared}30 CALL SCAN_LOOP(TICKS={ticks})\n{lines}90 END\n"


def records(automax, text, *options):
    result = automax("tune-info", automax.write("T.BLK", text), "--json", *options)
    assert (result.code, result.err) == (0, "")
    return json.loads(result.out)


def only(automax, line, *options, ticks=4):
    (block,) = records(automax, task(line, ticks), *options)["blocks"]
    return block


def test_text_for_an_engineer(automax):
    result = automax("tune-info", automax.write("MIX.BLK", MIX), "--set", "GAIN=1.5")
    assert (result.code, result.err) == (0, "")
    assert max(map(len, result.out.splitlines())) <= 120
    check_golden(GOLDEN / "tuning" / "tune_info.expected.txt", result.out)


def test_text_of_a_udc_task(automax):
    result = automax("tune-info", "--target", "udc", automax.write("UDC.BLK", UDC))
    assert (result.code, result.err) == (0, "")
    check_golden(GOLDEN / "tuning" / "tune_info_udc.expected.txt", result.out)


def test_json_schema(automax):
    found = records(automax, MIX, "--set", "GAIN=1.5")
    assert list(found) == [
        "file", "task", "target", "ticks", "tick_ms", "period_s", "nyquist_rad_s", "nyquist_hz", "blocks",
    ]  # fmt: skip
    assert (found["ticks"], found["tick_ms"], found["period_s"]) == (4, 5.5, 0.022)
    assert found["nyquist_rad_s"] == pytest.approx(math.pi / 0.022)
    assert [item["line"] for item in found["blocks"]] == ["100", "110", "120", "130", "140", "150", "160", "170.2"]
    for item in found["blocks"]:
        assert list(item) == [
            "line", "block", "section", "output", "inside", "period_s", "parameters", "missing", "laplace", "discrete",
            "coefficients", "mapping_c", "corners", "integrator", "limits", "ratio",
        ]  # fmt: skip
        for corner in item["corners"]:
            assert list(corner) == [
                "name", "rad_s", "hz", "time_constant_s", "laplace_db", "laplace_deg", "discrete_db", "discrete_deg",
                "mapped_rad_s", "warping",
            ]  # fmt: skip
        for limit in item["limits"]:
            assert list(limit) == [
                "parameter", "value", "given", "low", "high", "low_formula", "high_formula", "verdict",
            ]  # fmt: skip
    prop_int = found["blocks"][4]
    assert prop_int["parameters"]["KP"] == {"value": 2.0, "in_force": 2.0, "source": "tunable", "variable": "KP1"}
    assert prop_int["parameters"]["WLD"]["source"] == "set"
    assert prop_int["parameters"]["WM"]["source"] == "default"


@pytest.mark.parametrize("ticks", [1, 10])
def test_limits_are_the_manuals(automax, ticks):
    """43.1, 43.2, printed for a tick of 5.5 ms."""
    block = only(automax, "40 CALL LAG(INPUT=A%, WLG=10.0, OUTPUT=B%)\n", ticks=ticks)
    wm, wlg = block["limits"]
    assert (wm["low"], wm["high"]) == (pytest.approx(0.0013872 / ticks, rel=2e-4), pytest.approx(253.866 / ticks))
    assert wlg["low"] == pytest.approx(0.00137573 / ticks, rel=1e-4)
    assert wlg["high"] == pytest.approx(256.055 / ticks, rel=1e-4)


def test_tick_of_the_rack_moves_the_limits(automax):
    one = only(automax, "40 CALL LAG(INPUT=A%, WLG=10.0, OUTPUT=B%)\n", "--tick-ms", "10")
    assert one["limits"][1]["high"] == pytest.approx(256.055 * 5.5 / 40, rel=1e-4)


def test_what_comes_close_is_marked(automax):
    text = task(
        "40 CALL LAG(INPUT=A%, WLG=60.0, OUTPUT=B%)\n"
        "50 CALL LEAD_LAG(INPUT=A%, WLD=1.0, WLG=19.5, OUTPUT=B%)\n"
        "60 CALL LAG(INPUT=A%, WLG=11.0, OUTPUT=B%)\n"
        "70 CALL LAG(INPUT=A%, WLG=20.0, OUTPUT=B%)\n"
    )
    result = automax("tune-info", automax.write("T.BLK", text))
    marked = [line.strip() for line in result.out.splitlines() if "!" in line]
    assert len(marked) == 3
    assert marked[0].startswith("WLG  60")
    assert marked[0].endswith("! within 10 % of the high limit")
    assert marked[1].endswith("! within 10 % of 20:1")
    assert marked[2] == "! Kx is within 10 % of 0.125, where the range changes"


def test_diff_lag_tells_what_a_large_input_leaves(automax):
    """Section 51: 32767 - 8191 = 24576."""
    result = automax("tune-info", automax.write("T.BLK", task("40 CALL DIFF_LAG(INPUT=A%, WLG=5.0, OUTPUT=B%)\n")))
    assert "an INPUT of 32767 settles at 32767 - 8191 = 24576, not at 0" in result.out


@pytest.mark.parametrize(
    ("value", "source", "options", "moved"),
    [
        ("GAIN", "unknown", (), None),
        ("GAIN", "set", ("--set", "gain=12.5"), 12.5),
        ("TUNED", "tunable", (), 2.0),
        ("TUNED", "set", ("--set", "TUNED=250"), pytest.approx(64.0137, rel=1e-5)),
        ("RATES(3)", "set", ("--set", "RATES[3]=7"), 7.0),
    ],
)
def test_coefficient_that_is_a_variable(automax, value, source, options, moved):
    block = only(automax, f"40 CALL LAG(INPUT=A%, WLG={value}, OUTPUT=B%)\n", *options)
    assert block["parameters"]["WLG"]["source"] == source
    assert block["parameters"]["WLG"]["in_force"] == moved
    assert block["missing"] == (["WLG"] if moved is None else [])
    assert (block["laplace"] is None) is (moved is None)
    assert block["limits"][1]["high"] == pytest.approx(64.0137, rel=1e-5)


def test_value_that_is_missing_is_asked_for(automax):
    text = task("40 CALL LAG(INPUT=A%, WLG=GAIN, OUTPUT=B%)\n")
    result = automax("tune-info", automax.write("T.BLK", text))
    assert "WLG = GAIN, 0 at first: give --set GAIN=VALUE" in result.out
    limited = automax("tune-info", "T.BLK", "--set", "GAIN=100")
    assert "! too high: the limit is in force and AMX7004 is logged" in limited.out


def test_pid_tells_its_loop_time(automax):
    text = task("40 CALL PID(INPUT=A%, FEEDBACK=B%, KP=1.0, KI=1.0, LOOP_TIME=0.11, OUTPUT=A%)\n")
    result = automax("tune-info", automax.write("T.BLK", text))
    assert "0.11 s = 5 x the scan of 22 ms: the CALL must run in one scan of 5 only" in result.out
    text = text.replace("0.11", "0.03")
    assert "! no whole number of scans" in automax("tune-info", automax.write("T.BLK", text)).out


def test_coefficients_are_those_that_run(automax):
    """42.3: y = Kx (x + x1) + y1 with Kx = KI / C."""
    block = only(automax, "40 CALL INTEGRATE(INPUT=A%, KI=.59507, OUTPUT=B%)\n")
    c = (math.pi / 10) / math.tan(math.pi / 20) / 0.022
    assert block["coefficients"]["gain"] == pytest.approx(0.59507 / c)
    assert block["discrete"]["b"] == pytest.approx([0.59507 / c] * 2)
    assert block["discrete"]["a"] == [1.0, -1.0]
    assert block["laplace"]["text"] == "0.59507 / s"


def test_task_without_dynamic_blocks(automax):
    text = "10 LOCAL A%, B%\n20 CALL SCAN_LOOP(TICKS=4)\n30 CALL INVERTER(INPUT=A%, OUTPUT=B%)\n40 END\n"
    assert automax("tune-info", automax.write("T.BLK", text)) == (
        0,
        "T.BLK: no dynamic block (sections 36 and 41 to 50)\n",
        "",
    )
    assert records(automax, text)["blocks"] == []


def test_task_with_errors_shows_what_check_shows(automax):
    result = automax("tune-info", automax.write("T.BLK", WRONG))
    assert (result.code, result.out) == (1, "")
    assert result.err == automax("check", "T.BLK").out


def test_one_block(automax):
    path = automax.write("MIX.BLK", MIX)
    result = automax("tune-info", path, "--block", "0170.2")
    assert [line for line in result.out.splitlines() if "->" in line] == ["170.2 LAG -> Q%   (section 43)"]


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (("--block", "999"), "--block 999: there is no block on this line\n  hint: dynamic blocks are 100 LAG, "),
        (("--block", "170"), "--block 170: that is not a dynamic block\n  hint: dynamic blocks are 100 LAG, "),
        (("--block", "170.9"), "--block 170.9: that is not a dynamic block"),
        (("--block", "LAG"), "--block 'LAG' is not a BASIC line such as 210 or 210.2"),
        (("--set", "GAIN"), "--set: 'GAIN' is not NAME=VALUE"),
        (("--set", "GAIM=1"), "--set: the task has no variable 'GAIM'\n  hint: did you mean GAIN?"),
        (("--set", "GAIN(1)=1"), "--set: GAIN is not an array\n  hint: write GAIN\n"),
        (("--set", "A%=1"), "--set A%: it carries the signal, INPUT of 100 LAG\n"),
        (("--set", "G%=1"), "--set G%: it carries the signal, FEEDBACK of 160 PID\n"),
        (("--set", "R@=1"), "--set R@: no dynamic block takes it\n  hint: to be set are GAIN, KP1"),
        (("--set", "GAIN=1", "--set", "gain=2"), "--set GAIN is given twice\n"),
        (("--block", "210.0"), "--block '210.0' is not a BASIC line such as 210 or 210.2\n  hint: dynamic blocks are"),
        (
            ("--set", "GAIN=nan"),
            "--set: 'nan' is not a value for GAIN, type REAL\n  hint: it takes a number from -9.2233717E18",
        ),
        (("--set", "GAIN=1e30"), "--set: '1e30' is not a value for GAIN, type REAL"),
        (("--set", "GAIN="), "--set: '' is not a value for GAIN, type REAL"),
        (("--set", "KP1=11"), "--set KP1: 11.0 is beyond its tuning limits, 0.5 to 10.0"),
        (("--block", "100", "--set", "KP1=2"), "--set KP1: the block does not take it"),
        (("--ticks", "4"), "--ticks is for --ki"),
        (("--tick-ms", "0.3"), "--tick-ms"),
        (("--ki", "1", "2", "--block", "100"), "--ki goes without --block and --set"),
        (("--ki", "1", "2", "--ticks", "4"), "--ticks and FILE both give the scan time"),
    ],
)
def test_wrong_usage(automax, options, told):
    result = automax("tune-info", automax.write("MIX.BLK", MIX), *options)
    assert (result.code, result.out) == (2, "")
    assert result.err.startswith(f"automax tune-info: error: {told}")


HOLDING = (
    "10 LOCAL A%, B%, G(3), M(2,4), RS@, TOP%\n20 CALL SCAN_LOOP(TICKS=4)\n"
    "30 CALL INTEGRATE(INPUT=A%, KI=G(2), RESET=-RS@, LIMIT_PLUS=TOP%, OUTPUT=B%)\n"
    "40 CALL LAG(INPUT=A%, WLG=M(1,3), OUTPUT=B%)\n50 END\n"
)


@pytest.mark.parametrize(
    ("setting", "told"),
    [
        ("G=5.0", "--set: G is an array\n  hint: name one element; the last is G(3)\n"),
        ("M=5.0", "--set: M is an array\n  hint: name one element; the last is M(2,4)\n"),
        ("G(3)=5.0", "--set G(3): no dynamic block takes it\n  hint: to be set are G(2), M(1, 3)\n"),
        ("RS@=FALSE", "30 INTEGRATE -> B%: RESET is TRUE, OUTPUT stays where it is\n"),
        ("RS@=TRUE", "--set RS@: it is RESET of 30 INTEGRATE, no coefficient\n  hint: to be set are G(2), M(1, 3)\n"),
        ("TOP%=5", "--set TOP%: it is LIMIT_PLUS of 30 INTEGRATE, no coefficient\n"),
    ],
)
def test_what_cannot_be_set(automax, setting, told):
    result = automax("tune-info", automax.write("T.BLK", HOLDING), "--set", setting)
    assert (result.code, result.out) == (2, "")
    assert result.err.startswith(f"automax tune-info: error: {told}")


@pytest.mark.parametrize("name", ["G(2)", "G(02)", "g[ 002 ]"])
def test_element_of_an_array_is_set_by_its_subscript(automax, name):
    assert records(automax, HOLDING, "--set", f"{name}=5.0")["blocks"][0]["parameters"]["KI"]["in_force"] == 5.0


def test_elements_of_two_subscripts(automax):
    found = records(automax, HOLDING, "--set", "M(01, 3)=5.0")["blocks"][1]
    assert found["parameters"]["WLG"]["in_force"] == 5.0


def test_second_call_of_a_line_by_a_number_with_zeros(automax):
    result = automax("tune-info", automax.write("MIX.BLK", MIX), "--block", "170.02")
    assert "170.2 LAG -> Q%" in result.out


def test_limits_that_cross_blame_ticks(automax):
    text = task("40 CALL NOTCH(INPUT=A%, Q_FACTOR=2.0, WN=GAIN, OUTPUT=B%)\n", ticks=12000)
    result = automax("tune-info", automax.write("T.BLK", text), "--set", "GAIN=0.02")
    (row,) = [line for line in result.out.splitlines() if "WN" in line and ".." in line]
    assert row.endswith("! hardly any value is possible: TICKS is too large")
    assert f"{math.pi / 5 / 66:.6g} .. {math.pi / 5 / 66:.6g}" in row


def test_call_that_may_not_run_once_a_scan_is_noted(automax):
    text = """\
10 LOCAL A%, B%, N%, X@
20 CALL SCAN_LOOP(TICKS=4)
30 CALL LAG(INPUT=A%, WLG=5.0, OUTPUT=B%)
40 IF X@ THEN
50 CALL LAG(INPUT=A%, WLG=5.0, OUTPUT=B%)
60 CALL PID(INPUT=A%, FEEDBACK=B%, KP=1.0, KI=1.0, LOOP_TIME=0.11, OUTPUT=A%)
70 END_IF
80 FOR N% = 1 TO 3
90 CALL LAG(INPUT=A%, WLG=5.0, OUTPUT=B%)
100 NEXT N%
110 IF X@ THEN GOSUB 200
120 ON N% GOSUB 230
130 CALL LAG(INPUT=A%, WLG=5.0, OUTPUT=B%)
140 GOTO 300
200 A% = 5
210 CALL LAG(INPUT=A%, WLG=5.0, OUTPUT=B%)
220 RETURN
230 CALL LAG(INPUT=A%, WLG=5.0, OUTPUT=B%)
240 RETURN
300 CALL LAG(INPUT=A%, WLG=5.0, OUTPUT=B%)
310 END
"""
    found = {item["line"]: item["inside"] for item in records(automax, text)["blocks"]}
    assert found == {
        "30": None, "50": "IF", "60": "IF", "90": "FOR", "130": None, "210": "subroutine", "230": "subroutine",
        "300": None,
    }  # fmt: skip
    notes = [line.strip() for line in automax("tune-info", "T.BLK").out.splitlines() if "inside" in line]
    assert notes == [
        "inside      ! an IF: all holds only where the CALL runs once in every scan",
        "inside      ! an IF: all holds only where the CALL runs once every LOOP_TIME",
        "inside      ! a FOR: all holds only where the CALL runs once in every scan",
        "inside      ! a subroutine: all holds only where the CALL runs once in every scan",
        "inside      ! a subroutine: all holds only where the CALL runs once in every scan",
    ]


def test_file_is_needed(automax):
    assert "a FILE is missing" in automax("tune-info").err
    assert automax("tune-info", "NONE.BLK").code == 2


def test_ki_of_the_manuals_example(automax):
    result = automax("tune-info", "--ki", "1200", "2000")
    assert (result.code, result.err) == (0, "")
    assert "  write         KI=0.5950571\n" in result.out
    assert "scan time     not known" in result.out
    found = json.loads(automax("tune-info", "--ki", "1200", "2000", "--json").out)
    assert found["ki"] == pytest.approx(0.59507, rel=5e-5)
    assert found["period_s"] is None
    assert automax("tune-info", "--ki", "-1200", "-2e3").out.startswith("INTEGRATE, -1200 counts/s")


def test_ki_at_a_scan_time(automax):
    result = automax("tune-info", "--ki", "1200", "2000", "--ticks", "4", "--tick-ms", "5.5")
    assert result.out == (
        "INTEGRATE, 1200 counts/s at a constant INPUT of 2000 counts, WM not programmed\n"
        "  KI            (pi/20) / tan(pi/20) Y/X = 0.9917618 x 0.6 = 0.5950571\n"
        "  write         KI=0.5950571\n"
        "  limits        0.000343934 to 128.52 at T = 22 ms\n"
        "  Kx            KI / C = Y T / (2 X) = 0.0066, range +-8191 (section 51)\n"
        "  a scan        26.4 counts; from 0 to 8191 takes 6.826 s\n"
    )
    assert automax("tune-info", automax.write("MIX.BLK", MIX), "--ki", "1200", "2000").out == result.out
    found = json.loads(automax("tune-info", "--ki", "1200", "2000", "--ticks", "4", "--json").out)
    assert found == {
        "y_counts_per_s": 1200.0, "x_counts": 2000.0, "factor": pytest.approx(0.99176, rel=1e-5),
        "ki": pytest.approx(0.595057, rel=1e-6), "constant": "0.5950571", "period_s": 0.022,
        "low": pytest.approx(0.00137573 / 4, rel=1e-4), "high": pytest.approx(0.9 * math.pi / 0.022),
        "verdict": "within", "kx": pytest.approx(0.0066), "range_counts": 8191, "near_edge": None,
        "counts_per_scan": pytest.approx(26.4),
    }  # fmt: skip


def test_the_constant_runs_as_asked(automax):
    """The KI that is printed, in a task, gains 1200 counts in a second."""
    text = json.loads(automax("tune-info", "--ki", "1200", "2000", "--json").out)["constant"]
    line = f"40 CALL INTEGRATE(INPUT=A%, KI={text}, OUTPUT=B%)\n"
    table = "A%\n" + "2000\n" * 101
    result = automax.trace(table, "--watch", "B%", "--tick-ms", "10", task=task(line, ticks=1))
    outputs = [int(row.split(",")[-1]) for row in result.out.splitlines()[1:]]
    assert outputs[-1] - outputs[0] == 1200


def test_fastest_ki_of_all_is_given(automax):
    """0.9 pi / 0.5 ms = 5654.87."""
    assert automax("tune-info", "--ki", "5701", "1").code == 0


def test_ki_downwards_ends_at_the_low_end(automax):
    result = automax("tune-info", "--ki", "-1200", "-2000", "--ticks", "4")
    assert "a scan        -26.4 counts; from 0 to -8191 takes 6.826 s\n" in result.out


@pytest.mark.parametrize(
    ("y", "x", "shown"), [("0.0000001", "1", "9.917618E-08"), ("1000", "1", "991.7618"), ("1.008306663", "1", "1.0")]
)
def test_constant_is_a_real(automax, y, x, shown):
    assert json.loads(automax("tune-info", "--ki", y, x, "--json").out)["constant"] == shown


def test_ki_that_comes_close(automax):
    near = automax("tune-info", "--ki", "250", "2", "--ticks", "4")
    assert "128.52 at T = 22 ms  ! within 10 % of the high limit" in near.out
    assert "! Kx is within 10 % of 0.125" in automax("tune-info", "--ki", "22000", "2000", "--ticks", "4").out


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (("1200", "0"), "--ki: X is 0, and an integrator of 0 does not move"),
        (("1200", "-10"), "--ki: KI = -119.0114, but KI must be above 0: OUTPUT moves in the direction of INPUT"),
        (("0", "10"), "--ki: Y is 0, and OUTPUT would not move\n"),
        (
            ("100000", "1"),
            (
                "--ki: KI = 99176.18 is above its high limit 5654.87 (0.9 pi / T) at any scan time\n"
                "  hint: with INPUT = 1 it can be"
            ),
        ),
        (("5702", "1"), "--ki: KI = 5655.026 is above its high limit 5654.87 (0.9 pi / T) at any scan time\n"),
        (("0.0000001", "32767"), "--ki: KI = 3.026709e-12 is below its low limit 2.3092e-08 (C x 2**-18) at any"),
        (("1200", "40000"), "--ki: X = 40000 cannot be an INPUT, which is a whole number from -32768 to 32767"),
        (("1200", "0.5"), "--ki: X = 0.5 cannot be an INPUT"),
        (("1e12", "10"), "--ki: Y = 1e+12 counts/s is more than any scan time allows"),
        (("1e-12", "10"), "--ki: Y = 1e-12 counts/s is less than any scan time allows"),
        (("1200", "2000", "--tick-ms", "5.5"), "--tick-ms needs --ticks or a FILE"),
        (("1200", "2000", "--ticks", "0"), "--ticks 0: it must be 1 to 32767"),
        (("1200", "2000", "--ticks", "21", "--target", "udc"), "--ticks 21: it must be 1 to 20"),
        (
            ("1200", "2", "--ticks", "4"),
            (
                "--ki: KI = 595.0571 is above its high limit 128.52 (0.9 pi / T) at T = 22 ms\n"
                "  hint: with INPUT = 2 it can be 0.000693581 to 259.175 counts/s"
            ),
        ),
        (
            ("-0.001", "-32000", "--ticks", "4"),
            (
                "--ki: KI = 3.099256e-08 is below its low limit 0.000343934 (C x 2**-18) at T = 22 ms\n"
                "  hint: with INPUT = -32000 it can be -4.14679e+06 to -11.0973 counts/s"
            ),
        ),
    ],
)
def test_ki_that_cannot_be(automax, options, told):
    result = automax("tune-info", "--ki", *options)
    assert (result.code, result.out) == (2, "")
    assert result.err.startswith(f"automax tune-info: error: {told}")


@pytest.mark.parametrize("text", ["nan", "inf", "1_0", "ten", "-1e999"])
def test_ki_takes_numbers(automax, text):
    result = automax("tune-info", "--ki", "10", text)
    assert (result.code, result.out) == (2, "")
    assert f"argument --ki: '{text}' is " in result.err


def test_starts_without_numbers_and_pictures(tmp_path):
    (tmp_path / "MIX.BLK").write_text(MIX)
    code = (
        "import sys; from automax_ros.cli.main import main; "
        f"assert main(['tune-info', {str(tmp_path / 'MIX.BLK')!r}]) == 0; "
        f"assert main(['response', {str(tmp_path / 'MIX.BLK')!r}, '--block', '100']) == 0; "
        "assert not {'matplotlib', 'numpy', 'scipy', 'rclpy'} & set(sys.modules)"
    )
    subprocess.run([sys.executable, "-c", code], check=True, capture_output=True)
