"""The rack without ROS: tasks, common memory and schedule wired together."""

from pathlib import Path

import pytest

from automax_ros.core.kinds import WriteKind, WriterKind
from automax_ros.rack.rack import Rack
from automax_ros.rack.tasks.installation import RackError
from automax_ros.rackfile.model.writers import OPERATOR_WRITER, PRESET_WRITER, ROS_WRITER
from automax_ros.runtime.memory.views import MemoryValueError
from automax_ros.runtime.tasks.task import Status
from rack.helpers import rack_at, run_for

RACK = """\
rack: LINE1
slots:
  0: {module: 57C413}
  1:
    module: 57C435
    tick_ms: 5.5
    tasks:
      LATE: {priority: 8}
      FIRST: {priority: 4}
  2:
    module: 57C431
    tick_ms: 2.5
    tasks:
      ALPHA: {priority: 8}
common:
  REF%: {ros: in, preset: 100}
  SUM%: {}
  ORDER!: {}
  KEPT!: {non_volatile: true}
  TABLE%(3): {ros: in, preset: [1, 2, 3, 4]}
  REALS(1): {ros: in}
  GO@: {ros: in}
  BATTERYSTATUS0@:
  BATTERYSTATUS1@:
  BATTERYSTATUS3@:
"""
FIRST = """\
10 COMMON REF%, SUM%, KEPT!
20 LOCAL GAIN% [CURRENT=2, HIGH=10, LOW=0], SMALL [CURRENT=0.1, HIGH=0.3, LOW=0.1]
30 KEPT! = 7
100 CALL SCAN_LOOP(TICKS=2)
110 CALL SUMMER(INPUT1=REF%, INPUT2=GAIN%, OUTPUT=SUM%)
120 END
"""
NUMBERED = """\
10 COMMON ORDER!, GO@
100 CALL SCAN_LOOP(TICKS={ticks})
110 IF GO@ THEN 110
120 ORDER! = ORDER! * 10 + {number}
130 END
"""


def each(groups):
    """The entries of groups of writes."""
    return [entry for group in groups for entry in group.entries()]


class Notes:
    """An observer that writes down what it is told."""

    def __init__(self):
        self.events = []

    def scanned(self, task, record, writes):
        self.events.append(("scanned", task.name, record.scan, record.time_ns, each(writes)))

    def written(self, writes):
        self.events.append(("written", each(writes)))

    def tuned(self, task, now_ns):
        self.events.append(("tuned", task.name, now_ns))

    def operated(self, operation):
        self.events.append((operation.what, operation.reason, operation.at_ns))


@pytest.fixture
def build(tmp_path):
    """Make a rack from its file and tasks, some of them replaced."""

    def made(yaml: str = RACK, stopwatch=None, **tasks: str) -> Rack:
        texts = {
            "FIRST": FIRST,
            "LATE": NUMBERED.format(ticks=4, number=3),
            "ALPHA": NUMBERED.format(ticks=4, number=2),
        }
        for name, text in {**texts, **tasks}.items():
            (tmp_path / f"{name}.BLK").write_text(text)
        path = Path(tmp_path / "rack.yaml")
        path.write_text(yaml)
        return rack_at(path, stopwatch=stopwatch)

    return made


def noted(build, settings=()):
    """A started rack, and notes of all that has happened in it."""
    rack, notes = build(), Notes()
    rack.observe(notes)
    rack.start(settings)
    return rack, notes


def test_tasks_start_by_priority_then_name_and_keep_their_periods(build):
    rack, notes = noted(build)
    assert [task.name for task in rack.tasks] == ["FIRST", "LATE", "ALPHA"]
    rack.run(0.022)
    scans = [(event[3] / 1e6, event[1]) for event in notes.events if event[0] == "scanned" and event[2] > 0]
    assert scans == [
        (0.0, "FIRST"),
        (0.0, "ALPHA"),
        (0.0, "LATE"),
        (10.0, "ALPHA"),
        (11.0, "FIRST"),
        (20.0, "ALPHA"),
    ]
    rack.run(0.0001)
    assert rack.value("ORDER!") == 232_23


def test_presets_then_settings_then_the_part_before_scan_loop(build):
    rack, notes = noted(build, [("REF%", -5), ("SUM%", 9)])
    kind, writes = notes.events[0]
    assert kind == "written"
    names = [rack.memory.specs[write.view].name for write in writes]
    batteries = ["BATTERYSTATUS0@", "BATTERYSTATUS1@"]
    assert names == ["REF%", *["TABLE%"] * 4, *batteries, "REF%", "SUM%"]
    assert [write.writer for write in writes] == [PRESET_WRITER] * 7 + [OPERATOR_WRITER] * 2
    assert {(write.kind, write.time_ns) for write in writes} == {(WriteKind.OUTSIDE, 0)}
    assert [write.sequence for write in writes] == list(range(1, 10))
    assert [event[:3] for event in notes.events[1:]] == [
        ("scanned", "FIRST", 0),
        ("scanned", "ALPHA", 0),
        ("scanned", "LATE", 0),
    ]
    assert rack.value("KEPT!") == 7
    assert rack.value("REF%") == -5
    assert [rack.value("TABLE%", element) for element in range(4)] == [1, 2, 3, 4]


def test_battery_status_tells_modules_with_a_battery(build):
    rack = run_for(build())
    assert [rack.value(f"BATTERYSTATUS{slot}@") for slot in (0, 1, 3)] == [True, True, False]


def test_writes_from_outside_act_on_the_next_scan(build):
    rack, notes = noted(build)
    rack.run(0.005)
    rack.write("REF%", 20, ROS_WRITER)
    assert rack.value("SUM%") == 102
    (write,) = notes.events[-1][1]
    assert (write.writer, write.time_ns, write.value) == (ROS_WRITER, 5_000_000, 20)
    rack.run(0.010)
    assert rack.value("SUM%") == 22


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("TABLE%", [(0, 9), (1, 40_000)]),
        ("TABLE%", [(0, 9), (4, 1)]),
        ("TABLE%", [(0, 9), (-1, 1)]),
        ("REALS", [(0, 1.5), (1, float("nan"))]),
        ("REALS", [(0, 1.5), (1, float("inf"))]),
        ("GO@", [(0, True), (0, 2)]),
        ("REF%", [(0, "text")]),
    ],
)
def test_refused_write_changes_nothing(build, name, values):
    rack, notes = noted(build)
    told, before = len(notes.events), rack.memory.image()
    with pytest.raises(MemoryValueError):
        rack.write_view(rack.memory.view(name), values, ROS_WRITER)
    assert rack.memory.image() == before
    assert len(notes.events) == told


def test_unknown_names(build):
    rack = build()
    with pytest.raises(KeyError):
        rack.write("NONE%", 1)
    with pytest.raises(KeyError):
        rack.value("NONE%")
    with pytest.raises(KeyError):
        rack.task("NONE")
    assert rack.task("LATE").slot == 1


def test_tuning_is_told_to_observers(build):
    rack, notes = noted(build)
    rack.run(0.005)
    first = rack.task("FIRST")
    rack.tune(first, "GAIN%", 10)
    assert notes.events[-1] == ("tuned", "FIRST", 5_000_000)
    rack.run(0.010)
    assert rack.value("SUM%") == 110
    rack.tune(first, "SMALL", 0.3)  # both limits are singles a little above these decimals
    rack.tune(first, "SMALL", 0.1)
    told = len(notes.events)
    for name, value in (("GAIN%", 11), ("GAIN%", True), ("GAIN%", None), ("SMALL", 0.09), ("SMALL", float("nan"))):
        with pytest.raises(ValueError, match=name):
            rack.tune(first, name, value)
    assert len(notes.events) == told
    assert first.value("GAIN%") == 10


# Faults


def test_fault_stops_all_tasks_and_zeroes_volatile_commons(build):
    rack, notes = noted(build)
    rack.run(0.005)
    rack.write("GO@", True)
    rack.run(0.010)
    reason = rack.stop_reason
    assert reason is not None
    assert reason.startswith("task ALPHA: scan 2, line 110: AMX7040")
    assert rack.task("ALPHA").status is Status.FAULTED
    assert [rack.task(name).status for name in ("FIRST", "LATE")] == [Status.STOPPED] * 2
    scanned, cleared, stopped = notes.events[-3:]
    assert scanned[:3] == ("scanned", "ALPHA", 2)
    assert {write.writer for write in cleared[1]} == {PRESET_WRITER}
    assert stopped == ("stop_all", reason, 10_000_000)
    assert rack.value("KEPT!") == 7
    assert (rack.value("REF%"), rack.value("SUM%"), rack.value("GO@")) == (0, 0, False)
    assert rack.value("BATTERYSTATUS1@") is True, "a battery does not fail with a task"
    told = len(notes.events)
    rack.run(1.0)
    assert len(notes.events) == told, "nothing scans after STOP ALL"


def test_fault_before_scan_loop_starts_no_further_task(build):
    loop = "20 FOR N% = 1 TO 2\n30 N% = 1\n40 NEXT N%\n"
    endless = f"10 COMMON ORDER! \\ LOCAL N%\n{loop}100 CALL SCAN_LOOP(TICKS=2)\n110 END\n"
    rack = run_for(build(FIRST=endless))
    assert rack.stop_reason is not None
    assert rack.stop_reason.startswith("task FIRST: scan 0, line 20")
    rack.run(1.0)
    assert {task.name: task.status for task in rack.tasks} == {
        "FIRST": Status.FAULTED,
        "ALPHA": Status.STOPPED,
        "LATE": Status.STOPPED,
    }
    assert [item.scans for item in rack.statistics.values()] == [0, 0, 0]


def test_stop_keeps_memory(build):
    rack = run_for(build(), 0.1)
    before = rack.memory.image()
    rack.operations.stop_tasks()
    rack.run(1.0)
    assert rack.memory.image() == before
    assert rack.stop_reason is None


def test_errors_of_all_tasks_are_found_before_any_starts(build):
    with pytest.raises(RackError, match=r"errors in .*FIRST\.BLK, .*ALPHA\.BLK") as caught:
        build(FIRST="10 X% = 1\n20 END\n", ALPHA="10 CALL SCAN_LOOP(TICKS=2)\n20 Y% = 2\n30 END\n")
    assert [source.name.rpartition("/")[2] for source, _ in caught.value.findings] == ["FIRST.BLK", "ALPHA.BLK"]


def test_task_that_waits_for_an_event_that_no_module_sets_is_refused(build):
    waiting = "10 COMMON REF%\n20 EVENT NAME=GO, INTERRUPT_STATUS=REF%, TIMEOUT=6\n"
    waiting += "100 CALL SCAN_LOOP(TICKS=2, EVENT=GO)\n120 END\n"
    with pytest.raises(RackError) as caught:
        build(ALPHA=waiting)
    ((_, (found,)),) = caught.value.findings
    assert (found.code, found.span.line) == ("AMX6440", 2)


# Measuring and identity


def test_stopwatch_measures_each_scan(build):
    times = iter(range(0, 10**9, 1000))
    rack = run_for(build(stopwatch=lambda: next(times)), 0.1)
    statistics = rack.statistics["FIRST"]
    assert (statistics.scans, statistics.total_ns, statistics.longest_ns) == (10, 10_000, 1000)


def test_wall_clock_counts_skipped_scans_and_stays_on_the_grid(build):
    rack, notes = noted(build)
    for wall_ms in (0, 3, 12, 57, 58, 66):
        rack.scheduler.run_due(wall_ms * 1_000_000)
    scans = [event[3] / 1e6 for event in notes.events if event[0] == "scanned" and event[1] == "FIRST" and event[2]]
    assert scans == [0, 11, 55, 66]
    assert rack.statistics["FIRST"].skipped == 3
    times = [write.time_ns for event in notes.events if event[0] == "scanned" for write in event[4]]
    assert times == sorted(times), "the write log never runs backwards"


def test_fingerprint_depends_on_configuration_and_sources_alone(build):
    one = build().fingerprint
    assert one == build().fingerprint
    assert 0 <= one < 2**63
    assert build(FIRST=FIRST.replace("REF%, INPUT2", "SUM%, INPUT2")).fingerprint != one
    assert build(RACK.replace("preset: 100", "preset: 101")).fingerprint != one


def test_writers_have_stable_ids(build):
    writers = build().writers
    assert [(item.id, item.name, item.kind, item.slot) for item in writers] == [
        (0, "rack", WriterKind.PRESET, 0),
        (1, "ros", WriterKind.ROS, 0),
        (2, "operator", WriterKind.OPERATOR, 0),
        (3, "FIRST", WriterKind.TASK, 1),
        (4, "LATE", WriterKind.TASK, 1),
        (5, "ALPHA", WriterKind.TASK, 2),
    ]
    assert [item.is_task for item in writers] == [False] * 3 + [True] * 3


def test_simulated_runs_are_equal(build):
    images = []
    for _ in range(2):
        rack = run_for(build(), 1.0)
        images.append((rack.memory.image(), [task.snapshot() for task in rack.tasks]))
    assert images[0] == images[1]
