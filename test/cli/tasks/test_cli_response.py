"""`automax response`: the tables, the JSON, the picture's data, and what it refuses."""

import csv
import json
import math
import re
import sys

import numpy as np
import pytest
from golden_text import GOLDEN, check_golden
from scipy import signal

from automax_ros.cli.tasks import response_plot
from cli.support import WRONG

MIX = (GOLDEN / "tuning" / "MIX.BLK").read_text()
T = 0.022
C = (math.pi / 10 / T) / math.tan(math.pi / 20)


def task(lines: str, ticks: int = 4) -> str:
    declared = "10 LOCAL A%, B%, GAIN, HELD@, TOP%\n20 LOCAL TUNED [CURRENT=2.0, HIGH=300.0, LOW=0.5]\n"
    return f"{declared}30 CALL SCAN_LOOP(TICKS={ticks})\n40 {lines}\n90 END\n"


def measured(automax, text, *options):
    """The record of ``--json`` for line 40."""
    result = automax("response", automax.write("T.BLK", text), "--block", "40", "--json", *options)
    assert (result.code, result.err) == (0, "")
    return json.loads(result.out)


def lag(automax, *options):
    return measured(automax, task("CALL LAG(INPUT=A%, WLG=10.0, OUTPUT=B%)"), *options)


def test_tables_for_an_engineer(automax):
    result = automax("response", automax.write("MIX.BLK", MIX), "--block", "170.2", "--duration", "200")
    assert (result.code, result.err) == (0, "")
    check_golden(GOLDEN / "tuning" / "response.expected.txt", result.out)


def test_json_schema(automax):
    found = lag(automax)
    assert list(found) == [
        "file", "line", "block", "output", "period_s", "nyquist_rad_s", "laplace", "remarks", "marks", "step", "bode",
    ]  # fmt: skip
    assert (found["line"], found["block"], found["output"], found["period_s"]) == ("40", "LAG", "B%", 0.022)
    assert {item["name"]: item["rad_s"] for item in found["marks"]} == {
        "WLG": 10.0,
        "WM": pytest.approx(math.pi / 10 / T),
        "Nyquist": pytest.approx(math.pi / T),
    }
    assert list(found["step"]) == [
        "counts", "final", "overshoot", "settling_s", "settling_band_counts", "rate_counts_per_s", "touched", "samples",
    ]  # fmt: skip
    assert list(found["step"]["samples"][0]) == ["t_s", "measured", "discrete", "laplace"]
    assert list(found["bode"][0]) == [
        "rad_s", "hz", "mark", "amplitude", "measured", "discrete", "laplace", "measured_deg", "discrete_deg",
        "laplace_deg", "uncertainty_db", "uncertainty_deg", "reliable",
    ]  # fmt: skip


def test_lag_is_scipys_filter(automax):
    found = lag(automax, "--amplitude", "4095", "--step", "3000", "--duration", "1.1")
    b, a = signal.bilinear([1.0], [0.1, 1.0], fs=C / 2)
    step = found["step"]
    assert len(step["samples"]) == 51
    design = 3000 * signal.lfilter(b, a, np.ones(51))
    assert [item["measured"] for item in step["samples"]] == pytest.approx(list(design), abs=0.501)
    assert [item["discrete"] for item in step["samples"]] == pytest.approx(list(design))
    ideal = [3000 * (1 - math.exp(-10.0 * item["t_s"])) for item in step["samples"]]
    assert [item["laplace"] for item in step["samples"]] == pytest.approx(ideal, abs=1e-6)
    assert (step["final"], step["overshoot"]) == (3000, 0.0)
    assert step["settling_s"] == pytest.approx(math.log(50) / 10.0, abs=T)
    assert [item["mark"] for item in found["bode"] if item["mark"]] == ["WLG", "WM"]
    for item in found["bode"]:
        _, (gain,) = signal.freqz(b, a, worN=[item["rad_s"] * T])
        assert item["reliable"]
        assert item["measured"] == pytest.approx(20 * math.log10(abs(gain)), abs=0.1)
        assert item["measured_deg"] == pytest.approx(math.degrees(np.angle(gain)), abs=1.0)
        assert item["laplace"] == pytest.approx(-10 * math.log10(1 + (item["rad_s"] / 10.0) ** 2), abs=1e-9)


def test_pid_is_driven_in_error_at_its_loop_time(automax):
    line = "CALL PID(INPUT=A%, FEEDBACK=B%, KP=2.0, KI=1.0, LOOP_TIME=0.11, {}OUTPUT=A%)"
    plain = measured(automax, task(line.format("")))
    assert plain["period_s"] == pytest.approx(0.11)
    assert plain["nyquist_rad_s"] == pytest.approx(math.pi / 0.11)
    assert plain["remarks"] == ["from ERROR to OUTPUT: INPUT moves, FEEDBACK is 0"]
    turned = measured(automax, task(line.format("ACTION=TRUE, DERIVATIVE=TRUE, ")))
    assert "the D term sees only FEEDBACK: FEEDBACK moves, INPUT is 0" in turned["remarks"][0]
    assert "ACTION is TRUE" in turned["remarks"][1]
    assert turned["bode"] == plain["bode"]
    assert plain["step"]["final"] is None
    rate = plain["step"]["counts"] * 1.0
    assert plain["step"]["rate_counts_per_s"] == pytest.approx(rate, rel=0.01)


def test_integrator_stays_off_its_range_unless_it_is_told_to_go_there(automax):
    text = task("CALL INTEGRATE(INPUT=A%, KI=2.0, OUTPUT=B%)")
    free = measured(automax, text)
    assert all(item["reliable"] for item in free["bode"])
    assert free["step"]["touched"] == []
    forced = automax("response", "T.BLK", "--block", "40", "--amplitude", "4095", "--step", "4095")
    assert "! it runs into the integrator's range +-8191 (section 51)" in forced.out
    assert "~ limit: the block runs into the integrator's range +-8191 (section 51); a smaller" in forced.out


def test_a_step_that_only_settles_at_16_bits_runs_into_nothing(automax):
    line = task("CALL {}(INPUT=A%, {}, OUTPUT=B%)")
    for block, parameter in (("LAG", "WLG=40.0"), ("DIFF_LAG", "WLG=40.0")):
        for step in ("32767", "-32767"):
            text = line.format(block, parameter)
            assert measured(automax, text, "--step", step, "--points", "2")["step"]["touched"] == []
    beyond = measured(automax, line.format("PROP_INT", "KP=2.0, WLD=1.0"), "--step", "32767", "--points", "2")
    assert "16 bits" in beyond["step"]["touched"]
    limited = line.format("LAG", "WLG=40.0, RESET=HELD@")
    assert measured(automax, limited, "--step", "-32767", "--points", "2")["step"]["final"] == -32767


@pytest.mark.parametrize(
    ("options", "line", "advised"),
    [
        (("--amplitude", "3000"), "KP=2.0, MAX_CHANGE=100", True),
        (("--amplitude", "1"), "KP=9.0, MAX_CHANGE=1", False),
        (("--amplitude", "3000"), "KP=2.0, MAX_CHANGE=TOP%", False),
    ],
)
def test_smaller_sines_are_advised_only_where_they_help(automax, options, line, advised):
    text = task(f"CALL PID(INPUT=A%, FEEDBACK=B%, KI=0.0, LOOP_TIME=0.022, {line}, OUTPUT=A%)")
    more = ("--set", "TOP%=0") if "TOP%" in line else ()
    result = automax("response", automax.write("T.BLK", text), "--block", "40", "--points", "3", *options, *more)
    assert result.code == 0
    (told,) = [row for row in result.out.splitlines() if row.startswith("~ limit: the block runs into MAX_CHANGE")]
    assert told.endswith("; a smaller --amplitude may avoid it") is advised


def test_rate_is_of_what_goes_on_only(automax):
    assert lag(automax, "--points", "2")["step"]["rate_counts_per_s"] is None
    text = task("CALL INTEGRATE(INPUT=A%, KI=2.0, OUTPUT=B%)")
    found = measured(automax, text, "--points", "2", "--step", "100")
    assert found["step"]["rate_counts_per_s"] == pytest.approx(200.0 / 0.99176, rel=0.02)


def test_feed_forward_and_change_are_at_rest_before_the_step(automax):
    line = (
        "CALL PID(INPUT=A%, FEEDBACK=B%, KP=1.0, KI=0.0, LOOP_TIME=0.022, FEED_FORWARD=5000, MAX_CHANGE=50, OUTPUT=A%)"
    )
    found = measured(automax, task(line), "--step", "40")
    assert [item["measured"] for item in found["step"]["samples"]] == [5040] * len(found["step"]["samples"])
    assert all(item["measured"] == pytest.approx(0.0, abs=0.2) for item in found["bode"] if item["reliable"])
    assert any(item["reliable"] for item in found["bode"])


def test_few_counts_are_marked(automax):
    text = task("CALL LAG(INPUT=A%, WLG=0.02, OUTPUT=B%)")
    found = measured(automax, text, "--amplitude", "100")
    assert [item["reliable"] for item in found["bode"]] == sorted([item["reliable"] for item in found["bode"]])[::-1]
    doubtful = [item for item in found["bode"] if not item["reliable"]]
    assert doubtful
    assert all(item["uncertainty_db"] is None or item["uncertainty_db"] >= 0.5 for item in doubtful)
    result = automax("response", "T.BLK", "--block", "40", "--amplitude", "100")
    assert "~ few counts come out: rounding to whole counts leaves 0.5 dB or more uncertain" in result.out


def test_unknown_limits_and_switches_are_as_if_not_programmed(automax):
    text = task("CALL INTEGRATE(INPUT=A%, KI=2.0, RESET=-HELD@, LIMIT_PLUS=TOP%, OUTPUT=B%)")
    found = measured(automax, text)
    (remark,) = found["remarks"]
    assert remark == (
        "values not known, taken as if not programmed: LIMIT_PLUS = 32767 (TOP%), RESET = FALSE (-HELD@); "
        "--set gives others"
    )
    limited = measured(automax, text, "--set", "TOP%=100", "--set", "HELD@=TRUE", "--step", "4095")
    assert limited["remarks"] == []
    assert limited["step"]["touched"] == ["LIMIT_PLUS 100"]
    held = automax("response", "T.BLK", "--block", "40", "--set", "HELD@=0")
    assert held.err == "automax response: error: 40 INTEGRATE -> B%: RESET is TRUE, OUTPUT stays where it is\n"


def test_value_in_force_is_told(automax):
    found = measured(automax, task("CALL LAG(INPUT=A%, WLG=TUNED, OUTPUT=B%)"), "--set", "TUNED=300")
    (remark,) = found["remarks"]
    assert remark.startswith("beyond its limits, so in force is WLG = 64.013")


def test_slow_block_is_measured_where_it_can_be(automax):
    result = automax(
        "response",
        automax.write("T.BLK", task("CALL LAG(INPUT=A%, WLG=0.0004, OUTPUT=B%)")),
        "--block", "40", "--points", "3", "--from", "0.00000001", "--to", "100", "--duration", "10",
    )  # fmt: skip
    assert result.code == 0
    assert "- not measured (1): so slow that it would take millions of scans" in result.out
    assert "does not settle in this time" in result.out


def test_table(automax):
    result = automax("response", automax.write("MIX.BLK", MIX), "--block", "100", "--csv", "out.csv")
    assert result.code == 0
    assert result.out.startswith("MIX.BLK 100 LAG -> B%: 1 / (1 + s/10)\n")
    with (automax.folder / "out.csv").open(encoding="utf-8") as stream:
        rows = list(csv.DictReader(stream))
    steps = [row for row in rows if row["response"] == "step"]
    bode = [row for row in rows if row["response"] == "bode"]
    assert (steps[0]["t_s"], steps[0]["measured"]) == ("0", "409")
    assert {row["mark"] for row in bode} == {"", "WLG", "WM"}
    assert float(bode[0]["measured"]) == pytest.approx(float(bode[0]["discrete"]), abs=0.01)
    assert {row["reliable"] for row in bode} == {"1"}


def test_picture_has_the_data(automax, monkeypatch):
    pytest.importorskip("matplotlib")
    draw = response_plot.figure_of
    seen = []
    monkeypatch.setattr(response_plot, "figure_of", lambda response: seen.append(response) or draw(response))
    path = automax.write("T.BLK", task("CALL LAG(INPUT=A%, WLG=0.5, OUTPUT=B%)"))
    result = automax("response", path, "--block", "40", "--amplitude", "500", "--output", "lag.png")
    assert (result.code, result.err) == (0, "")
    picture = (automax.folder / "lag.png").read_bytes()
    assert picture.startswith(b"\x89PNG")
    assert len(picture) > 20_000
    (response,) = seen
    time, gain, phase = draw(response).axes
    by_label = {line.get_label(): line for line in time.lines}
    assert list(by_label["OUTPUT as it runs"].get_ydata()) == list(response.step.output)
    assert list(by_label["OUTPUT as it runs"].get_xdata()) == pytest.approx(
        [n * T for n in range(len(response.step.output))]
    )
    by_label = {line.get_label(): line for line in gain.lines}
    solid = [point for point in response.points if point.measured.reliable]
    assert list(by_label["measured"].get_xdata()) == [point.rad_s for point in solid]
    assert by_label["measured"].get_markerfacecolor() == "black"
    (hollow,) = gain.containers
    assert hollow.lines[0].get_markerfacecolor() == "none"
    assert len(hollow.lines[0].get_xdata()) == len(response.points) - len(solid) > 0
    curve = by_label["discrete, not rounded"]
    x, y = np.array(curve.get_xdata()), np.array(curve.get_ydata())
    assert y == pytest.approx([20 * math.log10(abs(response.transfer.discrete_response(w))) for w in x])
    upright = [line.get_xdata() for line in gain.lines if len(set(line.get_xdata())) == 1]
    wlg, wm, nyquist = (places[0] for places in upright)
    assert (wlg, wm, nyquist) == (0.5, pytest.approx(math.pi / 10 / T), pytest.approx(math.pi / T))
    assert {text.get_text() for text in gain.texts} == {"WLG", "WM", "Nyquist"}
    assert gain.get_xscale() == phase.get_xscale() == "log"


@pytest.mark.parametrize("suffix", ["svg", "pdf"])
def test_other_pictures_are_the_same_every_time(automax, suffix):
    pytest.importorskip("matplotlib")
    path = automax.write("MIX.BLK", MIX)
    for name in ("one", "two"):
        assert automax("response", path, "--block", "150", "--output", f"{name}.{suffix}").code == 0
    one, two = ((automax.folder / f"{name}.{suffix}").read_bytes() for name in ("one", "two"))
    assert len(one) > 5000
    assert one == two


@pytest.mark.parametrize("block", ["100", "110", "120", "130", "150", "160"])
def test_every_block_can_be_drawn(automax, block):
    pytest.importorskip("matplotlib")
    result = automax(
        "response", automax.write("MIX.BLK", MIX), "--block", block, "--output", "plot.png", "--points", "4"
    )
    assert (result.code, result.err) == (0, "")
    assert (automax.folder / "plot.png").stat().st_size > 20_000


def test_gains_of_zero_can_be_drawn_and_shown(automax):
    pytest.importorskip("matplotlib")
    text = task("CALL PID(INPUT=A%, FEEDBACK=B%, KP=0.0, KI=0.0, LOOP_TIME=0.022, OUTPUT=A%)")
    found = measured(automax, text, "--output", "plot.png", "--points", "3")
    assert [item["measured"] for item in found["bode"]] == [None, None, None]
    assert "none" in automax("response", "T.BLK", "--block", "40", "--points", "3").out


@pytest.mark.parametrize(
    "line",
    [
        "CALL PID(INPUT=A%, FEEDBACK=B%, KP=9.0E18, KI=9.0E18, KD=9.0E18, LOOP_TIME=0.022, OUTPUT=A%)",
        "CALL PID(INPUT=A%, FEEDBACK=B%, KP=1.0E-19, KI=9.0E18, LOOP_TIME=9.0E18, OUTPUT=A%)",
        "CALL INTEGRATE(INPUT=A%, KI=1.0, LIMIT_PLUS=5, LIMIT_MINUS=5, OUTPUT=B%)",
    ],
)
def test_extreme_values_end_without_a_fault(automax, line):
    assert automax("response", automax.write("T.BLK", task(line)), "--block", "40", "--points", "3").code == 0


@pytest.mark.parametrize(
    ("options", "told"),
    [
        (("--block", "999"), "--block 999: there is no block on this line\n  hint: dynamic blocks are 100 LAG, "),
        (("--block", "170"), "--block 170: that is not a dynamic block\n  hint: dynamic blocks are 100 LAG, "),
        (("--block", "140"), "140 PROP_INT -> E%: the value of WLD = GAIN is not known\n  hint: give --set GAIN=VALUE"),
        (("--block", "140", "--set", "GAIM=1"), "--set: the task has no variable 'GAIM'\n  hint: did you mean GAIN?"),
        (("--block", "140", "--set", "KP1=0.1"), "--set KP1: 0.1 is beyond its tuning limits, 0.5 to 10.0"),
        (("--block", "140", "--set", "GAIN=nan"), "--set: 'nan' is not a value for GAIN, type REAL"),
        (("--block", "140", "--set", "A%=1"), "--set A%: it carries the signal, INPUT of 140 PROP_INT\n"),
        (("--block", "140", "--set", "GAIN=1", "--set", "GAIN=1"), "--set GAIN is given twice"),
        (("--block", "140.0"), "--block '140.0' is not a BASIC line such as 210 or 210.2"),
        (("--block", "100", "--amplitude", "0"), "--amplitude 0: it must be 1 to 32767 counts"),
        (("--block", "100", "--amplitude", "32768"), "--amplitude 32768: it must be 1 to 32767 counts"),
        (("--block", "100", "--step", "0"), "--step 0: it must be 1 to 32767 counts"),
        (("--block", "100", "--step", "-32768"), "--step -32768: it must be 1 to 32767 counts"),
        (("--block", "100", "--points", "1"), "--points 1: it must be 2 to 500"),
        (("--block", "100", "--from", "5", "--to", "2"), "--from 5 must be below --to 2"),
        (("--block", "100", "--from", "0"), "--from 0: it must be a number above 0"),
        (("--block", "100", "--to", "143"), "--to 143: it must be below the Nyquist frequency, 142.8 rad/s"),
        (("--block", "100", "--from", "200"), "--from 200: it must be below the Nyquist frequency"),
        (("--block", "100", "--from", "140"), "--from 140: without --to the highest frequency is 135.66 rad/s"),
        (("--block", "100", "--duration", "0.01"), "--duration 0.01: it must be 0.022 to 11000 s"),
        (("--block", "100", "--duration", "1e9"), "--duration 1e+09: it must be 0.022 to 11000 s"),
        (("--block", "100", "--output", "plot.jpg"), "--output plot.jpg: a picture ends in .png, .svg, .pdf"),
        (("--block", "100", "--output", "none/plot.png"), "none/plot.png cannot be written: No such file"),
        (("--block", "100", "--csv", "none/out.csv"), "none/out.csv cannot be written: No such file"),
        (("--block", "100", "--csv", "MIX.BLK"), "--csv and FILE are the same file, MIX.BLK"),
    ],
)
def test_wrong_usage(automax, options, told):
    result = automax("response", automax.write("MIX.BLK", MIX), *options)
    assert (result.code, result.out) == (2, "")
    assert result.err.startswith(f"automax response: error: {told}")
    assert (automax.folder / "MIX.BLK").read_text() == MIX


@pytest.mark.parametrize(
    ("option", "text"), [("--from", "nan"), ("--duration", "inf"), ("--duration", "1_0"), ("--step", "1_0")]
)
def test_numbers_have_one_spelling(automax, option, text):
    result = automax("response", automax.write("MIX.BLK", MIX), "--block", "100", option, text)
    assert (result.code, result.out) == (2, "")
    assert f"argument {option}: '{text}' is not a " in result.err


def test_thermal_overload_has_no_frequency_response(automax):
    text = (
        "10 COMMON IFB%, OVL@\n20 CALL SCAN_LOOP(TICKS=20)\n"
        "30 CALL THERMAL_OVERLOAD(I_FDBK=IFB%, OVERLOAD=OVL@)\n40 END\n"
    )
    result = automax("response", automax.write("T.BLK", text), "--target", "udc", "--block", "30")
    assert result.code == 2
    assert "it squares its input and has no frequency response" in result.err


def test_task_without_dynamic_blocks(automax):
    text = "10 LOCAL A%, B%\n20 CALL SCAN_LOOP(TICKS=4)\n30 CALL INVERTER(INPUT=A%, OUTPUT=B%)\n40 END\n"
    result = automax("response", automax.write("T.BLK", text), "--block", "30")
    assert result.err.endswith("--block 30: that is not a dynamic block\n  hint: the task has no dynamic block\n")


def test_task_with_errors_shows_what_check_shows(automax):
    result = automax("response", automax.write("T.BLK", WRONG), "--block", "20")
    assert (result.code, result.out) == (1, "")
    assert result.err == automax("check", "T.BLK").out


def test_without_matplotlib_it_says_what_to_do(automax, monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    result = automax("response", automax.write("MIX.BLK", MIX), "--block", "100", "--output", "plot.png")
    assert result.code == 2
    assert "--output needs matplotlib" in result.err


def test_docs_show_what_is_printed(automax):
    """Every example of docs/tuning.md, run on the task that stands in it."""
    text = (GOLDEN.parent.parent / "docs" / "tuning.md").read_text(encoding="utf-8")
    blocks = [part.removesuffix("```") for part in text.split("```")[1::2]]
    automax.write("SPEED.BLK", blocks[0].removeprefix("blk SPEED.BLK\n"))
    for block in blocks[1:]:
        command, _, shown = re.sub(r"^console.*\n", "", block).strip("\n").partition("\n")
        result = automax(*command.removeprefix("$ automax ").split())
        assert (result.out + result.err).rstrip("\n") == shown
