"""Random tasks, recorded in a rack and replayed: identical, whatever they do."""

from __future__ import annotations

import tempfile
from pathlib import Path

from compile.programs import checked, outside_writes, tasks
from hypothesis import strategies as st
from rack.helpers import rack_from
from soaking import holds_for

from automax_ros.rack.rack import Rack
from replay.replays import record, replayed

YAML = """\
rack: LINE1
slots:
  0:
    module: 57C435
    tick_ms: 5.5
    tasks:
      TASK: {priority: 4}
common: {KA%: {}, KB%: {}, KD!: {}, KR: {}, KX@: {}, KY@: {}, KS$: {}, KT%(4): {}, KV(2): {}, KW@(2): {}, KF%: {}}
"""
HISTORY = st.lists(outside_writes(), min_size=4, max_size=4)


def recording(text: str, history, folder: Path) -> Path:
    """The task in a rack of its own, 5 scans long, with writes from outside between its scans."""
    checked(text)
    rack = rack_from(folder, YAML, TASK=text)

    def write(made: Rack, number: int) -> None:
        for name, value in history[number - 1].items() if number else ():
            made.write(name, value)
        if number == 3:
            made.tune(made.task("TASK"), "G%", -7)

    return record(rack, folder / "bag", write, slices=5, seconds=5 * 0.022)


@holds_for(15, tasks(), HISTORY, soak=(500, (tasks(4), HISTORY)))
def test_random_tasks_replay_identically(text, history) -> None:
    with tempfile.TemporaryDirectory() as name:
        bag = recording(text, history, Path(name))
        report = replayed(bag)
        assert report.identical, report.text()
        assert report.scans >= 1
        begun = replayed(bag, from_ns=30_000_000) if report.scans > 3 else report
        assert begun.identical, begun.text()


@holds_for(10, tasks(), HISTORY, soak=(250, (tasks(4), HISTORY)))
def test_a_remark_changes_nothing(text, history) -> None:
    """As an edited task, which is compared by variable: still identical."""
    with tempfile.TemporaryDirectory() as name:
        bag = recording(text, history, Path(name))
        report = replayed(bag, {"TASK": f"1 ! edited\n{text}"})
        assert report.tasks[0].edited
        assert report.identical, report.text()
