"""Edited tasks: what the replay says of each variable is what running old and new source shows."""

from __future__ import annotations

import random
import struct
import tempfile
from pathlib import Path

import pytest
from compile.programs import DECLARATIONS
from rack.helpers import Observer, rack_from
from soaking import in_soak

from automax_ros.core.names import element_name
from automax_ros.core.types import Value
from automax_ros.rack.rack import Rack
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.replay.scans.report import DifferenceKind
from automax_ros.runtime.memory.views import WriteGroup
from automax_ros.runtime.tasks.task import ScanRecord, Task
from replay.replays import SPEED, WORK, edited, record, recorded, replayed
from replay.replays import YAML as YAML_OF_TWO
from replay.test_replay_random import YAML

NAMES = ("KA%", "KB%", "KF%", "KT%(0)", "KT%(1)", "A%", "B%")
STATEMENTS = (
    "CALL SUMMER(INPUT1={a}, INPUT2={b}, OUTPUT={c})",
    "IF {a} > {b} THEN {c} = {a}",
    "{c} = {a} + {n}",
    "{c} = {a} - {b}",
    "{c} = {n}",
    "{c} = {a}",
    "GOSUB 500",
    "FOR F0% = 0 TO 2\n{c} = {c} + F0%\nNEXT F0%",
)


class AfterScans(Observer):
    """All of common memory behind each scan, bit for bit."""

    def __init__(self, rack: Rack) -> None:
        self._rack = rack
        self.values: dict[int, dict[str, object]] = {}

    def scanned(self, task: Task, record: ScanRecord, writes: list[WriteGroup]) -> None:  # noqa: ARG002
        seen: dict[str, object] = {}
        for view, variable in enumerate(self._rack.config.variables):
            present = self._rack.memory.present(view)
            values: list[Value] = present if isinstance(present, list) else [present]
            for element, value in enumerate(values):
                exact = struct.pack("<d", value) if isinstance(value, float) else value
                seen[element_name(variable, element)] = exact
        self.values[record.scan] = seen


def statements(choice: random.Random) -> list[str]:
    made = []
    for _ in range(choice.randint(3, 9)):
        a, b, c = (choice.choice(NAMES) for _ in "abc")
        made.append(choice.choice(STATEMENTS).format(a=a, b=b, c=c, n=choice.randint(0, 9)))
    return made


def source(body: list[str], subroutine: str) -> str:
    lines = "\n".join(body).split("\n")
    numbered = "".join(f"{30 + 5 * number} {line}\n" for number, line in enumerate(lines))
    tail = f"400 GOTO 900\n500 {subroutine}\n510 RETURN\n900 END\n"
    return f"{DECLARATIONS}20 CALL SCAN_LOOP(TICKS=1)\n{numbered}{tail}"


def edit(body: list[str], choice: random.Random) -> list[str]:
    """Delete a statement, exchange two, or put another in its place."""
    changed = list(body)
    place, way = choice.randrange(len(changed)), choice.random()
    if way < 0.4:
        del changed[place]
    elif way < 0.8:
        other = choice.randrange(len(changed))
        changed[place], changed[other] = changed[other], changed[place]
    else:
        changed[place] = statements(choice)[0]
    return changed


def ran(text: str, history: list[dict[str, int]], folder: Path) -> tuple[Path, dict[int, dict[str, object]]]:
    """Run and record a task, with writes from outside between its scans."""
    folder.mkdir()
    rack = rack_from(folder, YAML, TASK=text)
    after = AfterScans(rack)
    rack.observe(after)

    def write(made: Rack, number: int) -> None:
        for name, value in history[number - 1].items() if number else ():
            made.write(name, value)

    return record(rack, folder / "bag", write, slices=5, seconds=5 * 0.022), after.values


def check_edit(seed: int) -> bool:
    """Compare one edit; return whether it had any effect."""
    choice = random.Random(seed)
    body, subroutine = statements(choice), choice.choice(["KA% = KA% + 1", "KB% = KA%", "KT%(1) = KF%"])
    old, new = source(body, subroutine), source(edit(body, choice), subroutine)
    history = [{choice.choice(["KA%", "KB%", "KF%"]): choice.randint(0, 9)} for _ in range(4)]
    with tempfile.TemporaryDirectory() as name:
        bag, before = ran(old, history, Path(name) / "old")
        _, after = ran(new, history, Path(name) / "new")
        report = replayed(bag, {"TASK": new}, max_differences=1000)
    expected: dict[str, int] = {}
    for scan in sorted(before):
        for variable, value in before[scan].items():
            if value != after[scan][variable]:
                expected.setdefault(variable, scan)
    found = {item.name: item.first.scan for item in report.differences if item.kind is DifferenceKind.VARIABLE}
    assert found == expected, f"{old}---\n{new}"
    return bool(expected)


@pytest.mark.parametrize(("seeds", "least"), [(range(25), 5), in_soak(range(100, 1500), 400, timeout_s=1200)])
def test_edits_differ_where_running_both_differs(seeds, least):
    assert sum(map(check_edit, seeds)) > least


def test_a_dropped_write_is_not_read_back_from_the_recording(tmp_path):
    head = "10 COMMON REF%, SPARE%\n100 CALL SCAN_LOOP(TICKS=1)\n"
    text = f"{head}110 SPARE% = 5\n120 REF% = SPARE%\n130 SPARE% = 7\n140 END\n"
    bag = recorded(tmp_path, None, SPEED=text)
    report = replayed(bag, {"SPEED": edited(text, ("110 SPARE% = 5\n", ""))})
    (found,) = report.differences
    assert (found.name, found.first.scan, found.first.recorded, found.first.replayed) == ("REF%", 1, 5, 0)


STOPS = edited(WORK, ("200 END", "195 IF COUNT! > 20 THEN STOP\n200 END"))


def test_a_stop_that_is_taken_away_is_a_difference(tmp_path):
    bag = recorded(tmp_path, None, WORK=STOPS)
    report = replayed(bag, {"WORK": WORK})
    (found,) = report.differences
    assert (found.kind, found.first.recorded, found.first.replayed) == (
        DifferenceKind.STATUS,
        "ended by itself",
        "runs",
    )
    assert found.first.scan == 16


def test_a_stop_in_the_last_recorded_scan_is_a_difference(tmp_path):
    bag = recorded(tmp_path, None, seconds=0.2)
    last = 0.2 // 0.011 + 1
    report = replayed(bag, {"WORK": edited(STOPS, ("COUNT! > 20", f"COUNT! >= {5 + last:.0f}"))})
    assert report.tasks[1].scans == 1 + last
    (found,) = report.differences
    assert (found.kind, found.first.recorded, found.first.replayed) == (DifferenceKind.STATUS, "runs", "ended by STOP")


def test_a_stop_that_stays_is_none(tmp_path):
    bag = recorded(tmp_path, None, WORK=STOPS)
    assert replayed(bag).identical
    assert replayed(bag, {"WORK": f"1 ! edited\n{STOPS}"}).identical


def test_a_task_that_was_stopped_from_outside_is_no_difference(tmp_path):
    def stop(rack: Rack, number: int) -> None:
        if number == 4:
            rack.task("WORK").stop()

    bag = recorded(tmp_path, stop)
    assert replayed(bag, {"WORK": f"1 ! edited\n{WORK}"}).identical


def test_a_task_that_was_asked_for_must_be_compared(tmp_path):
    bag = recorded(tmp_path, None, seconds=2.0)
    with pytest.raises(BagError, match="no scan of task WORK was executed again") as caught:
        replayed(bag, {"WORK": f"1 ! edited\n{WORK}"}, from_ns=1_991_100_000)
    assert caught.value.code == "AMX6832"
    with pytest.raises(BagError, match="no scan of task WORK"):
        replayed(bag, only=("SPEED", "WORK"), from_ns=1_991_100_000)
    with pytest.raises(BagError, match="holds no scan of SPEED, WORK in the range"):
        replayed(bag, from_ns=1_991_100_000, to_ns=1_992_000_000)
    assert replayed(bag, {"SPEED": f"1 ! edited\n{SPEED}"}, from_ns=1_990_000_000).identical


def test_a_difference_that_grows_does_not_settle(tmp_path):
    counts = "10 COMMON COUNT!\n100 CALL SCAN_LOOP(TICKS=1)\n110 COUNT! = COUNT! + 1\n120 END\n"
    bag = recorded(tmp_path, None, seconds=4.0, SPEED=counts, WORK=SPEED)
    (found,) = replayed(bag, {"SPEED": edited(counts, ("COUNT! + 1", "COUNT! + 2"))}).differences
    assert found.settled is None
    assert found.greatest is not None
    assert found.greatest.difference > 700


def test_a_range_that_begins_with_a_recorded_state_has_the_scan_of_that_instant(tmp_path):
    """States come every 10 s after a scan; a period that divides 10 s puts a scan just there."""
    yaml = YAML_OF_TWO.replace("tick_ms: 5.5", "tick_ms: 5.0")
    bag = recorded(tmp_path, None, yaml=yaml, seconds=10.1)
    report = replayed(bag, only=("SPEED",), from_ns=10_000_000_000, to_ns=10_004_000_000)
    assert (report.scans, report.identical, report.tasks[0].notes) == (1, True, ())
