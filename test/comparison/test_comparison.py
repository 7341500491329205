"""Two recordings compared: names, ranges, plants, and what they do not have in common."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from recordings.independent import GOLDEN, steps_of

from automax_ros.comparison import comparison, courses
from automax_ros.comparison.align import read_event
from automax_ros.comparison.comparison import Comparison, ComparisonOptions, compare
from automax_ros.comparison.report import as_data, report_text
from automax_ros.core.user_error import UsageError, UserError
from automax_ros.parallel import job
from automax_ros.recordings.mcap.errors import BagError
from comparison.racks import recording

RAMP = [(0.1 * step, float(step)) for step in range(20)]


def pair(folder: Path, one, other, **options) -> tuple[Path, Path]:
    return recording(folder / "one", one, until_s=3.0), recording(folder / "other", other, until_s=3.0, **options)


def values_of(found: Comparison) -> dict[str, tuple[float, float] | None]:
    """Time and difference of the greatest difference of each variable."""
    return {
        item.name: (worst.time_s, worst.difference) if (worst := item.difference.greatest) else None
        for item in found.variables
    }


def test_a_recording_equals_itself() -> None:
    found = compare(GOLDEN, GOLDEN)
    assert found.equal
    assert found.differing == []
    assert {"SPEED_FDBK%", "RUN@", "WEB_LENGTH!"} <= {item.name for item in found.variables}
    assert found.notes == found.only_before == ()


def test_differences_against_a_plain_reading_of_both_write_logs() -> None:
    """The example against itself 0.3 s later: each variable on a grid of 0.1 ms."""
    names = ["LINE_REF%", "SPEED_FDBK%", "CUR_REF%", "RUN@"]
    found = compare(GOLDEN, GOLDEN, ComparisonOptions(names, shift_ns=300_000_000))
    assert [item.name for item in found.differing] != []
    grid = np.arange(0.3, found.end_s, 1e-4)
    for item in found.variables:
        times, values = (np.array(part) for part in zip(*steps_of(GOLDEN, item.name), strict=True))
        own, its = (values[np.searchsorted(times, at + 1e-9, "right") - 1] for at in (grid, grid - 0.3))
        worst = item.difference.greatest
        if worst is None:
            assert (own == its).all()
            continue
        assert abs(worst.difference) == np.abs(its - own).max()
        assert worst.time_s == pytest.approx(grid[np.argmax(np.abs(its - own))], abs=2e-4)
        assert item.difference.apart_s == pytest.approx((its != own).sum() * 1e-4, abs=0.02)


def test_what_differs_first_comes_first(tmp_path: Path) -> None:
    one = {"A%": [(0, 1)], "B%": [(0, 1)], "C@": [(0, 0)], "D": [(0, 0.5)]}
    other = {"A%": [(0, 1), (2.0, 9)], "B%": [(0, 1), (1.0, -3), (1.5, 1)], "C@": [(0, 0), (0.5, 1)], "D": [(0, 0.5)]}
    found = compare(*pair(tmp_path, one, other))
    assert [item.name for item in found.differing] == ["C@", "B%", "A%"]
    assert values_of(found) == {"A%": (2.0, 8.0), "B%": (1.0, -4.0), "C@": (0.5, 1.0), "D": None}
    assert [item.difference.apart_s for item in found.variables] == [1.0, 0.5, 2.5, 0.0]
    text = report_text(found)
    assert "4 variables compared: 3 differ from 0 to 3 s" in text
    assert text.index("C@") < text.index("B%") < text.index("A%")


def test_a_tolerance_lets_numbers_differ(tmp_path: Path) -> None:
    bags = pair(tmp_path, {"A%": [(0, 1)]}, {"A%": [(0, 1), (1.0, 6)]})
    assert compare(*bags, ComparisonOptions(tolerance=5.0)).equal
    assert not compare(*bags, ComparisonOptions(tolerance=4.9)).equal


def test_names_of_one_recording_are_said_and_count_unless_names_are_given(tmp_path: Path) -> None:
    bags = pair(tmp_path, {"A%": [(0, 1)], "OLD%": [(0, 1)]}, {"A%": [(0, 1)], "NEW%": [(0, 1)]}, rack="PM2")
    found = compare(*bags)
    assert (found.only_before, found.only_after, found.equal) == (("OLD%",), ("NEW%",), False)
    assert found.notes == ("the recordings are of two racks, PM1 and PM2",)
    assert compare(*bags, ComparisonOptions(["A%"])).equal
    with pytest.raises(BagError, match="OLD%") as told:
        compare(*bags, ComparisonOptions(["OLD%"]))
    assert (told.value.code, told.value.place) == ("AMX6821", str(bags[1]))


def test_recordings_without_a_common_name_are_refused(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="no variable in common"):
        compare(*pair(tmp_path, {"A%": [(0, 1)]}, {"B%": [(0, 1)]}))


def test_other_types_and_units_are_said(tmp_path: Path) -> None:
    one = recording(tmp_path / "one", {"A%": [(0, 1)]}, units={"A%": "rpm"})
    other = recording(tmp_path / "other", {"A%": [(0, 1)]}, units={"A%": "counts"})
    (item,) = compare(one, other).variables
    assert item.note == "rpm before, counts after"


def test_a_recording_that_ends_earlier_is_compared_as_far_as_it_goes(tmp_path: Path) -> None:
    one = recording(tmp_path / "one", {"A%": [(0, 1), (2.0, 5)]}, until_s=3.0)
    other = recording(tmp_path / "other", {"A%": [(0, 1)]}, until_s=1.5)
    found = compare(one, other)
    assert (found.equal, found.end_s) == (True, 1.5)
    assert found.notes == ("the recording after ends 1.5 s earlier than the other one",)


def test_events_align_each_run_by_itself(tmp_path: Path) -> None:
    one = {"RUN@": [(0, 0), (1.0, 1)], "A%": [(0, 0), (1.2, 7)]}
    other = {"RUN@": [(0, 0), (1.7, 1)], "A%": [(0, 0), (1.9, 7)]}
    bags = pair(tmp_path, one, other)
    found = compare(*bags, ComparisonOptions(event=read_event("run@")))
    assert found.equal
    assert (found.start_s, found.end_s) == (-1.0, pytest.approx(1.3))
    assert not compare(*bags).equal
    assert compare(*bags, ComparisonOptions(shift_ns=-700_000_000)).equal
    cut = compare(*bags, ComparisonOptions(["A%"], event=read_event("RUN@"), start_ns=-500_000_000, end_ns=10**9))
    assert (cut.start_s, cut.end_s, [item.name for item in cut.variables]) == (-0.5, 1.0, ["A%"])


def test_an_event_of_one_run_alone_is_refused_with_its_name(tmp_path: Path) -> None:
    bags = pair(tmp_path, {"RUN@": [(0, 0), (1.0, 1)]}, {"RUN@": [(0, 0)]})
    with pytest.raises(UsageError, match=r"RUN@=TRUE never begins in .*other"):
        compare(*bags, ComparisonOptions(event=read_event("RUN@")))


def test_no_time_in_common_is_refused(tmp_path: Path) -> None:
    bags = pair(tmp_path, {"A%": [(0, 1)]}, {"A%": [(0, 1)]})
    with pytest.raises(UsageError, match="no time in common"):
        compare(*bags, ComparisonOptions(shift_ns=5 * 10**9))
    with pytest.raises(UsageError, match="from 0 to 3 s"):
        compare(*bags, ComparisonOptions(start_ns=4 * 10**9))


def test_different_scan_times_are_compared_as_they_hold(tmp_path: Path) -> None:
    """A ramp of 10 counts/s every 0.1 s and every 0.2 s: at most one count apart, half of the time."""
    slow = [(0.2 * step, 2.0 * step) for step in range(10)]
    found = compare(*pair(tmp_path, {"A%": RAMP}, {"A%": slow}))
    (item,) = found.variables
    worst = item.difference.greatest
    assert worst is not None
    assert (worst.time_s, worst.difference) == (0.1, -1.0)
    assert item.difference.apart_s == pytest.approx(0.1 * 9 + 1.1)  # the last value holds from 1.9 s to 3 s


def test_signals_of_plants_compare_like_variables(tmp_path: Path) -> None:
    """By both spellings; they are among what is compared without names."""
    bags = [
        recording(
            tmp_path / name,
            {"A%": [(0, 1)]},
            plants={"UNWIND": [(0.0, 100.0), (1.0, rpm), (2.0, 100.0)]},
        )
        for name, rpm in (("one", 150.0), ("other", 175.0))
    ]
    found = compare(bags[0], bags[1])
    assert [item.name for item in found.differing] == ["UNWIND/speed_rpm"]
    assert {"A%", "UNWIND/current_a", "UNWIND/contactor"} <= {item.name for item in found.variables}
    for name in ("UNWIND.speed_rpm", "unwind/SPEED_RPM", "UNWIND . speed_rpm"):
        (item,) = compare(bags[0], bags[1], ComparisonOptions([name])).variables
        assert (item.name, item.unit, item.difference.greatest.difference) == ("UNWIND/speed_rpm", "rpm", 25.0)
    with pytest.raises(BagError, match="WINDER"):
        compare(bags[0], bags[1], ComparisonOptions(["WINDER/speed_rpm"]))


def test_signals_of_webs_and_of_their_ends_compare_too(tmp_path: Path) -> None:
    bags = [
        recording(tmp_path / name, {"A%": [(0, 1)]}, webs={"W1": [(0.0, 300.0), (1.0, tension_n), (2.0, 300.0)]})
        for name, tension_n in (("one", 310.0), ("other", 360.0))
    ]
    found = compare(bags[0], bags[1])
    assert [item.name for item in found.differing] == ["W1/tension_n", "P/web_m"]
    assert {"W1/broken", "P/diameter_m"} <= {item.name for item in found.variables}
    (item,) = compare(bags[0], bags[1], ComparisonOptions(["W1.tension_n"])).variables
    assert (item.name, item.unit, item.difference.greatest.difference) == ("W1/tension_n", "N", 50.0)


def test_references_are_variables_or_numbers(tmp_path: Path) -> None:
    one = {"Y%": [(0, 0), (1.0, 80), (2.0, 100)], "REF%": [(0, 100)], "RUN@": [(0, 0), (0.5, 1)]}
    other = {"Y%": [(0, 0), (1.0, 120), (1.5, 100)], "REF%": [(0, 100)], "RUN@": [(0, 0), (0.5, 1)]}
    bags = pair(tmp_path, one, other)
    for text in ("REF%", "ref%", "100"):
        found = compare(*bags, ComparisonOptions(["Y%"], {"y%": text}, read_event("RUN@")))
        (item,) = found.variables
        responses = item.responses
        assert responses is not None
        assert responses.reference.upper() == text.upper()
        assert responses.before.measures.error_integral == pytest.approx(100 * 0.5 + 20 * 1.0)
        assert responses.after.measures.error_integral == pytest.approx(100 * 0.5 + 20 * 0.5)
        assert responses.change.error_integral == pytest.approx(-10.0)
        assert responses.change.overshoot_percent == pytest.approx(20.0)
        assert responses.before.measures.settling_s == pytest.approx(1.5)
        assert responses.change.settling_s == pytest.approx(-0.5)


def test_a_variable_without_a_value_in_common_is_said_and_differs(tmp_path: Path) -> None:
    one = recording(tmp_path / "one", {"A%": [(0, 1)], "B%": [(2.5, 1)]}, until_s=3.0)
    other = recording(tmp_path / "other", {"A%": [(0, 1)], "B%": [(0, 1)]}, until_s=2.0)
    found = compare(one, other)
    assert [item.name for item in found.differing] == ["B%"]
    assert "B%: no value in both recordings at the same time" in report_text(found)


def test_texts_and_one_variable_twice_are_refused(tmp_path: Path) -> None:
    bags = pair(tmp_path, {"A%": [(0, 1)], "NOTE$": []}, {"A%": [(0, 1)], "NOTE$": []})
    with pytest.raises(BagError, match="NOTE") as told:
        compare(*bags, ComparisonOptions(["NOTE$"]))
    assert told.value.code == "AMX6828"
    with pytest.raises(UsageError, match="same variable"):
        compare(*bags, ComparisonOptions(["A%", "a%"]))


def test_memory_is_bounded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(courses, "MOST_VALUES", 10)
    with pytest.raises(BagError) as told:
        compare(*pair(tmp_path, {"A%": RAMP}, {"A%": RAMP}))
    assert told.value.code == "AMX6814"


def test_long_recordings_are_read_at_once_with_the_same_result_and_errors(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    one = {"A%": RAMP, "RUN@": [(0, 0), (1.0, 1)]}
    bags = pair(tmp_path, one, {**one, "A%": [(0, 3)]})
    alone = as_data(compare(*bags))
    monkeypatch.setattr(comparison, "_LONG_BYTES", 0)
    monkeypatch.setattr(job, "usable_cores", lambda: 2)
    shares: list[float] = []
    assert as_data(compare(*bags, progress=shares.append)) == alone
    assert shares == [0.5, 1.0]
    with pytest.raises(BagError, match="NONE%"):
        compare(*bags, ComparisonOptions(["NONE%"]))


def test_recordings_without_a_value_are_refused(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="holds no value"):
        compare(*pair(tmp_path, {"A%": []}, {"A%": []}))


STEPS = st.dictionaries(st.integers(1, 30).map(lambda tenth: tenth / 10), st.integers(-9, 9), max_size=12)


@settings(max_examples=25)
@given(STEPS, STEPS)
def test_an_exchange_of_both_turns_the_signs(
    tmp_path_factory: pytest.TempPathFactory, one: dict[float, int], other: dict[float, int]
) -> None:
    folder = tmp_path_factory.mktemp("bags")
    bags = [
        recording(folder / name, {"A%": sorted({0.0: 0, **steps}.items())}, until_s=3.1)
        for name, steps in (("one", one), ("other", other))
    ]
    there, back = compare(bags[0], bags[1]), compare(bags[1], bags[0])
    assert there.equal == back.equal
    (own,), (its,) = there.variables, back.variables
    assert own.difference.apart_s == its.difference.apart_s
    if own.difference.greatest is not None:
        assert own.difference.greatest.difference == -its.difference.greatest.difference
        assert own.difference.first.time_s == its.difference.first.time_s
    assert as_data(there)["variables"][0]["name"] == "A%"
