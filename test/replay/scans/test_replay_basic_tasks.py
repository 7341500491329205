"""Recordings of racks with BASIC tasks replay bit for bit: each burst with what it got out of channels."""

from __future__ import annotations

from pathlib import Path

import pytest
from rack.helpers import rack_at

from automax_ros.core.diagnostics import SourceText
from automax_ros.rack.rack import Rack
from automax_ros.replay.engine import replay
from replay.replays import record, replayed

YAML = """\
rack: LINE1
execution: {execution}
slots:
  0: {{module: 57C413}}
  1:
    module: 57C435
    tick_ms: 5.5
    tasks:
      FAST: {{priority: 4}}
      SENDER: {{file: SENDER.BAS, priority: 9}}
  2:
    module: 57C431
    tick_ms: 2
    tasks:
      READER: {{file: READER.BAS, priority: 10}}
common:
  REF%: {{preset: 100}}
  OUT%: {{}}
  TOTAL: {{}}
  NOTE$:20: {{}}
  LEFT%: {{}}
"""
FAST = """\
10 COMMON REF%, OUT%
20 EVENT NAME = NEW_VALUE
30 LOCAL LAST%
40 CALL SCAN_LOOP(TICKS=2)
50 CALL LAG(INPUT=REF%, WLG=5.0, OUTPUT=OUT%)
60 IF OUT% <> LAST% THEN SET NEW_VALUE
70 LAST% = OUT%
80 END
"""
SENDER = """\
10 COMMON OUT%
20 LOCAL N%, D!
30 EVENT NAME = NEW_VALUE
40 OPEN CHANNEL FOR OUTPUT AS FILE #3, TYPE = (I, D, R, S, B)
50 WAIT ON NEW_VALUE
60 N% = N% + 1
70 D! = N% * 100000
80 PRINT:FULL=50 #3, OUT%, D!, OUT% / 3.0, "GRÜSSE " + STR$(N%), N% > 10
90 GOTO 50
100 END
"""
READER = """\
10 COMMON TOTAL, NOTE$:20, LEFT%
20 LOCAL A%, D!, X, S$, F@, I%
30 OPEN CHANNEL FOR INPUT AS FILE #3, TYPE = (I, D, R, S, B), DEPTH = 4
40 START EVERY 7 TICKS
50 FOR I% = 1 TO 3
60 INPUT:EMPTY=90 #3, A%, D!, X, S$, F@
70 TOTAL = TOTAL + X + D!
80 NOTE$ = S$
90 LEFT% = LEFT% + 1
100 DELAY 1 TICKS
110 NEXT I%
120 IF F@ THEN LEFT% = LEFT% + 100
130 END
"""


def rack_of(folder: Path, execution: str = "ideal") -> Rack:
    (folder / "rack.yaml").write_text(YAML.format(execution=execution))
    for name, text in (("FAST.BLK", FAST), ("SENDER.BAS", SENDER), ("READER.BAS", READER)):
        (folder / name).write_text(text)
    return rack_at(folder / "rack.yaml")


def steps(rack: Rack, number: int) -> None:
    rack.write("REF%", (number * 377) % 2000)
    if number == 9:
        rack.operations.stop("READER")
    if number == 12:
        rack.operations.run("READER")


@pytest.mark.parametrize("execution", ["ideal", "modeled"])
def test_a_rack_with_basic_tasks_replays_bit_for_bit(tmp_path, execution):
    rack = rack_of(tmp_path, execution)
    bag = record(rack, tmp_path / "bag", steps)
    assert rack.value("NOTE$").startswith("GRÜSSE ")
    for from_ms in (0, 700, 1300):
        report = replayed(bag, from_ns=from_ms * 10**6)
        assert report.identical, report.differences
        names = {task.name: task for task in report.tasks}
        assert min(task.scans for task in names.values()) > 20
        assert not any("could not" in note for task in report.tasks for note in task.notes)


def test_an_edited_basic_task_differs_where_it_first_acts_otherwise(tmp_path):
    bag = record(rack_of(tmp_path), tmp_path / "bag", steps)
    edited = SourceText("READER.BAS", READER.replace("TOTAL + X", "TOTAL + X + 1.0"))
    report = replay(bag, {"READER": edited})
    assert [task.name for task in report.tasks if task.different] == ["READER"]
    assert report.first is not None
    assert [item.name for item in report.first.differences] == ["TOTAL"]
    assert ("channel #3", 0) in [(read.name, read.value) for read in report.first.read]


@pytest.mark.parametrize(
    ("old", "new", "recorded", "replayed_as"),
    [
        ("OUT% / 3.0", "OUT% / 4.0", '30, 100000, 10.0, "GRÜSSE 1", FALSE', '30, 100000, 7.5, "GRÜSSE 1", FALSE'),
        (
            "N% > 10",
            "N% > 9",
            '196, 1000000, 65.333336, "GRÜSSE 10", FALSE',
            '196, 1000000, 65.333336, "GRÜSSE 10", TRUE',
        ),
        ("80 PRINT:FULL", "75 GOTO 50\n80 PRINT:FULL", '30, 100000, 10.0, "GRÜSSE 1", FALSE', "no message"),
    ],
)
def test_a_message_that_an_edited_task_sends_otherwise_is_a_difference(tmp_path, old, new, recorded, replayed_as):
    bag = record(rack_of(tmp_path), tmp_path / "bag", steps)
    report = replay(bag, {"SENDER": SourceText("SENDER.BAS", SENDER.replace(old, new))})
    assert [task.name for task in report.tasks if task.different] == ["SENDER"]
    assert report.first is not None
    (found,) = report.first.differences
    assert found.name == "message to channel #3"
    assert (found.first.recorded, found.first.replayed) == (recorded, replayed_as)


def test_two_simulated_runs_are_the_same_bag(tmp_path):
    bags = []
    for name in ("one", "two"):
        folder = tmp_path / name
        folder.mkdir()
        bag = record(rack_of(folder), folder / "bag", steps)
        bags.append({path.name: path.read_bytes() for path in bag.iterdir()})
    assert bags[0] == bags[1]
