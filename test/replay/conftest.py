"""Each replay of these tests runs both ways, by columns and scan by scan: reports and errors are the same."""

from dataclasses import replace

import pytest

from automax_ros.bags.errors import BagError
from automax_ros.replay.engine import Replay
from automax_ros.replay.report import ReplayReport


def outcome(run, *arguments, **named) -> ReplayReport | tuple[str, str]:
    try:
        return run(*arguments, **named)
    except BagError as error:
        return error.code, str(error)


@pytest.fixture(autouse=True)
def both_ways(monkeypatch: pytest.MonkeyPatch) -> None:
    run = Replay.run

    def run_both(self, on_progress=None, watcher=None, to_ns=None) -> ReplayReport:
        if watcher is None and self.options.by_columns:
            options, quick = self.options, outcome(run, self, None, None, to_ns)
            self.options = replace(options, by_columns=False)
            slow = outcome(run, self, None, None, to_ns)
            self.options = options
            assert quick == slow
        return run(self, on_progress, watcher, to_ns)

    monkeypatch.setattr(Replay, "run", run_both)
