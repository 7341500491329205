"""One rack with all that a rack has, operated by a script, recorded and replayed: bit for bit."""

from __future__ import annotations

from pathlib import Path

import pytest
from recordings.live_racks import build

from automax_ros.core.diagnostics import SourceText
from automax_ros.core.kinds import WriteKind
from automax_ros.core.ticks import NS_PER_MS
from automax_ros.messages.types.messages import CommonWrite, Operation, Scan, VariableTable
from automax_ros.rack.base.stop_cause import OperationRefused
from automax_ros.rack.rack import Rack
from automax_ros.recordings.info.info import bag_info
from automax_ros.recordings.read.reader import BagReader
from automax_ros.recordings.write.recorder import RecordingOptions
from automax_ros.replay.engine import ReplayOptions, replay
from automax_ros.runtime.tasks.task import OVERLAP
from replay.replays import edited, record, replayed

YAML = """\
rack: LINE1
operator: true
execution: {execution}
auto_run: true
slots:
  0: {{module: 57C413}}
  1:
    module: 57C435
    tick_ms: 5.5
    tasks:
      SPEED: {{priority: 4}}
      WORK: {{priority: 8}}
      TELLER: {{priority: 11, file: TELLER.BAS}}
  2:
    module: 57C431
    tick_ms: 2.5
    tasks:
      FOLLOW: {{priority: 5}}
      LISTEN: {{priority: 9, file: LISTEN.BAS}}
  3: {{module: 57C419}}
common:
  REF%: {{preset: 100, unit: counts}}
  OUT%: {{}}
  SUM!: {{}}
  TOTAL: {{non_volatile: true}}
  RUN@: {{}}
  TABLE%(39): {{}}
  HEARD$:20: {{}}
  HEARD%: {{}}
  BEAT!: {{}}
  PUSH@: {{slot: 3, register: 0, bit: 3, ros: in}}
"""
SPEED = """\
10 COMMON REF%, OUT%, RUN@, PUSH@
15 EVENT NAME=GO
20 LOCAL TRIM% [CURRENT=1, HIGH=10, LOW=0], LAST%
100 CALL SCAN_LOOP(TICKS=1)
110 CALL SUMMER(INPUT1=REF%, INPUT2=TRIM%, OUTPUT=LAST%)
120 CALL LAG(INPUT=LAST%, WLG=10.0, RESET=-RUN@, OUTPUT=OUT%)
130 IF PUSH@ THEN SET GO
140 END
"""
WORK = """\
10 COMMON OUT%, SUM!, TOTAL, TABLE%(39), REF%
20 LOCAL I%, N!, NIL%
100 CALL SCAN_LOOP(TICKS=6)
110 FOR I% = 0 TO 39
120 TABLE%(I%) = TABLE%(I%) + OUT% - I%
130 SUM! = SUM! + TABLE%(I%) / 8
140 NEXT I%
150 TOTAL = TOTAL * 0.5 + REF%
160 N! = N! + 1
170 IF REF% = 13 THEN N! = N! / NIL%
180 END
"""
FOLLOW = """\
10 COMMON SUM!, BEAT!
20 LOCAL K!
100 CALL SCAN_LOOP(TICKS=2)
110 K! = K! + 1
120 BEAT! = BEAT! + SUM! / 16 + K!
130 END
"""
TELLER = """\
10 COMMON SUM!
20 LOCAL K%
25 EVENT NAME=GO
30 OPEN CHANNEL FOR OUTPUT AS FILE #9, TYPE = (I, S)
40 START EVERY 5 TICKS
45 WAIT ON GO
50 K% = K% + 1
60 PRINT #9, K%, "SUM " + STR$(SUM!)
70 END
"""
LISTEN = """\
10 COMMON HEARD$:20, HEARD%
20 LOCAL A%, A$:20
30 OPEN CHANNEL FOR INPUT AS FILE #9, TYPE = (I, S), DEPTH = 3
40 INPUT #9, A%, A$
50 HEARD% = HEARD% + A%
60 HEARD$ = A$
70 IF HEARD% > 1000 THEN HEARD% = 0
80 GOTO 40
90 END
"""
SOURCES = {"SPEED": SPEED, "WORK": WORK, "FOLLOW": FOLLOW}
LONG_WORK = edited(
    WORK,
    ("TICKS=6", "TICKS=1"),
    ("LOCAL I%", "LOCAL K%, I%"),
    ("110 FOR", "105 FOR K% = 1 TO 40\n110 FOR"),
    ("150 TOTAL", "145 NEXT K%\n150 TOTAL"),
)
OTHER_WORK = edited(WORK, ("/ 8", "/ 4"))


def operate(rack: Rack, number: int) -> None:
    """What plant and operator do before each of 40 slices of 50 ms."""
    rack.write("REF%", (number * 37) % 500)
    rack.write("RUN@", number % 7 != 6)
    rack.write("PUSH@", number % 3 == 1)
    script = {
        3: lambda: rack.adjust.tune("SPEED.TRIM%", 5),
        5: lambda: rack.adjust.force("OUT%", 77),
        8: rack.adjust.unforce,
        9: lambda: rack.operations.stop("SPEED"),
        10: lambda: rack.operations.run("SPEED"),
        12: lambda: rack.operations.reload("WORK", SourceText("WORK.BLK", OTHER_WORK), keep_state=True),
        15: lambda: rack.operations.stop("TELLER"),
        16: lambda: rack.operations.run("TELLER"),
        18: lambda: rack.operations.stop_all("the script"),
        19: rack.operations.run_all,
        22: rack.operations.power_off,
        23: rack.operations.power_on,
        26: lambda: rack.operations.reload("WORK", SourceText("WORK.BLK", WORK)),
        28: rack.operations.clear_errors,
        30: rack.operations.power_off,
        31: lambda: rack.operations.power_on(battery=False),
        33: lambda: refused(lambda: rack.operations.run("WORK")),
    }
    script.get(number, lambda: None)()


def refused(operation) -> None:
    with pytest.raises(OperationRefused):
        operation()


def make(folder: Path, execution: str) -> Rack:
    folder.mkdir(exist_ok=True)
    (folder / "TELLER.BAS").write_text(TELLER)
    (folder / "LISTEN.BAS").write_text(LISTEN)
    return build(folder, YAML.format(execution=execution), **SOURCES)


@pytest.fixture(scope="module", params=["ideal", "modeled"])
def bag(tmp_path_factory, request) -> Path:
    folder = tmp_path_factory.mktemp(request.param)
    rack = make(folder / "rack", request.param)
    return record(rack, folder / "bag", operate, slices=40)


@pytest.fixture(scope="module")
def modeled(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("modeled_too")
    return record(make(folder / "rack", "modeled"), folder / "bag", operate, slices=40)


def messages(bag: Path, kind: type) -> list:
    return [item.message for item in BagReader(bag).messages() if isinstance(item.message, kind)]


@pytest.mark.parametrize("from_ms", [0, 610, 920, 1330])
def test_an_operated_rack_replays_bit_for_bit(bag, from_ms):
    report = replayed(bag, from_ns=from_ms * NS_PER_MS)
    assert report.identical, (report.differences[:3], report.first)
    assert {task.name for task in report.tasks} == {*SOURCES, "TELLER", "LISTEN"}
    if not from_ms:
        assert all(task.scans > 20 for task in report.tasks)
        notes = [note for task in report.tasks for note in task.notes]
        assert not [note for note in notes if "missing" in note or "could not" in note or "not stored" in note]


def test_the_recording_tells_every_operation(bag):
    told = [(item.what, item.task, item.ok) for item in messages(bag, Operation)]
    assert told == [
        ("tune", "SPEED", True),
        ("force", "", True),
        ("unforce", "", True),
        ("stop", "SPEED", True),
        ("run", "SPEED", True),
        ("reload", "WORK", True),
        ("stop", "TELLER", True),
        ("run", "TELLER", True),
        ("stop_all", "", True),
        ("run_all", "", True),
        ("power_off", "", True),
        ("power_on", "", True),
        ("reload", "WORK", True),
        ("clear_errors", "", True),
        ("power_off", "", True),
        ("power_on", "", True),
        ("run", "WORK", False),
    ]


def test_the_recording_is_sound_and_the_same_again(bag, tmp_path):
    info = bag_info(bag, check=True)
    assert info.problems == []
    execution = "modeled" if "modeled" in str(bag) else "ideal"
    again = record(make(tmp_path / "rack", execution), tmp_path / "bag", operate, slices=40)
    assert (again / "scans_0.mcap").read_bytes() == (bag / "scans_0.mcap").read_bytes()


def test_a_scan_stands_before_its_writes_unless_others_ran_in_its_middle(modeled):
    """In the log, writes never go back in time; what a pre-empted scan has written until then stands before it."""
    table = messages(modeled, VariableTable)[0]
    work = next(writer.id for writer in table.writers if writer.name == "WORK")
    last_write, early, late = 0, 0, 0
    end = 0
    for message in messages(modeled, (CommonWrite, Scan)):
        if isinstance(message, CommonWrite):
            assert message.stamp >= last_write
            last_write = message.stamp
            if message.writer == work and message.kind == WriteKind.BASIC:
                early, late = early + (message.stamp > end), late + (message.stamp <= end)
        elif message.task == "WORK":
            assert bool(message.duration_ns) == bool(message.scan)
            end = message.stamp + message.duration_ns
    assert early > 100
    assert late > 100


def overlapped(folder: Path) -> Path:
    """A recording in which WORK overlaps, and the rack runs again after its errors were cleared."""
    rack = make(folder / "rack", "modeled")
    rack.operations.reload("WORK", SourceText("WORK.BLK", LONG_WORK))

    def steps(rack: Rack, number: int) -> None:
        operate(rack, 0)
        if number == 10:
            rack.operations.clear_errors()
            rack.operations.run_all()

    return record(rack, folder / "bag", steps, slices=20)


def test_a_rack_that_an_overlap_stopped_replays(tmp_path):
    """WORK takes longer than a tick: it overlaps (code 14), all stops, and runs again after the log was cleared."""
    bag = overlapped(tmp_path)
    stops = [item for item in messages(bag, Operation) if item.what == "stop_all"]
    assert [(item.task, item.detail) for item in stops] == [("WORK", "14"), ("WORK", "14")]
    report = replayed(bag)
    assert report.identical, report.differences[:3]
    overlaps = [item for item in messages(bag, Scan) if any(error.code == OVERLAP for error in item.errors)]
    assert [(item.task, item.scan, item.latched.variable) for item in overlaps] == [("WORK", 1, ()), ("WORK", 1, ())]
    assert not [note for task in report.tasks for note in task.notes if "missing" in note or "could not" in note]


def test_each_file_of_a_split_recording_replays_alone(tmp_path):
    options = RecordingOptions(split_ns=170 * NS_PER_MS)
    rack = make(tmp_path / "rack", "modeled")
    bag = record(rack, tmp_path / "bag", operate, slices=20, seconds=1.0, options=options)
    files = sorted(bag.glob("*.mcap"), key=lambda path: int(path.stem.rpartition("_")[2]))
    assert len(files) == 6
    for file in files:
        report = replayed(file)
        assert report.identical, (file, report.differences[:3])
    assert replayed(bag).identical


def reads_of(scan: Scan, view: int) -> list[float]:
    return [value for read, value in zip(scan.read.variable, scan.read.value, strict=True) if read == view]


def test_an_edited_task_differs_first_in_the_scan_that_the_edit_reaches(bag):
    """N! counts scans: the edit matters as soon as REF% is not 0, since N! / 100 is 0 then."""
    ref = next(item.id for item in messages(bag, VariableTable)[0].variables if item.name == "REF%")
    report = replayed(
        bag, {"WORK": edited(WORK, ("TOTAL * 0.5 + REF%", "TOTAL * 0.5 + REF% * (N! / 100)"))}, to_ns=590 * NS_PER_MS
    )
    first = next(item for item in messages(bag, Scan) if item.task == "WORK" and any(reads_of(item, ref)))
    assert report.first is not None
    assert (report.first.task, report.first.scan) == ("WORK", first.scan)
    assert [(item.name, item.kind.name) for item in report.differences] == [("TOTAL", "VARIABLE")]


def test_an_edited_basic_task_gets_what_its_channels_gave(bag):
    source = SourceText("new/LISTEN.BAS", edited(LISTEN, ("HEARD% + A%", "HEARD% + A% * 2")))
    report = replay(bag, {"LISTEN": source}, ReplayOptions())
    assert {task.name for task in report.tasks if task.different} == {"LISTEN"}
    assert [(item.name, item.kind.name) for item in report.differences] == [("HEARD%", "VARIABLE")]
    burst = next(item for item in messages(bag, Scan) if item.task == "LISTEN" and item.written.variable)
    assert report.first is not None
    assert report.first.scan == burst.scan
