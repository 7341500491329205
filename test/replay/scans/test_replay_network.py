"""A rack that was on a network replays alone: what came from other racks is in its recording."""

from pathlib import Path

import pytest
from rack.modules.network_racks import LINE, MASTER, SLAVE, WIND, Cable, built

from automax_ros.rack.rack import Rack
from automax_ros.replay.engine import replay
from replay.replays import record

SLICE_S = 0.05


@pytest.mark.parametrize("slot", [5, 8])
def test_it_needs_no_network(tmp_path: Path, slot: int) -> None:
    line, wind = built(tmp_path / "line", MASTER, LINE), built(tmp_path / "wind", SLAVE, WIND)
    cable = Cable(line, wind)
    own, other = (line, wind) if slot == 5 else (wind, line)
    other.start()
    seen = set()

    def step(_: Rack, number: int) -> None:
        other.run(SLICE_S)
        line.write("SPEED%", 100 * number)
        if number == 20:
            cable.cut = {other}
        seen.add(wind.value("REF%"))

    bag = record(own, tmp_path / "bag", step, slices=40, seconds=40 * SLICE_S)
    assert len(seen) > 15
    report = replay(bag)
    assert report.identical
    assert [task.scans > 300 for task in report.tasks] == [True]
