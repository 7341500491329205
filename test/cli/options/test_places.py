"""--jobs and --scheduler: what they take, and what they refuse."""

import argparse
from pathlib import Path

import pytest

from automax_ros.cli.options.work import add_where_arguments, where_of
from automax_ros.cli.usage import UsageError
from automax_ros.parallel.job import Workers

RACK = Path(__file__).parents[3] / "config" / "section_drive"


def where(*arguments):
    parser = argparse.ArgumentParser()
    add_where_arguments(parser, "work")
    return where_of(parser.parse_args(arguments))


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        ((), Workers(None)),
        (("--jobs", "auto"), Workers(None)),
        (("--jobs", "1"), Workers(1)),
        (("--jobs", "8"), Workers(8)),
        (("--scheduler", " tcp://10.0.0.1:8786 "), Workers(scheduler="tcp://10.0.0.1:8786")),
    ],
)
def test_work_is_done_where_it_is_wanted(arguments, expected):
    assert where(*arguments) == expected


@pytest.mark.parametrize("jobs", ["0", "-1", "1025", "two", "1.5", ""])
def test_jobs_are_a_number_that_a_machine_bears(jobs, capsys):
    with pytest.raises(SystemExit) as caught:
        where(f"--jobs={jobs}")
    assert caught.value.code == 2
    assert "--jobs" in capsys.readouterr().err


@pytest.mark.parametrize("arguments", [("--jobs", "2", "--scheduler", "tcp://x:1"), ("--scheduler", " ")])
def test_a_cluster_has_an_address_and_jobs_of_its_own(arguments):
    with pytest.raises(UsageError, match="--scheduler"):
        where(*arguments)


def test_a_scheduler_that_cannot_be_used_is_exit_code_2(automax, monkeypatch, tmp_path):
    """Only where there is something to hand over: a recording of one file is replayed here."""
    monkeypatch.setattr("automax_ros.replay.side_by_side.LEAST_PART_BYTES", 1)
    monkeypatch.setattr("automax_ros.parallel.cluster.CONNECT_S", 1)
    bag = tmp_path / "bag"
    split = ("--record-split-s", "1")
    assert automax("run", RACK, "--simulated", "--duration", "2", "--record", bag, *split).code == 0
    result = automax("replay", bag, "--scheduler", "tcp://127.0.0.1:1")
    assert result.code == 2
    assert "AMX6851" in result.err or "AMX6852" in result.err
    assert "Traceback" not in result.err
