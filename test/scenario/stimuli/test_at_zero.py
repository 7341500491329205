"""Stimuli of time 0 come before what stands in front of SCAN_LOOP: before anything else of that instant."""

from __future__ import annotations

from pathlib import Path

import pytest
from rack.helpers import rack_at

from automax_ros.messages.stream.stream import RackStream
from automax_ros.recordings.write.recorder import Recorder
from automax_ros.replay.engine import replay
from automax_ros.scenario.report import report_of
from automax_ros.scenario.stimuli.player import StimuliPlayer
from automax_ros.scenario.stimuli.reader import read_for_rack

RACK = """\
rack: PM1
execution: {execution}
auto_run: true
slots:
  0: {{module: 57C435, tick_ms: 1.0, tasks: {{SPEED: {{priority: 5}}, DRAW: {{priority: 8, critical: true}}}}}}
common:
  REF%: {{preset: 5}}
  SEEN%: {{}}
  GAINED: {{}}
  COUNT%: {{}}
"""
SPEED = """\
10 COMMON REF%, SEEN%, GAINED
20 LOCAL KP [CURRENT=1.0, HIGH=10.0, LOW=0.5, STEP=0.1], N%
30 SEEN% = REF% + N%
40 GAINED = KP
50 CALL SCAN_LOOP(TICKS=1)
60 END
"""
DRAW = "10 COMMON COUNT%\n20 CALL SCAN_LOOP(TICKS=2)\n30 COUNT% = COUNT% + 1\n40 END\n"


class Run:
    """A run of 10 ms in a folder, recorded, with stimuli."""

    def __init__(self, folder: Path, stimuli: str, execution: str = "ideal") -> None:
        (folder / "SPEED.BLK").write_text(SPEED)
        (folder / "DRAW.BLK").write_text(DRAW)
        (folder / "NEW.BLK").write_text(SPEED.replace("REF% + N%", "1000"))
        (folder / "rack.yaml").write_text(RACK.format(execution=execution))
        (folder / "stimuli.yaml").write_text(stimuli)
        self.rack = rack_at(folder / "rack.yaml")
        read = read_for_rack(folder / "stimuli.yaml", self.rack)
        assert read.stimuli is not None, read.diagnostics
        self.happening = StimuliPlayer(read.stimuli, self.rack.scheduler)
        stream = RackStream(self.rack, self.rack.fingerprint)
        recorder = Recorder(self.rack, stream, folder / "bag")
        stream.begin()
        self.rack.start(first=self.happening.begin)
        self.rack.run(0.010)
        stream.end()
        recorder.close()
        self.bag = folder / "bag"

    def value(self, name: str) -> object:
        return self.rack.value(name)

    def scans(self) -> dict[str, int]:
        return {name: item.scans for name, item in self.rack.statistics.items()}

    def ok(self) -> list[bool]:
        return [item.ok for item in self.happening.happened]


EXECUTIONS = pytest.mark.parametrize("execution", ["ideal", "modeled"])


@EXECUTIONS
@pytest.mark.parametrize(
    ("stimuli", "seen", "gained"),
    [
        ("- {at: 0, set: {REF%: 7}}\n", 7, 1.0),
        ("- {at: 0, ramp: {REF%: {to: 9, over: 0.0}}}\n", 9, 1.0),
        ("- {at: 0, force: {REF%: 8}}\n", 8, 1.0),
        ("- {at: 0, force: {SPEED.N%: 100}}\n", 105, 1.0),
        ("- {at: 0, tune: {SPEED.KP: 2.5}}\n", 5, 2.5),
        ("- {at: 0, reload: {SPEED: NEW.BLK}}\n", 1000, 1.0),
        ("- {at: 0.000000001, set: {REF%: 7}}\n", 5, 1.0),
        ("- {at: 0, stop: [SPEED]}\n- {at: 0, set: {REF%: 6}}\n- {at: 0, run: [SPEED]}\n", 6, 1.0),
        ("- {at: 0, stop_all: true}\n- {at: 0, set: {REF%: 6}}\n- {at: 0, run_all: true}\n", 6, 1.0),
    ],
)
def test_start_up_parts_see_it(tmp_path, execution, stimuli, seen, gained):
    run = Run(tmp_path, stimuli, execution)
    assert all(run.ok())
    assert (run.value("SEEN%"), run.value("GAINED")) == (seen, gained)
    assert run.scans() == {"SPEED": 10, "DRAW": 5}


@EXECUTIONS
def test_a_task_that_is_stopped_at_0_does_not_begin(tmp_path, execution):
    run = Run(tmp_path, "- {at: 0, stop: [SPEED]}\n- {at: 0.0045, run: [SPEED]}\n", execution)
    assert run.scans() == {"SPEED": 5, "DRAW": 5}
    assert run.value("SEEN%") == 5


@EXECUTIONS
def test_stop_all_at_0_keeps_all_tasks_from_beginning(tmp_path, execution):
    run = Run(tmp_path, "- {at: 0, stop_all: true}\n", execution)
    assert run.scans() == {"SPEED": 0, "DRAW": 0}
    report = report_of(run.rack, run.happening.happened)
    assert report["stopped"]["time_s"] == 0.0
    assert run.value("SEEN%") == 0


@EXECUTIONS
def test_a_power_failure_at_0_ends_with_the_tasks_that_would_have_begun(tmp_path, execution):
    run = Run(tmp_path, "- {at: 0, stop: [SPEED]}\n- {at: 0, power: {off_for: 0.005}}\n", execution)
    assert run.scans()["SPEED"] == 0
    assert run.value("COUNT%") == 2


def test_tasks_that_are_about_to_begin_count_as_running(tmp_path):
    run = Run(tmp_path, "- {at: 0, run: [SPEED]}\n- {at: 0, stop: [DRAW]}\n- {at: 0, delete: [SPEED]}\n")
    assert run.ok() == [False, False, False]
    assert run.scans() == {"SPEED": 10, "DRAW": 5}


@EXECUTIONS
@pytest.mark.parametrize(
    "stimuli",
    [
        "- {at: 0, set: {REF%: 7}}\n- {at: 0, tune: {SPEED.KP: 2.5}}\n",
        "- {at: 0, force: {REF%: 8, SPEED.N%: 100}}\n- {at: 0.005, unforce: all}\n",
        "- {at: 0, reload: {SPEED: NEW.BLK}}\n",
        "- {at: 0, stop: [SPEED]}\n- {at: 0.0045, run: [SPEED]}\n",
        "- {at: 0, stop_all: true}\n- {at: 0.0045, run_all: true}\n",
        "- {at: 0, stop_all: true}\n- {at: 0, run_all: true}\n",
        "- {at: 0, power: {off_for: 0.005}}\n",
    ],
)
def test_a_replay_of_it_does_the_same(tmp_path, execution, stimuli):
    run = Run(tmp_path, stimuli, execution)
    result = replay(run.bag)
    assert result.identical, result.text()
