"""A replay by columns finds what the path scan by scan finds, and takes by columns what is uniform.

That the reports are the same ``test/replay/conftest.py`` proves for every recording of these rooms.
"""

from __future__ import annotations

import contextlib
import random
from pathlib import Path

import pytest

from automax_ros.compile.native.run.forms import NativeForms, NativeMode
from automax_ros.core.diagnostics import SourceText
from automax_ros.messages.types.messages import CommonWrite, Scan, TaskState, Values
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.recordings.write.recorder import RecordingOptions
from automax_ros.replay.columns.stretch import TaskStretches
from automax_ros.replay.engine import Replay, ReplayOptions
from replay.replays import SPEED, YAML, recorded, rewritten

GOLDEN = Path(__file__).parents[2] / "bags" / "section_drive"
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


@pytest.fixture(autouse=True)
def columns_are_available(column_library) -> None:
    if column_library is None:
        pytest.skip("there is no C compiler")


@pytest.fixture(scope="module")
def calm(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recording all of whose tasks can go by columns."""
    return recorded(tmp_path_factory.mktemp("calm"), WORK=CALM)


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
    assert sum(taken.values()) > 0.95 * found.scans


def test_reads_writes_and_errors_go_by_columns(taken: dict[str, int], calm: Path):
    found = report(calm)
    assert found.identical
    scans = {task.name: task.scans for task in found.tasks}
    assert taken["WORK"] > 0.5 * scans["WORK"]
    assert taken["SPEED"] > 0.5 * scans["SPEED"]


def test_a_task_with_strings_goes_scan_by_scan_and_keeps_no_other_from_columns(taken: dict[str, int], tmp_path: Path):
    found = report(recorded(tmp_path))
    scans = {task.name: task.scans for task in found.tasks}
    assert taken["WORK"] == 0
    assert taken["SPEED"] > 0.5 * scans["SPEED"]


def test_an_edit_keeps_only_its_own_task_from_columns_and_only_where_it_differs(taken: dict[str, int], calm: Path):
    same = {"SPEED": SourceText("SPEED.BLK", SPEED.replace("END", "END\n"))}
    assert report(calm, same).identical
    assert taken["SPEED"] > 0
    taken.clear()
    other = {"SPEED": SourceText("SPEED.BLK", SPEED.replace("WLG=10.0", "WLG=20.0"))}
    assert not report(calm, other).identical
    work = next(task.scans for task in report(calm).tasks if task.name == "WORK")
    assert taken["WORK"] > 0.5 * work


def test_native_columns_give_the_same_report(calm: Path):
    expected = report(calm, by_columns=False)
    replay = Replay(calm, {}, ReplayOptions(native=NativeForms(NativeMode.ON)))
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
def test_a_changed_value_is_found_the_same_way(calm: Path, tmp_path: Path, seed: int):
    """The fixture of this room compares the reports, or the errors."""
    chance = random.Random(seed)
    which = chance.randrange(50, 500)
    seen = 0

    def change(message):
        nonlocal seen
        if not isinstance(message, Scan | CommonWrite):
            return message
        seen += 1
        return (changed_value(message, chance) or message) if seen in (which, which + 60) else message

    other = rewritten(calm, tmp_path / "other", change)
    assert seen > which
    with contextlib.suppress(BagError):
        report(other)


def cut_off(task: str, number: int):
    """Cut off the bytes of one scan of a task."""

    def cut(message, data: bytes) -> bytes:
        is_meant = isinstance(message, Scan) and (message.task, message.scan) == (task, number)
        return data[:60] if is_meant else data

    return cut


@pytest.mark.parametrize("only", [("SPEED",), ("WORK",), None])
def test_a_malformed_scan_is_told_whatever_is_replayed(tmp_path: Path, only: tuple[str, ...] | None):
    other = rewritten(recorded(tmp_path, WORK=CALM), tmp_path / "other", payload=cut_off("WORK", 100))
    with pytest.raises(BagError, match="AMX6816"):
        report(other, only=only)


NOTHING = "10 LOCAL N%\n100 CALL SCAN_LOOP(TICKS=1)\n110 N% = N% + 1\n120 END\n"


def test_values_of_a_rack_that_has_no_variables_are_refused(tmp_path: Path):
    bag = recorded(tmp_path, None, yaml=YAML.partition("common:")[0], SPEED=NOTHING, WORK=NOTHING)
    assert report(bag).identical

    def change(message):
        if not isinstance(message, Scan) or message.scan < 100:
            return message
        return message._replace(latched=Values((0,), (0,), (1.0,)))

    with pytest.raises(BagError, match="there is no variable 0"):
        report(rewritten(bag, tmp_path / "other", change))


def test_a_state_after_the_last_scan_that_can_be_numbered_is_no_state_to_go_on_from(tmp_path: Path):
    seen = 0

    def change(message):
        nonlocal seen
        if isinstance(message, TaskState) and message.task == "WORK":
            seen += 1
            return message._replace(scan=(1 << 64) - 1) if seen == 2 else message
        return message

    bag = recorded(tmp_path, WORK=NOTHING, options=RecordingOptions(split_ns=500_000_000))
    found = report(rewritten(bag, tmp_path / "other", change))
    assert seen > 2
    assert any("18446744073709551615 are missing" in note for task in found.tasks for note in task.notes)


SLOW = """\
10 COMMON SPARE%, FLAG@
20 LOCAL N%, J%, I%
100 CALL SCAN_LOOP(TICKS=200)
120 N% = N% + 1
130 SPARE% = N%
140 FOR I% = 1 TO 400
150 J% = J% * 2 / 3
160 NEXT I%
170 FLAG@ = I% < 0
180 END
"""
FAST = """\
10 COMMON OUT%
100 CALL SCAN_LOOP(TICKS=1)
110 CALL SUMMER(INPUT1=OUT%, INPUT2=1, OUTPUT=OUT%)
120 END
"""


def test_an_edited_scan_reads_what_stood_there_before_the_recorded_one_has_written(tmp_path: Path):
    """A modeled scan stands in the log where it ended: here each in the file after that with its first write."""
    yaml = "rack: LINE1\nexecution: modeled\n" + YAML.partition("\n")[2].replace("tick_ms: 5.5", "tick_ms: 1.0")
    options = RecordingOptions(split_ns=101_000_000)
    bag = recorded(tmp_path, None, yaml=yaml, options=options, seconds=1.3, SPEED=FAST, WORK=SLOW)
    other = SLOW.replace("120 N%", "110 J% = SPARE%\n115 LAST% = J%\n120 N%").replace("I% < 0", "LAST% > 2")
    found = report(bag, {"WORK": SourceText("WORK.BLK", other.replace("I%\n100", "I%, LAST%\n100"))})
    assert found.first is not None
    assert found.first.scan == 4  # which reads what scan 3 wrote, not what it is about to write itself
