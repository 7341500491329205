"""Events that align two recordings."""

from pathlib import Path

import pytest

from automax_ros.comparison.align import Event, aligned, read_event
from automax_ros.comparison.courses import Course, RecordedCourses
from automax_ros.core.types import DataType
from automax_ros.core.user_error import UsageError
from comparison.racks import S, course


def recorded(found: Course, name: str = "run") -> RecordedCourses:
    label = found.variable.label
    return RecordedCourses(Path(name), "PM1", {label: label}, {label: found}, int(found.times[0]), 10 * S)


def run(*steps: tuple[float, float]) -> Course:
    return course(steps, "RUN@", DataType.BOOLEAN)


@pytest.mark.parametrize(
    ("text", "event"),
    [
        ("RUN@", Event("RUN@")),
        (" run@ = false ", Event("run@", "=", 0.0, "=false")),
        ("CUR_REF%>500", Event("CUR_REF%", ">", 500.0, ">500")),
        ("TABLE%(1,2) <= -3.5", Event("TABLE%(1,2)", "<=", -3.5, "<=-3.5")),
        ("UNWIND/speed_rpm<>0", Event("UNWIND/speed_rpm", "<>", 0.0, "<>0")),
    ],
)
def test_events_are_read(text: str, event: Event) -> None:
    assert read_event(text) == event


@pytest.mark.parametrize("text", ["", ">5", "A%>", "A%>B%", "A%=1=2", "A%>>1", "A%>1e999"])
def test_what_is_not_an_event_is_refused(text: str) -> None:
    with pytest.raises(UsageError, match="--align"):
        read_event(text)


def test_the_first_rise_counts_and_not_what_is_true_from_the_start() -> None:
    found = recorded(run((0.5, 1.0), (1.0, 0.0), (2.0, 1.0), (3.0, 0.0), (4.0, 1.0)))
    event = read_event("RUN@")
    assert event.first(found, 0) == 2 * S
    assert event.first(found, 2 * S + 1) == 4 * S
    assert read_event("RUN@=OFF").first(found, 0) == 1 * S


def test_before_the_start_of_the_run_all_is_0() -> None:
    """So what is TRUE from the first scan on rises there; a recording that begins later does not show that."""
    assert read_event("RUN@").first(recorded(run((0.0, 1.0))), 0) == 0
    with pytest.raises(UsageError, match="never begins"):
        read_event("RUN@=FALSE").first(recorded(run((0.0, 0.0))), 0)


@pytest.mark.parametrize(
    ("text", "second"), [("X>2", 2), ("X>=2", 1), ("X<1", 4), ("X<=1", 4), ("X=3", 2), ("X<>0", 1)]
)
def test_numbers_cross(text: str, second: int) -> None:
    found = recorded(course([(0.0, 0.0), (1.0, 2.0), (2.0, 3.0), (3.0, 2.5), (4.0, 0.0)]))
    assert read_event(text).first(found, 0) == second * S


@pytest.mark.parametrize(
    ("found", "text", "hint"),
    [
        (run((0.0, 0.0)), "RUN@", "it is FALSE there"),
        (run((0.5, 1.0)), "RUN@", "after the condition was false"),
        (course([(0.0, 1.0), (1.0, 7.0)]), "X>9", "it goes from 1 to 7 there"),
        (course([(0.0, float("nan"))]), "X>9", "it has no value there"),
    ],
)
def test_an_event_that_never_happens_says_what_is_there(found: Course, text: str, hint: str) -> None:
    with pytest.raises(UsageError, match="never begins in run") as told:
        read_event(text).first(recorded(found), 0)
    assert hint in str(told.value.hint)


def test_of_a_number_alone_nothing_is_clear() -> None:
    with pytest.raises(UsageError, match="only of a BOOLEAN"):
        read_event("X").first(recorded(course([(0.0, 1.0), (1.0, 7.0)])), 0)


def test_both_runs_are_moved_to_their_own_event_and_the_second_by_a_shift_more() -> None:
    one, other = recorded(run((0.0, 0.0), (2.0, 1.0))), recorded(run((0.0, 0.0), (5.0, 1.0)))
    found = aligned(one, other, read_event("RUN@"), shift_ns=S // 2)
    assert (found.event, found.move_before_ns, found.move_after_ns) == ("RUN@", -2 * S, -5 * S + S // 2)
    plain = aligned(one, other, None, shift_ns=-S)
    assert (plain.event, plain.move_before_ns, plain.move_after_ns) == ("", 0, -S)
