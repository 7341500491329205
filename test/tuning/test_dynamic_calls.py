"""The dynamic blocks of a task as a library finds them: by line, with the values that are known."""

import pytest

from automax_ros.blocks.catalogue import CATALOGUE
from automax_ros.core.diagnostics import SourceText
from automax_ros.language.checks.checker import check
from automax_ros.tuning.dynamic_calls import (
    CallFault,
    NoDynamicBlock,
    Source,
    ValueFault,
    dynamic_calls,
    require_running,
    tuning_of,
)

TEXT = """\
10 LOCAL A%, B%, GAIN, HELD@
20 LOCAL TUNED [CURRENT=2.0, HIGH=10.0, LOW=0.5]
30 CALL SCAN_LOOP(TICKS=4)
40 CALL LAG(INPUT=A%, WLG=TUNED, RESET=-HELD@, OUTPUT=B%)
50 CALL SUMMER(INPUT1=A%, INPUT2=B%, OUTPUT=B%) \\ CALL INTEGRATE(INPUT=A%, KI=GAIN, OUTPUT=B%)
60 IF HELD@ THEN CALL PID(INPUT=A%, FEEDBACK=B%, KP=GAIN, KI=1.0, LOOP_TIME=0.03125, OUTPUT=B%)
70 END
"""


@pytest.fixture(scope="module")
def program():
    return check(SourceText("t.blk", TEXT), name="T", catalogue=CATALOGUE).program


def test_all_in_the_order_of_the_text(program):
    calls = dynamic_calls(program, {}, None)
    assert [call.title for call in calls] == ["40 LAG -> B%", "50.2 INTEGRATE -> B%", "60 PID -> B%"]
    assert [call.inside for call in calls] == ["", "", "IF"]
    assert [call.coefficients for call in calls] == [
        {"WLG": 2.0},
        {"KI": None},
        {"KP": None, "KI": 1.0, "LOOP_TIME": 0.03125},
    ]


def test_values_reach_every_block_that_takes_them(program):
    calls = dynamic_calls(program, {"GAIN": 3.0, "TUNED": 7.0}, None)
    assert calls[0].parameters["WLG"].source is Source.SET
    assert [tuning_of(call, program).laplace for call in calls] == ["1 / (1 + s/7)", "3 / s", "3 + 1/s"]


def test_inverted_variables_are_what_the_block_sees(program):
    (lag,) = dynamic_calls(program, {"HELD@": True}, "40", driven=True)
    assert lag.parameters["RESET"].value is False
    require_running(lag)
    (lag,) = dynamic_calls(program, {"HELD@": False}, "40", driven=True)
    with pytest.raises(CallFault, match="40 LAG -> B%: RESET is TRUE, OUTPUT stays where it is"):
        require_running(lag)


def test_standing_inputs_are_all_but_the_signal(program):
    (pid,) = dynamic_calls(program, {"GAIN": 2.0}, "60", driven=True)
    assert pid.standing_inputs() == ({"KP": 2.0, "KI": 1.0, "LOOP_TIME": 0.03125}, [])
    (lag,) = dynamic_calls(program, {}, "40", driven=True)
    assert lag.standing_inputs() == ({"WLG": 2.0, "RESET": False}, ["RESET = FALSE (-HELD@)"])


@pytest.mark.parametrize(
    ("values", "label", "fault", "message"),
    [
        ({}, "50", NoDynamicBlock, "50: that is not a dynamic block"),
        ({}, "45", NoDynamicBlock, "45: there is no block on this line"),
        ({}, "LAG", NoDynamicBlock, "'LAG' is not a BASIC line"),
        ({"A%": 1}, "40", ValueFault, "A%: it carries the signal, INPUT of 40 LAG"),
        ({"GAIN": 1.0}, "40", ValueFault, "GAIN: the block does not take it"),
        ({"HELD@": True}, None, ValueFault, "HELD@: it is RESET of 40 LAG, no coefficient"),
    ],
)
def test_faults_say_what_is_wrong(program, values, label, fault, message):
    with pytest.raises(fault) as caught:
        dynamic_calls(program, values, label)
    assert caught.value.message.startswith(message)
