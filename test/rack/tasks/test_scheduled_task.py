"""What comes after each scan of a rack: who is told, and what a fault stops."""

from __future__ import annotations

import pytest

from automax_ros.rack.rack import Rack
from automax_ros.rack.tasks.scheduled_task import ScanEnd
from automax_ros.runtime.tasks.task import OVERLAP
from rack.helpers import HEAD, Observer, good


class Told(Observer):
    """Keeps the scans."""

    def __init__(self):
        self.scans = []

    def scanned(self, task, record, writes):
        self.scans.append((task.name, record.scan, [group.changes for group in writes]))


@pytest.fixture
def rack(tmp_path):
    return Rack(good(tmp_path, f"{HEAD}common:\n  REF%: {{}}\n"))


def end_of(rack):
    stopped = []
    return ScanEnd(rack.observers, rack.inputs, lambda *why: stopped.append(why)), stopped


def test_observers_are_told_of_a_recorded_scan_with_its_writes(rack):
    end, stopped = end_of(rack)
    told, (task,) = Told(), rack.tasks
    rack.observe(told)
    task.run(0)
    rack.memory.commit([(rack.memory.view("REF%"), 7)], task.writer)
    end.ended(task, task.scan(0))
    end.ended(task, None)
    assert told.scans == [("LINE", 1, [[(rack.memory.view("REF%"), 7)]])]
    assert stopped == []


def test_a_fault_stops_all_and_says_why(rack):
    end, stopped = end_of(rack)
    (task,) = rack.tasks
    end.ended(task, task.fault(OVERLAP, 0))
    ((reason, hardware, name),) = stopped
    assert reason.startswith("task LINE: scan 1, line 10: AMX7070")
    assert (hardware, name) == ("14", "LINE")
