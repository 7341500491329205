"""What is told of the first message that is not as recorded."""

from __future__ import annotations

from pathlib import Path

import pytest
from rack.helpers import rack_at
from scenario.stimuli.helpers import rack_in

from automax_ros.messages.cdr.cdr import encode
from automax_ros.messages.types.messages import NAMES, PlantState, Scan
from automax_ros.messages.types.topics import SCAN, Topic
from automax_ros.recordings.read.reader import BagReader
from automax_ros.replay.rerun import checking as module
from automax_ros.replay.rerun.checking import RecordedCheck
from replay.replays import rewritten
from replay.rerun.runs import messages_of, recorded_run, run_again

CONFIG = Path(__file__).parents[3] / "config"


@pytest.fixture(scope="module")
def drive(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return recorded_run(rack_at(CONFIG / "dc_drive" / "rack.yaml"), tmp_path_factory.mktemp("drive") / "bag", 0.2)


@pytest.mark.parametrize("field", ["speed_rpm", "contactor", "faults"])
def test_of_a_plant_its_name_and_the_field_are_told(drive, tmp_path, field):
    changed = []

    def change(message):
        if isinstance(message, PlantState) and not changed:
            before = getattr(message, field)
            changed.append((message.plant, before))
            now = ["none"] if field == "faults" else (not before) if isinstance(before, bool) else before + 0.5
            return message._replace(**{field: now})
        return message

    deviation = run_again(rewritten(drive, tmp_path / "other", change), None).deviation
    ((plant, before),) = changed
    told = {
        "speed_rpm": f"speed_rpm {before + 0.5 if field == 'speed_rpm' else 0} is recorded, here it is {before}",
        "contactor": f"contactor {not before} is recorded, here it is {before}",
        "faults": "faults differs",
    }
    assert deviation is not None
    assert deviation.what == f"the PlantState of {plant}: {told[field]}"


@pytest.mark.parametrize(
    ("most", "told"), [(10, "the next 10 recorded messages are of other topics"), (1000, "the recording has ended")]
)
def test_too_many_messages_of_other_topics_are_not_the_end(tmp_path, monkeypatch, most, told):
    bag = recorded_run(rack_in(tmp_path), tmp_path / "bag", 0.02)
    monkeypatch.setattr(module, "_MOST_WAITING", most)
    check = RecordedCheck(BagReader(bag), 0, exact=False)
    scan = messages_of(bag, Scan)[0]
    check.sink(Topic("/elsewhere/scans", NAMES[Scan], SCAN))(5, encode(scan))
    assert check.deviation is not None
    assert check.deviation.what == f"{told}, and scan {scan.scan} of task {scan.task} comes"
