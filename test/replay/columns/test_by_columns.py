"""A replay by columns finds what the path scan by scan finds, and takes by columns what is uniform.

That the reports are the same ``test/replay/conftest.py`` proves for every recording of these rooms.
"""

from __future__ import annotations

import contextlib
import random
from pathlib import Path

import pytest

from automax_ros.bags.errors import BagError
from automax_ros.compile.native.forms import NativeForms, NativeMode
from automax_ros.core.diagnostics import SourceText
from automax_ros.replay.columns.stretch import TaskStretches
from automax_ros.replay.engine import Replay, ReplayOptions
from automax_ros.wire.messages import CommonWrite, Scan
from automax_ros.wire.values import Values

from ..replays import SPEED, recorded, rewritten

GOLDEN = Path(__file__).parents[3] / "bags" / "section_drive"
CALM = """\
10 COMMON GAIN, TOTAL, TABLE%(1,2), COUNT!, FLAG@, OUT%
20 LOCAL I%, J%, NIL%
100 CALL SCAN_LOOP(TICKS=2)
110 TOTAL = TOTAL * 0.5 + GAIN
130 FOR I% = 0 TO 2
140 J% = TABLE%(0,I%) + I%
150 TABLE%(1,I%) = J%
160 NEXT I%
170 COUNT! = COUNT! + 1
180 FLAG@ = TOTAL > 2.0
190 IF OUT% > 200 THEN J% = J% / NIL%
200 END
"""


@pytest.fixture
def taken(monkeypatch: pytest.MonkeyPatch) -> dict[str, int]:
    """How many scans of each task went by columns."""
    counts: dict[str, int] = {}
    take = TaskStretches.take

    def counted(self: TaskStretches, scans, *, counted: bool) -> int:
        same = take(self, scans, counted=counted)
        name = self._replay.name
        counts[name] = counts.get(name, 0) + same
        return same

    monkeypatch.setattr(TaskStretches, "take", counted)
    return counts


def report(bag: Path, new: dict[str, SourceText] | None = None, **options):
    return Replay(bag, new or {}, ReplayOptions(**options)).run()


def test_nearly_all_scans_of_the_golden_recording_go_by_columns(taken: dict[str, int]):
    found = report(GOLDEN)
    assert found.identical
    # The fixture of this room replays it once more, by columns too.
    assert sum(taken.values()) > 2 * 0.95 * found.scans


def test_reads_writes_and_errors_go_by_columns(taken: dict[str, int], tmp_path: Path):
    found = report(recorded(tmp_path, WORK=CALM))
    assert found.identical
    scans = {task.name: task.scans for task in found.tasks}
    assert taken["WORK"] > 2 * 0.5 * scans["WORK"]
    assert taken["SPEED"] > 2 * 0.5 * scans["SPEED"]


def test_a_task_with_strings_goes_scan_by_scan_and_keeps_no_other_from_columns(taken: dict[str, int], tmp_path: Path):
    found = report(recorded(tmp_path))
    scans = {task.name: task.scans for task in found.tasks}
    assert taken["WORK"] == 0
    assert taken["SPEED"] > 2 * 0.5 * scans["SPEED"]


def test_an_edit_keeps_only_its_own_task_from_columns_and_only_where_it_differs(taken: dict[str, int], tmp_path: Path):
    bag = recorded(tmp_path, WORK=CALM)
    same = {"SPEED": SourceText("SPEED.BLK", SPEED.replace("END", "END\n"))}
    assert report(bag, same).identical
    assert taken["SPEED"] > 0
    taken.clear()
    other = {"SPEED": SourceText("SPEED.BLK", SPEED.replace("WLG=10.0", "WLG=20.0"))}
    assert not report(bag, other).identical
    work = next(task.scans for task in report(bag).tasks if task.name == "WORK")
    assert taken["WORK"] > 0.5 * work


def test_native_columns_give_the_same_report(tmp_path: Path):
    bag = recorded(tmp_path, WORK=CALM)
    expected = report(bag, by_columns=False)
    replay = Replay(bag, {}, ReplayOptions(native=NativeForms(NativeMode.ON)))
    assert replay.run() == expected
    assert replay.native == ["SPEED: native", "WORK: native"]


def changed_value(message: Scan | CommonWrite, chance: random.Random) -> Scan | CommonWrite | None:
    """A message with one of its values changed, None if it has none to change."""
    names = ("values",) if isinstance(message, CommonWrite) else ("latched", "read", "written", "committed")
    names = tuple(name for name in names if getattr(message, name).value and not getattr(message, name).text)
    if not names:
        return None
    name = chance.choice(names)
    values: Values = getattr(message, name)
    numbers = list(values.value)
    place = chance.randrange(len(numbers))
    numbers[place] = chance.choice((numbers[place] + 1, -numbers[place], 0.0, 1.0, 0.5, 1e9, float("nan"), -0.0))
    return message._replace(**{name: values._replace(value=numbers)})


@pytest.mark.parametrize("seed", range(12))
def test_a_changed_value_is_found_the_same_way(tmp_path: Path, seed: int):
    """The fixture of this room compares the reports, or the errors."""
    chance = random.Random(seed)
    bag = recorded(tmp_path, WORK=CALM)
    which = chance.randrange(50, 500)
    seen = 0

    def change(message):
        nonlocal seen
        if not isinstance(message, Scan | CommonWrite):
            return message
        seen += 1
        return (changed_value(message, chance) or message) if seen in (which, which + 60) else message

    other = rewritten(bag, tmp_path / "other", change)
    assert seen > which
    with contextlib.suppress(BagError):
        report(other)
