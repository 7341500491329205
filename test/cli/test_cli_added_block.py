"""A dynamic block declared in this file alone: nothing knows a block but its declaration, so all tools take it."""

import importlib.util
import json
import math
from pathlib import Path

import pytest

from automax_ros.blocks.catalogue import CATALOGUE, Family
from automax_ros.blocks.declare.coefficients import mapping_constant, no_defaults, per_period
from automax_ros.blocks.declare.declaration import (
    Block,
    BlockTimes,
    Coefficients,
    Form,
    Input,
    Limit,
    Output,
    State,
    Time,
)
from automax_ros.blocks.declare.dynamics import Dynamics, Integrator, corners_at, mapped
from automax_ros.blocks.examples import Example
from automax_ros.core.numbers import clamp16, round_count
from automax_ros.core.types import DataType
from cli.support import columns_of


def all_pass_coefficients(period_s, values):
    k = values["WC"] / mapping_constant(values["WC"], period_s)
    return ((k - 1.0) / (k + 1.0),)


def all_pass_transfer(period_s, values):
    w = values["WC"]
    return mapped((-1.0, w), (1.0, w), mapping_constant(w, period_s), period_s)


def all_pass_step(signal: int, bypass: bool, gain: float, x1: int, y1: float) -> tuple[int, int, float]:
    """Direct form I; the output alone is clamped to 16 bits."""
    y1 = signal + 0.0 if bypass else gain * (signal - y1) + x1
    result = clamp16(round_count(y1))
    x1 = signal
    return result, x1, y1


ALL_PASS = Block(
    name="ALL_PASS",
    section="99",
    title="All-pass filter",
    function="(WC - s) / (WC + s)",
    inputs=(
        Input("SIGNAL", DataType.INTEGER, "S", "signal input", required=True, form=Form.VARIABLE),
        Input("WC", DataType.REAL, "WC", "frequency in rad/s at which it turns by 90 degrees", required=True),
        Input("BYPASS", DataType.BOOLEAN, "B", "TRUE lets the signal through as it is", default=False),
    ),
    outputs=(Output("RESULT", DataType.INTEGER, "R", "the signal, later"),),
    states=(State("x1", DataType.INTEGER, 0), State("y1", DataType.REAL, 0.0)),
    coefficients=Coefficients(
        parameters=("WC",),
        names=("gain",),
        limits=(Limit("WC", per_period(0.001), per_period(1.0), "0.001 / T", "1 / T"),),
        defaults=no_defaults,
        compute=all_pass_coefficients,
        dynamics=Dynamics(
            transfer=all_pass_transfer,
            laplace="({WC:.6g} - s) / ({WC:.6g} + s)".format_map,
            equation="y = gain (x - y1) + x1".format_map,
            corners=corners_at("WC"),
            exact_at="WC",
            integrator=Integrator("y1"),
            signals=("SIGNAL",),
            carrier=lambda _inputs: ("SIGNAL", 1),
            output="RESULT",
            stopped_by=(("BYPASS", "RESULT is SIGNAL"),),
            remarks=lambda _inputs: ["the gain is 1 at all frequencies"],
        ),
    ),
    times=BlockTimes(Time(20.0), Time(80.0), Time(30.0), Time(14.0)),
    notes=("It turns the phase and leaves the gain.",),
    step=all_pass_step,
)
EXAMPLE = Example("ALL_PASS", "A step.", {"SIGNAL": (1000,) * 8}, {"WC": 10.0}, ("RESULT",))

TASK = """\
10 LOCAL A%, B%, W
20 LOCAL TUNED [CURRENT=5.0, HIGH=9.0, LOW=1.0]
30 CALL SCAN_LOOP(TICKS=4)
40 CALL ALL_PASS(SIGNAL=A%, WC=10.0, RESULT=B%)
50 CALL ALL_PASS(SIGNAL=A%, WC=W, BYPASS=TRUE, RESULT=B%)
60 CALL ALL_PASS(SIGNAL=A%, WC=TUNED, RESULT=B%)
70 END
"""
SHORT = "10 LOCAL A%, B%\n20 CALL SCAN_LOOP(TICKS=4)\n30 CALL ALL_PASS(SIGNAL=A%, WC=10.0, RESULT=B%)\n40 END\n"
T = 0.022


@pytest.fixture
def added(monkeypatch, automax):
    monkeypatch.setitem(CATALOGUE, ALL_PASS.name, ALL_PASS)
    return automax


def test_without_it_the_block_is_unknown(automax):
    result = automax("check", automax.write("T.BLK", SHORT))
    assert result.code == 1
    assert "there is no block ALL_PASS" in result.out + result.err


def test_check_takes_it_with_its_limits(added):
    assert added("check", added.write("T.BLK", SHORT)).code == 0
    wrong = added("check", added.write("T.BLK", SHORT.replace("10.0", "60.0")))
    assert wrong.code == 1
    assert "WC = 60 is above its high limit 45.45455 (1 / T, T = 22 ms)" in wrong.out + wrong.err


def test_trace_runs_it_compiled(added):
    result = added.trace("A%\n" + "1000\n" * 50, task=SHORT)
    k = math.tan(5.0 * T)
    gain, x1, y1, expected = (k - 1.0) / (k + 1.0), 0, 0.0, []
    for _ in range(50):
        y1 = gain * (1000 - y1) + x1
        x1 = 1000
        expected.append(math.floor(y1 + 0.5) if y1 >= 0.0 else -math.floor(0.5 - y1))
    assert [int(cell) for cell in columns_of(result.out)["B%"]] == expected


def test_compile_prints_it(added):
    result = added("compile", added.write("T.BLK", SHORT))
    assert result.code == 0
    assert "b30_y1 = " in result.out


def test_tune_info_tells_what_it_means(added):
    result = added("tune-info", added.write("T.BLK", TASK))
    assert result.code == 0
    for text in (
        "40 ALL_PASS -> B%   (section 99)",
        "(10 - s) / (10 + s)",
        "y = gain (x - y1) + x1",
        "exact at WC itself",
        "(0.001 / T .. 1 / T)",
        "WC = W, 0 at first: give --set W=VALUE",
        "WC = TUNED = 5.0, its CURRENT",
    ):
        assert text in result.out
    (block, *_) = json.loads(added("tune-info", "T.BLK", "--json").out)["blocks"]
    assert block["discrete"]["b"] == pytest.approx([block["discrete"]["a"][1], 1.0])


def test_response_drives_it_by_its_own_input(added):
    result = added("response", added.write("T.BLK", TASK), "--block", "40", "--json")
    assert result.code == 0
    found = json.loads(result.out)
    assert found["remarks"] == ["the gain is 1 at all frequencies"]
    assert found["step"]["final"] == pytest.approx(found["step"]["counts"])
    at_corner = next(point for point in found["bode"] if point["mark"] == "WC")
    assert at_corner["measured"] == pytest.approx(0.0, abs=0.02)
    assert at_corner["measured_deg"] == pytest.approx(-90.0, abs=0.5)


def test_response_says_what_stops_it_and_what_carries_the_signal(added):
    task = added.write("T.BLK", TASK)
    stopped = added("response", task, "--block", "50", "--set", "W=3")
    assert stopped.code == 2
    assert "BYPASS is TRUE, RESULT is SIGNAL" in stopped.err
    signal = added("response", task, "--block", "40", "--set", "A%=3")
    assert "it carries the signal, SIGNAL of 40 ALL_PASS" in signal.err


def test_blocks_describes_it(added):
    text = added("blocks", "ALL_PASS").out
    assert "ALL_PASS: All-pass filter" in text
    assert "nnnnn CALL ALL_PASS(SIGNAL=signal%," in text
    assert "ALL_PASS" in added("blocks").out


def test_the_pages_describe_it_with_its_example(added):
    tool = Path(__file__).resolve().parents[2] / "tools" / "generate_block_pages.py"
    spec = importlib.util.spec_from_file_location("generate_block_pages", tool)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    pages = module.pages([Family("added", "Added", "One more block.", (ALL_PASS,))], [EXAMPLE])
    assert "[ALL_PASS](added.md#all_pass)" in pages["README.md"]
    assert "It turns the phase and leaves the gain." in pages["added.md"]
    assert "| 1 | 1000 | -801 |" in pages["added.md"]  # 1000 (k - 1)/(k + 1) with k = tan(10 x 0.022 / 2)
