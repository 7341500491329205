"""The first scan in which two recordings differ."""

from __future__ import annotations

from pathlib import Path

import pytest

from automax_ros.messages.types.messages import Scan
from automax_ros.rack.rack import Rack
from automax_ros.replay.recorded.compared import FirstApart, first_apart
from replay.recorded.runs import Messages, run_of
from replay.replays import SPEED, busy, edited, recorded, rewritten


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return recorded(tmp_path_factory.mktemp("one"), seconds=11.0)


def apart(one: Path, two: Path, tolerance: float = 0.0) -> FirstApart | None:
    return first_apart(run_of(one), run_of(two), tolerance)


def test_a_run_that_was_recorded_twice_does_not_differ(bag: Path, tmp_path: Path) -> None:
    assert apart(bag, bag) is None
    assert apart(bag, recorded(tmp_path, seconds=11.0)) is None


def test_the_first_scan_that_latched_another_value_is_found(bag: Path, tmp_path: Path) -> None:
    def steps(rack: Rack, number: int) -> None:
        busy(rack, number)
        if number == 7:
            rack.write("REF%", 333)

    other = recorded(tmp_path, steps, seconds=11.0)
    found = apart(bag, other)
    first = next(
        (one, two)
        for one, two in zip(Messages(bag).scans["SPEED"], Messages(other).scans["SPEED"], strict=True)
        if one._replace(stamp=0) != two._replace(stamp=0)
    )
    assert found is not None
    assert (found.task, found.scan, found.time_ns) == ("SPEED", first[0].scan, first[0].stamp)
    assert found.text.startswith("REF%: latched 259, there 333")
    back = apart(other, bag)
    assert back is not None
    assert back.text.startswith("REF%: latched 333, there 259")


def test_a_difference_within_the_tolerance_is_none(bag: Path, tmp_path: Path) -> None:
    other = recorded(tmp_path, seconds=11.0, SPEED=edited(SPEED, ("INPUT2=100", "INPUT2=101")))
    exact, roughly = apart(bag, other), apart(bag, other, tolerance=5)
    assert exact is not None
    assert exact.text.startswith("OUT%: committed ")
    assert roughly is None


def test_recordings_that_begin_at_different_scans_are_compared_where_both_have_them(bag: Path, tmp_path: Path) -> None:
    def cut(message):
        return None if isinstance(message, Scan) and message.stamp < 10_000_000_000 else message

    late = rewritten(bag, tmp_path / "bag", cut)
    assert apart(bag, late) is None
    assert apart(late, bag) is None


def test_scans_that_one_of_them_lacks_are_a_difference(bag: Path, tmp_path: Path) -> None:
    def cut(message):
        lost = isinstance(message, Scan) and message.task == "WORK" and message.scan == 40
        return None if lost else message

    found = apart(bag, rewritten(bag, tmp_path / "bag", cut))
    assert found is not None
    assert (found.task, found.scan, found.text) == ("WORK", 40, "scan 40 here, scan 41 there")


def test_errors_that_one_of_them_lacks_are_a_difference(bag: Path, tmp_path: Path) -> None:
    def clear(message):
        return message._replace(errors=()) if isinstance(message, Scan) else message

    found = apart(bag, rewritten(bag, tmp_path / "bag", clear))
    assert found is not None
    assert found.text.startswith("errors: line 190 AMX7024 division by zero")
    assert found.text.endswith(", there none")
