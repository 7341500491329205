"""A sweep by a Dask cluster: the rows of one process."""

from pathlib import Path

import pytest

pytest.importorskip("distributed", reason="the extra automax_ros[cluster] is not installed")
from parallel.clusters import cluster

from automax_ros.parallel.job import Workers
from automax_ros.sweep.points import grid, read_varied
from automax_ros.sweep.run import Stimuli, run_sweep
from sweep.helpers import plan_of, rack_in


def test_rows_are_those_of_one_process(tmp_path: Path):
    """The workers need no file of the rack; a run that faults is a row there, too."""
    folder = tmp_path / "rack"
    folder.mkdir()
    rack = rack_in(folder)
    stimuli = tmp_path / "stimuli.yaml"
    stimuli.write_text("- {at: 0.1, set: {REF%: -50}}\n")
    texts = ["LOOP.KP=0.2:2.4:4", "RUN@=true,false"]
    plan = plan_of(rack, texts, "rms(ERR%) settle(FDBK%, 2)", stimuli=Stimuli.of(stimuli, allow_outside=False))
    points = grid([read_varied(rack, text) for text in texts])
    expected = run_sweep(plan, points, Workers(1))
    for path in folder.iterdir():
        path.unlink()
    with cluster(tmp_path) as found:
        assert run_sweep(plan, points, Workers(scheduler=found.address)) == expected
    assert [bool(row.outcome.fault) for row in expected] == [False, True] * 4
