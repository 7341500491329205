"""Commons with a scale side by side: shown and measured in the unit, equal by what memory held."""

from pathlib import Path

import pytest
from system.support import ROOT

from automax_ros.cli.output.comparison_figure import comparison_figure, drawn
from automax_ros.cli.recordings.compare_page import page
from automax_ros.comparison import courses
from automax_ros.comparison.align import read_event
from automax_ros.comparison.comparison import ComparisonOptions, compare
from automax_ros.comparison.report import as_data, report_text
from automax_ros.rackfile.reading.scale import Scale
from comparison.racks import recording

LINE = ROOT / "bags" / "paper_line"
NEWTONS = Scale((0, 4000), (0.0, 1000.0))
BEFORE = {"T%": [(0.0, 0), (1.0, 2000)], "SP%": [(0.0, 500)]}
AFTER = {"T%": [(0.0, 0), (1.0, 1000), (2.0, 2000)], "SP%": [(0.0, 500)]}


@pytest.fixture
def scales(monkeypatch: pytest.MonkeyPatch) -> dict[str, dict[str, Scale]]:
    """The scales of recordings by their names, in place of those of rack files inside."""
    found = {"before": {"T%": NEWTONS}, "after": {"T%": NEWTONS}}
    monkeypatch.setattr(courses, "recorded_scales", lambda bag: found[bag.name])
    return found


@pytest.fixture
def bags(tmp_path: Path, scales: dict[str, dict[str, Scale]]) -> tuple[Path, Path]:
    one, two = (
        recording(tmp_path / name, steps, until_s=4.0, units={"T%": "N", "SP%": "N"})
        for name, steps in (("before", BEFORE), ("after", AFTER))
    )
    return one, two


def test_values_differences_and_references_are_in_the_unit(bags: tuple[Path, Path]) -> None:
    """From 1 s to 2 s 500 N before and 250 N after; the error is 500 N until 1 s, and then 250 N until 2 s."""
    for reference in ("SP%", "500"):
        found = compare(*bags, ComparisonOptions(["T%"], {"T%": reference}))
        (item,) = found.variables
        assert item.difference is not None
        worst = item.difference.greatest
        assert worst is not None
        assert (worst.time_s, worst.before, worst.after, worst.difference) == (1.0, 500.0, 250.0, -250.0)
        assert item.responses is not None
        assert (item.responses.before.start, item.responses.before.target) == (0.0, 500.0)
        integrals = [run.measures.error_integral for run in (item.responses.before, item.responses.after)]
        assert integrals == [pytest.approx(500.0), pytest.approx(750.0)]
    rows = [line.split() for line in report_text(found).splitlines()]
    assert ["T%", "N", "-250", "1", "500", "250", "1", "500", "250", "1"] in rows
    data = next(item for item in as_data(found)["variables"] if item["name"] == "T%")
    assert (data["type"], data["unit"], data["scaled"]) == ("INTEGER", "N", True)
    assert data["greatest"] == {"time_s": 1.0, "before": 500.0, "after": 250.0, "difference": -250.0}
    shown = page(found, None)
    assert "<td>N</td>" in shown
    figure = comparison_figure(found, drawn(found, named=True))
    lines = {line.get_gid(): list(line.get_ydata()) for axis in figure.axes for line in axis.get_lines()}
    assert (lines["T% before"], lines["T% difference"]) == ([0.0, 500.0, 500.0], [0.0, -250.0, 0.0, 0.0])
    assert figure.axes[0].get_ylabel() == "N"


def test_a_tolerance_is_in_counts_of_memory(bags: tuple[Path, Path]) -> None:
    assert not compare(*bags, ComparisonOptions(tolerance=999.0)).equal
    assert compare(*bags, ComparisonOptions(tolerance=1000.0)).equal
    assert "none differs by more than 1000 counts" in report_text(compare(*bags, ComparisonOptions(tolerance=1000.0)))


def test_an_event_is_in_the_unit(bags: tuple[Path, Path]) -> None:
    found = compare(*bags, ComparisonOptions(["T%"], event=read_event("T%>400")))
    assert (found.alignment.before_ns, found.alignment.after_ns) == (1_000_000_000, 2_000_000_000)


def test_a_scale_of_one_recording_alone_is_not_mixed_with_counts(
    bags: tuple[Path, Path], scales: dict[str, dict[str, Scale]]
) -> None:
    scales["after"] = {}
    found = compare(*bags, ComparisonOptions(["T%"]))
    (item,) = found.variables
    assert item.difference is not None
    assert item.difference.greatest is not None
    assert (item.unit, item.is_scaled, item.difference.greatest.difference) == ("counts", False, -1000.0)
    assert found.notes == ("T% has a scale before alone: it is compared in counts",)


def test_another_scale_alone_is_no_difference_and_is_said(
    bags: tuple[Path, Path], scales: dict[str, dict[str, Scale]]
) -> None:
    scales["after"] = {"T%": Scale((0, 4000), (0.0, 2000.0))}
    found = compare(*bags, ComparisonOptions(["T%"], end_ns=900_000_000))
    assert found.equal
    assert found.notes[-1] == "T% has another scale after than before; whether it differs is decided on counts"


def test_a_transducer_of_the_paper_line_agrees_with_its_web() -> None:
    """Shifted by 0.2 s both differ by the same force, but for the count of 0.2442 N that the transducer has."""
    found = compare(LINE, LINE, ComparisonOptions(["TENSION_1%", "W1/tension_n"], shift_ns=200_000_000))
    transducer, web = as_data(found)["variables"]
    assert (transducer["unit"], web["unit"], transducer["scaled"], web["scaled"]) == ("N", "N", True, False)
    for run in ("before", "after"):
        assert transducer["greatest"][run] == pytest.approx(web["greatest"][run], abs=1000.0 / 4095.0)
