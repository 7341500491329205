"""Modeled execution: commit times, pre-emption, overlap."""

from __future__ import annotations

import pytest

from automax_ros.rack.loader import load
from automax_ros.rack.rack import Rack
from automax_ros.running.task import Status

TASK = """10 COMMON {name}%
20 CALL SCAN_LOOP(TICKS={ticks})
30 CALL SUMMER(INPUT1={name}%, INPUT2=1, OUTPUT={name}%)
40 END
"""
SCAN_US = 80.00 + 1.6 + 2.5
"""SCAN_LOOP of a 7010 with one INTEGER common (table 4)."""
END_US = 13.82 + 2.0 + 1.6


def rack_of(tmp_path, tasks: dict[str, tuple[int, int]], tick: str = "0.5") -> Rack:
    """A modeled rack of one 7010: priority and TICKS by task, each counting a common of its own name."""
    lines = "".join(f"      {name}: {{priority: {priority}}}\n" for name, (priority, _) in tasks.items())
    commons = "".join(f"  {name}%:\n" for name in tasks)
    module = f"    module: 57C435\n    tick_ms: {tick}\n    tasks:\n"
    text = f"rack: R\nexecution: modeled\nslots:\n  0:\n{module}{lines}common:\n{commons}"
    (tmp_path / "rack.yaml").write_text(text)
    for name, (_, ticks) in tasks.items():
        (tmp_path / f"{name}.BLK").write_text(TASK.format(name=name, ticks=ticks))
    result = load(tmp_path / "rack.yaml")
    assert result.config is not None, result.diagnostics
    return Rack(result.config)


def commits(rack: Rack, seconds: float) -> list[tuple[str, int]]:
    """Who wrote when, in the order of the write log."""
    rack.memory.keep_log()
    rack.start()
    rack.run(seconds)
    names = [spec.name for spec in rack.memory.specs]
    return [(names[write.view], write.time_ns) for write in rack.memory.drain()]


def test_a_scan_commits_when_its_time_has_passed(tmp_path):
    found = commits(rack_of(tmp_path, {"A": (5, 1)}), 0.001)
    first = found[0][1]
    assert [entry[1] - first for entry in found] == [0, 500_000]
    assert first > (SCAN_US + END_US) * 1000


def test_a_higher_priority_suspends_a_lower_one(tmp_path):
    alone = commits(rack_of(tmp_path, {"A": (5, 1)}), 0.0004)[0][1]
    found = commits(rack_of(tmp_path, {"LOW": (9, 2), "HIGH": (4, 1)}), 0.0005)
    assert [name for name, _ in found] == ["HIGH%", "LOW%"]
    assert [time for _, time in found] == [alone, 2 * alone]


def test_an_overlap_stops_all(tmp_path):
    tasks = {f"T{number}": (4 + number, 1) for number in range(6)}
    rack = rack_of(tmp_path, tasks)
    rack.start()
    rack.run(0.01)
    assert rack.operations.stopped is not None
    assert rack.operations.stopped.code == "14"
    assert rack.operations.stopped.time_ns == 500_000
    faulted = [task.name for task in rack.tasks if task.status is Status.FAULTED]
    assert faulted == [rack.operations.stopped.task]
    last = rack.task(faulted[0]).errors.last
    assert last is not None
    assert last.problem == "AMX7070"


@pytest.mark.parametrize("parts", [1, 7])
def test_time_may_pass_in_pieces(tmp_path, parts):
    whole = rack_of(tmp_path, {"LOW": (9, 2), "HIGH": (4, 1)})
    expected = commits(whole, 0.07)
    rack = rack_of(tmp_path, {"LOW": (9, 2), "HIGH": (4, 1)})
    rack.memory.keep_log()
    rack.start()
    for _ in range(parts):
        rack.run(0.07 / parts)
    names = [spec.name for spec in rack.memory.specs]
    assert [(names[write.view], write.time_ns) for write in rack.memory.drain()] == expected
