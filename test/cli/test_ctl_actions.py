"""What `automax ctl` asks of a rack for the words that a user writes."""

import argparse

import pytest

from automax_ros.cli.ctl_actions import ACTIONS
from automax_ros.cli.usage import UsageError


def asked(action: str, *words: str) -> list[dict[str, object]]:
    parser = argparse.ArgumentParser()
    ACTIONS[action].add_arguments(parser)
    return [dict(ask.fields) for ask in ACTIONS[action].asks(parser.parse_args(words))]


def test_all_means_all_as_in_stimuli():
    assert asked("unforce", "all") == asked("unforce", "--all") == [{"names": []}]
    assert asked("clear", "all") == asked("clear") == [{"task": ""}]
    assert asked("unforce", "A%", "ALL") == [{"names": ["A%", "ALL"]}]
    assert asked("clear", "ONE", "TWO") == [{"task": "ONE"}, {"task": "TWO"}]


@pytest.mark.parametrize("words", [(), ("--all", "A%")])
def test_unforce_wants_names_or_all(words):
    with pytest.raises(UsageError, match="takes names, or --all"):
        asked("unforce", *words)
