"""Faulty rack and stimuli files, each with what is wrong in it: `#! LINE CODE MESSAGE` at its end, for each error.

The files lie in the folder faulty/: stimuli for its rack, and rack files.
"""

import re
from pathlib import Path

import pytest
from rack.helpers import rack_at

from automax_ros.core.diagnostics import Diagnostic
from automax_ros.core.problems import Severity
from automax_ros.rack.rack import Rack
from automax_ros.rackfile.loader import load
from automax_ros.scenario.stimuli.reader import read_for_rack

FOLDER = Path(__file__).parent / "faulty"
EXPECTED = re.compile(r"^#! (\d+) (AMX\d{4}) (.*)$", re.MULTILINE)
STIMULI, RACKS = (sorted((FOLDER / kind).glob("*.yaml")) for kind in ("stimuli", "racks"))


def expected(path: Path) -> list[tuple[int, str, str]]:
    found = EXPECTED.findall(path.read_text(encoding="utf-8"))
    return sorted((int(line), code, message) for line, code, message in found)


def errors(diagnostics: list[Diagnostic]) -> list[tuple[int, str, str]]:
    found = [item for item in diagnostics if item.severity is Severity.ERROR]
    return sorted((item.span.line, item.code, item.message) for item in found)


@pytest.fixture(scope="module")
def rack() -> Rack:
    return rack_at(FOLDER / "rack.yaml")


@pytest.mark.parametrize("path", STIMULI, ids=lambda path: path.stem)
def test_stimuli(path, rack):
    file = read_for_rack(path, rack)
    assert file.stimuli is None
    assert errors(file.diagnostics) == expected(path) != []


@pytest.mark.parametrize("path", RACKS, ids=lambda path: path.stem)
def test_rack_files(path):
    result = load(path)
    assert result.config is None
    assert errors(result.diagnostics) == expected(path) != []


def test_there_are_many():
    assert len(STIMULI) + len(RACKS) >= 90


def test_every_problem_of_stimuli_has_a_file():
    """AMX6730 and AMX6743 need files too large to lie there, AMX6733 a task alone, and AMX6744 is a warning: others."""
    found = {code for path in STIMULI for _, code, _ in expected(path)}
    wanted = {"AMX6731", "AMX6732", "AMX6734", "AMX6735", "AMX6736", "AMX6737", "AMX6738"}
    assert wanted | {"AMX6739", "AMX6740", "AMX6741", "AMX6742", "AMX6745"} <= found


def test_too_many_entries(tmp_path, rack):
    path = tmp_path / "long.yaml"
    path.write_text("- {at: 1, run_all: true}\n" * 50_001)
    assert [item.code for item in read_for_rack(path, rack).diagnostics] == ["AMX6743"]
