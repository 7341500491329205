"""A line with webs runs again: installed, and with the rolls that an earlier run has left."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from messages.stream.webs import web_rack

from automax_ros.rack.operator.retention import Retention
from automax_ros.rack.operator.switches import SwitchOperations
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.recordings.read.reader import BagReader
from automax_ros.recordings.write.recorder import STOCK
from replay.rerun.runs import data_of, recorded_run, run_again


def run_of(folder: Path, name: str) -> Path:
    """A run that keeps its state in a folder, in which a web breaks and a roll is spliced."""
    rack = web_rack(folder)
    kept = Retention(rack, folder / "state")
    settings = kept.restore().settings
    controls = SwitchOperations(rack)
    acts = {0.05: lambda: controls.web("W1", "break"), 0.12: lambda: controls.plant("UNWIND", "splice", "1.1")}
    bag = recorded_run(rack, folder / name, 0.2, acts, settings=settings)
    kept.save()
    return bag


def test_rolls_and_webs_of_an_earlier_run_are_found_again(tmp_path):
    first, second = run_of(tmp_path, "first"), run_of(tmp_path, "second")
    assert STOCK not in BagReader(first).custom_data
    assert '"broken": true' in BagReader(second).custom_data[STOCK]
    for bag in (first, second):
        after = tmp_path / f"{bag.name}_after"
        report = run_again(bag, after)
        assert report.deviation is None, report.text()
        assert data_of(after) == data_of(bag)
        assert (after / "metadata.yaml").read_bytes() == (bag / "metadata.yaml").read_bytes()
    later = run_again(second, tmp_path / "later", 0.1)
    assert later.deviation is None, later.text()


@pytest.mark.parametrize("damage", ["no JSON", '["a"]', '{"W1": 5}', '{"UNWIND": {}}', "impossible"])
def test_a_damaged_stock_is_refused(tmp_path, monkeypatch, damage):
    run_of(tmp_path, "first")
    bag = run_of(tmp_path, "second")
    custom = dict(BagReader(bag).custom_data)
    stock = json.loads(custom[STOCK])
    stock["UNWIND"]["wound_m"] = -1.0
    custom[STOCK] = json.dumps(stock) if damage == "impossible" else damage
    monkeypatch.setattr(BagReader, "custom_data", property(lambda _: custom))
    with pytest.raises(BagError) as error:
        run_again(bag, None)
    assert error.value.code == "AMX6835"
