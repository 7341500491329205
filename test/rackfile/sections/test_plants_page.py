"""docs/plants.md and plants in docs/rack_yaml.md say what the reader takes: keys, ranges, signals, verbs, examples."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from rack.helpers import good

from automax_ros.drive.plant.faults import VERBS, values_of
from automax_ros.drive.plant.signals import SIGNALS
from automax_ros.rack.rack import Rack
from automax_ros.rackfile.reading.values import schemas
from automax_ros.rackfile.sections import couples, feeds
from automax_ros.rackfile.sections import plant_keys as keys
from automax_ros.rackfile.sections import plants as reading

DOCS = Path(__file__).parents[3] / "docs"
PAGE = (DOCS / "plants.md").read_text(encoding="utf-8")
YAML_PAGE = (DOCS / "rack_yaml.md").read_text(encoding="utf-8").split("\n## Plants\n")[1].split("\n## ")[0]


def table(text: str, heading: str) -> dict[str, str]:
    """The rows of the first table under a heading, by the name in their first column."""
    rows = text.split(f"\n## {heading}\n")[1].split("\n## ", maxsplit=1)[0]
    return dict(re.findall(r"^\| `(\w+)(?:: in)?` \| (.*) \|$", rows, re.M))


def test_signals_and_verbs_are_all_there():
    assert list(table(PAGE, "Feeds")) == list(SIGNALS)
    assert list(table(PAGE, "What can break")) == list(VERBS)
    assert sorted(table(PAGE, "Load")) == sorted([*schemas(*keys.LOAD), "torque_per_rpm", "ros"])


@pytest.mark.parametrize("text", [PAGE, YAML_PAGE])
def test_examples_are_racks(tmp_path, text):
    found = re.findall(r"^```yaml\n(.*?)^```$", text, re.M | re.S)
    assert found
    for example in found:
        rack = Rack(good(tmp_path, example))
        rack.start()
        rack.run(0.01)
        assert len(rack.plants) == 2


def test_the_rack_files_page_has_every_key_and_range():
    rows = dict(re.findall(r"^\| `(\w+)` \| (.*) \|$", YAML_PAGE, re.M))
    assert list(rows) == list(reading.KEYS)
    shown = {key: set(re.findall(r"\w+", row.split("|")[0])) for key, row in rows.items()}
    assert shown["line"] == {*schemas(*keys.SUPPLY), "rotation"}
    assert shown["load"] == {*schemas(*keys.LOAD), "torque_per_rpm", "ros", "or"}
    assert shown["couple"] == set(couples.KEYS)
    assert set(feeds.KEYS) <= shown["feeds"]
    numbers = [("line", item) for item in keys.SUPPLY] + [("load", item) for item in keys.LOAD]
    numbers += [("couple", item) for item in couples.NUMBERS] + [("inertia", keys.INERTIA)]
    for key, number in numbers:
        text = f"{number.schema['minimum']:g} to {number.schema['maximum']:g}".replace("e+0", "e")
        assert text in rows[key].replace("10000 rpm", "10000"), (key, text)
    every = feeds.EVERY_MS.schema
    assert f"{every['minimum']:g} to {every['maximum']:g} ms, {every['default']:g}" in rows["feeds"]


def test_values_of_the_page_are_taken():
    rows = table(PAGE, "What can break")
    for verb in ("short_scr", "open_gate"):
        assert rows[verb].startswith("1 to 6, 11 to 16")
        assert [values_of(verb, text) for text in ("1", "16")] == [(1,), (16,)]
    for verb in ("blow_fuse", "lose_phase"):
        assert [values_of(verb, text)[0] for text in ("1", "T2", "3", "C", "B", "A")] == [0, 1, 2, 0, 1, 2]
    assert values_of("line_sag", "70 0.2") == (70.0, 0.2)
    assert rows["line_hz"].startswith("48 to 62")
