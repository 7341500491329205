"""How the parameters of the filters and controllers may be written, and on which Processors they run (41 to 50)."""

import pytest
from language.check_support import errors_of, task

from automax_ros.blocks.declare.declaration import Platform

FEWEST = {
    "LAG": "INPUT=A%, WLG=1.0, OUTPUT=B%",
    "DIFF_LAG": "INPUT=A%, WLG=1.0, OUTPUT=B%",
    "LEAD_LAG": "INPUT=A%, WLD=1.0, WLG=5.0, OUTPUT=B%",
    "INTEGRATE": "INPUT=A%, KI=1.0, OUTPUT=B%",
    "PROP_INT": "INPUT=A%, KP=1.0, WLD=1.0, OUTPUT=B%",
    "NOTCH": "INPUT=A%, Q_FACTOR=1.0, WN=10.0, OUTPUT=B%",
    "NOTCHN": "INPUT=A%, Q_FACTOR=1.0, WN=200.0, OUTPUT=B%",
    "HIGH_PASS_FILTER": "INPUT=A%, WLD=100.0, OUTPUT=B%",
    "LOW_PASS_FILTER": "INPUT=A%, WLG=100.0, OUTPUT=B%",
    "PID": "KP=1.0, KI=1.0, LOOP_TIME=0.05, INPUT=A%, FEEDBACK=B%, OUTPUT=C%",
}
"""The parameters that a block needs: none can be left out."""
LAGS = ("LAG", "DIFF_LAG", "LEAD_LAG")
FILTERS = ("HIGH_PASS_FILTER", "LOW_PASS_FILTER")
ON_UDC_ALONE = ("NOTCHN", *FILTERS)
NOT_ON_UDC = ("NOTCH", "PID")


def parameters(text):
    return dict(item.split("=") for item in text.split(", "))


def found(name, given):
    """The errors of a CALL on a Processor that runs the block."""
    target, tick_ns = (Platform.UDC, 500_000) if name in ON_UDC_ALONE else (Platform.AUTOMAX, 5_500_000)
    call = ", ".join(f"{keyword}={value}" for keyword, value in given.items())
    text = task(f"CALL {name}({call})", declare="LOCAL A%, B%, C%, D%, R, X@, T%(10)")
    return errors_of(text, target=target, tick_ns=tick_ns)


@pytest.mark.parametrize("target", list(Platform))
@pytest.mark.parametrize("name", FEWEST)
def test_where_it_runs(name, target):
    refused = name in (NOT_ON_UDC if target is Platform.UDC else ON_UDC_ALONE)
    text = task(f"CALL {name}({FEWEST[name]})")
    assert errors_of(text, target=target, tick_ns=500_000) == (["AMX4071"] if refused else [])


@pytest.mark.parametrize(("name", "missing"), [(name, item) for name in FEWEST for item in parameters(FEWEST[name])])
def test_a_parameter_that_is_needed(name, missing):
    given = parameters(FEWEST[name])
    del given[missing]
    assert found(name, given) == ["AMX4074"]


@pytest.mark.parametrize(
    ("code", "changes", "names"),
    [
        ("AMX4075", "INPUT=5", (*LAGS, "NOTCH", "PID")),
        (None, "INPUT=5", ("INTEGRATE", "PROP_INT", *ON_UDC_ALONE)),
        ("AMX4076", "WM=R", (*LAGS, "INTEGRATE", "PROP_INT")),
        ("AMX2016", "WLG=1", ("DIFF_LAG", "LOW_PASS_FILTER")),
        ("AMX2016", "WLD=1", ("LEAD_LAG", "PROP_INT", "HIGH_PASS_FILTER")),
        ("AMX2016", "KI=1", ("INTEGRATE", "PID")),
        ("AMX2016", "KP=1", ("PROP_INT", "PID")),
        ("AMX2016", "Q_FACTOR=1", ("NOTCH", "NOTCHN")),
        ("AMX2016", "WN=200", ("NOTCH", "NOTCHN")),
        ("AMX2016", "KD=1", ("PID",)),
        ("AMX2016", "LOOP_TIME=1", ("PID",)),
        # Q_FACTOR is REAL by the text; the % of the printed statement is a misprint.
        ("AMX2015", "Q_FACTOR=A%", ("NOTCHN",)),
        ("AMX4072", "INITIAL_VALUE=5", ("NOTCH",)),
        ("AMX4072", "WM=10.0", ("NOTCH", *FILTERS)),
        ("AMX4080", "ORDER=1", ("NOTCHN",)),
        ("AMX4080", "ORDER=3", ("NOTCHN",)),
        ("AMX4080", "ORDER=0", FILTERS),
        ("AMX4080", "ORDER=4", FILTERS),
        ("AMX4076", "ORDER=C%", ON_UDC_ALONE),
        ("AMX4076", "ISA=X@", ("PID",)),
        ("AMX4076", "ACTION=X@", ("PID",)),
        ("AMX4076", "DERIVATIVE=X@", ("PID",)),
        ("AMX4076", "LOOP_TIME=R", ("PID",)),
        ("AMX4075", "FEEDBACK=5", ("PID",)),
        ("AMX4075", "HOLD_PLUS=TRUE", ("PID",)),
        ("AMX4075", "HOLD_MINUS=FALSE", ("PID",)),
        ("AMX4080", "DEAD_BAND=-1", ("PID",)),
        ("AMX4080", "MAX_CHANGE=0", ("PID",)),
        (None, "WLG=R, WM=10.0, INITIAL_VALUE=-5, RESET=X@", LAGS),
        (None, "INPUT=T%(3), WLG=R, INITIAL_VALUE=C%, RESET=-X@", LAGS),
        (None, "WLD=R, WLG=R", ("LEAD_LAG",)),
        (None, "INPUT=T%(3), WM=10.0, INITIAL_VALUE=C%, RESET=-X@", LAGS),
        (None, "KI=R, WM=10.0, LIMIT_PLUS=C%, LIMIT_MINUS=-5, HOLD_PLUS=TRUE, HOLD_MINUS=-X@", ("INTEGRATE",)),
        (None, "KP=R, WLD=R, WM=10.0, LIMIT_PLUS=C%, LIMIT_MINUS=-5, HOLD_PLUS=-X@", ("PROP_INT",)),
        (None, "INPUT=T%(3), Q_FACTOR=R, WN=R, RESET=-X@", ("NOTCH",)),
        (None, "Q_FACTOR=R, WN=R, ORDER=4, INITIAL_VALUE=7, RESET=X@", ("NOTCHN",)),
        (None, "INPUT=T%(2), Q_FACTOR=R, WN=R, ORDER=2, INITIAL_VALUE=C%, RESET=-X@", ("NOTCHN",)),
        (None, "ORDER=2, INITIAL_VALUE=7, RESET=X@", FILTERS),
        (None, "INPUT=T%(2), ORDER=3, INITIAL_VALUE=C%, RESET=-X@", FILTERS),
        (None, "ORDER=1", FILTERS),
        (None, "WLD=R", ("LEAD_LAG", "HIGH_PASS_FILTER")),
        (None, "WLG=R", ("LEAD_LAG", "LOW_PASS_FILTER")),
        (None, "KP=R, KI=R, KD=R, ISA=TRUE, ACTION=ON, DERIVATIVE=FALSE, MANUAL=X@", ("PID",)),
        (None, "MANUAL=TRUE, INITIAL_VALUE=5, FEED_FORWARD=D%, MAX_CHANGE=1, DEAD_BAND=0", ("PID",)),
        (None, "KP=0.0, KI=0.0, KD=0.0, HOLD_PLUS=X@, HOLD_MINUS=-X@, DEAD_BAND=D%, MAX_CHANGE=D%", ("PID",)),
        (None, "LIMIT_PLUS=D%, LIMIT_MINUS=-5, SATURATED_PLUS=X@, ERROR=D%", ("PID",)),
    ],
)
def test_how_parameters_may_be_written(code, changes, names):
    for name in names:
        given = {**parameters(FEWEST[name]), **parameters(changes)}
        assert found(name, given) == ([] if code is None else [code]), name
