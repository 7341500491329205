"""The examples of docs/stimuli.md are stimuli that a rack takes, and the report has the keys of the page."""

import json
import re
from pathlib import Path

import pytest

from automax_ros.scenario.report import report_of
from scenario.stimuli.helpers import SPEED, playing, rack_in, read

PAGE = Path(__file__).parents[2] / "docs" / "stimuli.md"
RACK = """\
rack: PM1
slots:
  1: {module: 57C435, tasks: {SPEED: {priority: 5}}}
  0: {module: 57C413}
plants: {UNWIND: {motor: dc_150hp_500v}}
common: {REF%: {}, RUN@: {}, SUM!: {}, TABLE%(3): {}, TACH%: {}, LIMIT_SW@: {}}
"""


def blocks(language: str) -> list[str]:
    return re.findall(rf"^```{language}[^\n]*\n(.*?)^```$", PAGE.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)


@pytest.fixture
def rack(tmp_path):
    (tmp_path / "new").mkdir()
    (tmp_path / "new" / "SPEED.BLK").write_text(SPEED)
    return rack_in(tmp_path, RACK)


def test_examples_are_stimuli(rack, tmp_path):
    text = blocks("yaml")[0]
    file = read(rack, tmp_path, text)
    assert file.diagnostics == []
    verbs = {entry.verb for entry in file.stimuli or ()}
    assert {"set", "ramp", "sine", "square", "reload", "power", "tune", "run_all", "plant"} <= verbs


def test_the_example_runs(rack, tmp_path):
    stimulation = playing(rack, tmp_path, blocks("yaml")[0])
    rack.run(21.0)
    assert [(item.what, item.ok) for item in stimulation.happened if not item.ok] == []
    assert rack.value("REF%") == 0, "power has gone"


def test_the_table_of_the_page_is_played(rack, tmp_path):
    (tmp_path / "shift.csv").write_text(blocks("csv")[0])
    stimulation = playing(rack, tmp_path, blocks("yaml")[1])
    rack.run(4.0)
    assert (rack.value("REF%"), rack.value("RUN@")) == (1567, True), "in a line from 1500 at 3 s to 1600 at 4.5 s"
    rack.run(2.1)
    assert (rack.value("REF%"), rack.value("RUN@"), rack.value("TACH%")) == (1600, False, 1590)
    assert stimulation.is_over


def test_a_report_has_the_keys_of_the_page(rack):
    (text,) = blocks("json")
    page, real = json.loads(text), report_of(rack)
    assert list(page) == list(real)
    assert list(page["tasks"]["SPEED"]) == list(real["tasks"]["SPEED"])
    assert list(page["tasks"]["SPEED"]["errors"]) == list(real["tasks"]["SPEED"]["errors"])
