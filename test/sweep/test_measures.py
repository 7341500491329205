"""Measures as they are written: what is read, and what is refused with which words."""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from automax_ros.core.ticks import NS_PER_MS, NS_PER_S
from automax_ros.core.user_error import UserError
from automax_ros.rackfile.model.config import RackConfig
from automax_ros.sweep.measures import FUNCTIONS, MOST_MEASURES, Measure, Subject, read_measures
from sweep.helpers import rack_in


@pytest.fixture(scope="module")
def config(tmp_path_factory: pytest.TempPathFactory) -> RackConfig:
    return rack_in(Path(tmp_path_factory.mktemp("measures"))).config


def read(config: RackConfig, text: str) -> tuple[Measure, ...]:
    return read_measures(text, config, 10 * NS_PER_S)


def test_a_list_of_calls(config: RackConfig):
    assert read(config, "rms(err%) settle( FDBK% , 2 %),settle(FDBK%,2,1000)\nmax(TABLE%[3], from=1.0 to=3.5)") == (
        Measure("rms", "ERR%"),
        Measure("settle", "FDBK%", (2.0,), percent=True),
        Measure("settle", "FDBK%", (2.0, 1000.0)),
        Measure("max", "TABLE%(3)", (), start_ns=NS_PER_S, end_ns=3500 * NS_PER_MS),
    )
    assert read(config, "errors(loop) stopped count(NEAR@, to=2)time(NEAR@)") == (
        Measure("errors", "LOOP"),
        Measure("stopped"),
        Measure("count", "NEAR@", end_ns=2 * NS_PER_S),
        Measure("time", "NEAR@"),
    )


def test_each_once(config: RackConfig):
    assert read(config, "max(ERR%) rms(ERR%) max(ERR%, from=0)") == (Measure("max", "ERR%"), Measure("rms", "ERR%"))


@given(
    st.lists(
        st.builds(
            Measure,
            st.just("settle"),
            st.sampled_from(["ERR%", "SLOW", "TABLE%(2)"]),
            st.tuples(st.floats(0, 1e9), st.floats(-1e9, 1e9)) | st.tuples(st.floats(0, 100)),
            st.booleans(),
            st.integers(0, 4_999_999_999),
            st.none() | st.integers(5 * NS_PER_S, 10 * NS_PER_S),
        ),
        min_size=1,
        max_size=9,
        unique=True,
    )
)
def test_labels_are_read_as_what_they_are_of(config: RackConfig, measures: list[Measure]):
    assert read(config, " ".join(measure.label for measure in measures)) == tuple(measures)


def test_every_function_makes_what_computes_it(config: RackConfig):
    subjects = {"errors": "(LOOP)", "stopped": "", "count": "(NEAR@)", "time": "(NEAR@)", "settle": "(ERR%, 1)"}
    for name in FUNCTIONS:
        (measure,) = read(config, f"{name}{subjects.get(name, '(ERR%)')}")
        if measure.is_watched:
            accumulator = measure.accumulator()
            accumulator.hold(1, 0, 5)
            accumulator.result(1, 5)
        assert measure.function == name


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "nothing is measured"),
        ("rsm(ERR%)", "there is no measure 'rsm'"),
        ("rms", "rms is of an INTEGER, DOUBLE INTEGER or REAL, and names none"),
        ("rms(ERR%", "'ERR%': a ) is missing"),
        ("rms(ER%)", "the rack has no common variable 'ER%'"),
        ("rms(TABLE%)", "TABLE% is an array"),
        ("rms(NEAR@)", "rms is of an INTEGER, DOUBLE INTEGER or REAL; NEAR@ is a BOOLEAN"),
        ("max(NOTE$)", "max is of an INTEGER, DOUBLE INTEGER or REAL; NOTE$ is a STRING"),
        ("time(ERR%)", "time is of a BOOLEAN; ERR% is a INTEGER"),
        ("errors(LOPO)", "the rack has no task 'LOPO'"),
        ("stopped(LOOP)", "stopped is of the rack, not of 'LOOP'"),
        ("settle(ERR%)", "settle cannot have 0 numbers"),
        ("rms(ERR%, 3)", "rms cannot have 1 numbers"),
        ("settle(ERR%, 2 %, 3, 4)", "settle cannot have 3 numbers"),
        ("settle(ERR%, __import__)", "settle: '__import__' is not a number"),
        ("settle(ERR%, -2)", "settle: a band is not negative"),
        ("rms(ERR%, from=3 to=2)", "rms: the window is empty, or not within the 10 s of a run"),
        ("rms(ERR%, to=11)", "rms: the window is empty, or not within the 10 s of a run"),
        ("rms(ERR%, from=1 from=2)", "rms has from= twice"),
        ("rms(ERR%, from=x)", "rms: from=x: time in seconds 'x' is not a number"),
        ("errors(LOOP, from=1)", "errors is of the run's end, and takes no from= and to="),
        ("1 + 1", "'1 + 1' is not a measure"),
        ("rms(ERR%) ;", "';' is not a measure"),
        ("x" * 4001, "4001 characters of measures: at most 4000 are read"),
        (
            " ".join(f"rms(ERR%, from=0.{number:03d})" for number in range(MOST_MEASURES + 1)),
            "51 measures: a sweep has at most 50",
        ),
    ],
)
def test_what_is_refused(config: RackConfig, text: str, message: str):
    with pytest.raises(UserError) as caught:
        read(config, text)
    assert caught.value.message.startswith(message)


def test_near_names_are_told(config: RackConfig):
    for text, hint in {"rsm(ERR%)": "did you mean rms?", "rms(ER%)": "did you mean ERR%?"}.items():
        with pytest.raises(UserError) as caught:
            read(config, text)
        assert caught.value.hint == hint


@pytest.mark.parametrize("name", [name for name, item in FUNCTIONS.items() if item.subject is Subject.NUMBER])
def test_every_function_computes_with_as_many_numbers_as_it_takes(config: RackConfig, name: str):
    """5 holds for 1 s, 8 for 3 s; before that it was 4."""
    function = FUNCTIONS[name]
    expected = {"settle": (0.0, 1.0), "overshoot": (0.0, 300.0), "rise": (1.0, 0.0), "itae": (62.5, 22.5)}
    for count in range(function.least, function.most + 1):
        numbers = {0: "", 1: ", 5", 2: ", 1, 8"}[count]
        (measure,) = read(config, f"{name}(ERR%{numbers})")
        accumulator = measure.accumulator()
        accumulator.begin(4)
        accumulator.hold(5, 0, NS_PER_S)
        accumulator.hold(8, NS_PER_S, 4 * NS_PER_S)
        found = accumulator.result(8, 4 * NS_PER_S)
        if name in expected:
            assert found == pytest.approx(expected[name][count - function.least])
        else:
            assert found is not None
