"""What counts as from outside: points and their registers, frozen inputs, ROS, other racks, and what does not."""

from __future__ import annotations

from pathlib import Path

import pytest
from rack.helpers import rack_from
from rack.modules.network_racks import LINE, MASTER, SLAVE, WIND, Cable, built
from rack.test_io_interrupts import COMMON, FOLLOW
from rack.test_io_interrupts import built as interrupting
from scenario.stimuli.helpers import RACK, rack_in

from automax_ros.messages.stream.stream import RackStream
from automax_ros.messages.types.messages import Scan
from automax_ros.rackfile.model.writers import OPERATOR_WRITER, ROS_WRITER
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.recordings.read.reader import BagReader
from automax_ros.recordings.read.run_facts import run_facts
from automax_ros.recordings.write.recorder import Recorder
from automax_ros.replay.rerun import outside as module
from automax_ros.replay.rerun.events import Operated, Tuned, Written
from automax_ros.replay.rerun.outside import Outside, read_outside
from automax_ros.replay.rerun.rerun import Rerun, RerunOptions
from automax_ros.replay.scans.stored_rack import stored_rack
from replay.replays import record
from replay.rerun.runs import data_of, messages_of, recorded_run, run_again
from replay.test_operated_rack import make, operate

POINTS = """\
rack: PM1
slots:
  0: {module: 57C435, tick_ms: 1.0, tasks: {T: {priority: 5}}}
  5: {module: 57C419}
common:
  WORD%: {slot: 5, register: 0}
  BIT@: {slot: 5, register: 0, bit: 3}
  OTHER@: {slot: 5, register: 0, bit: 4}
  SUM%: {}
  REF%: {preset: 7}
"""
T = "10 COMMON WORD%, BIT@, SUM%\n20 CALL SCAN_LOOP(TICKS=1)\n30 SUM% = SUM% + WORD%\n40 END\n"


def outside_of(bag: Path, to_ns: int | None = None) -> Outside:
    reader = BagReader(bag)
    return read_outside(reader, stored_rack(reader), run_facts(reader), to_ns)


def assert_same_again(bag: Path, tmp_path: Path) -> Outside:
    report = run_again(bag, tmp_path / "after")
    assert report.deviation is None, report.text()
    assert data_of(tmp_path / "after") == data_of(bag)
    return report.outside


def test_of_a_bit_its_word_and_the_registers_only_what_was_written_is_from_outside(tmp_path):
    rack = rack_from(tmp_path, POINTS, T=T)
    acts = {
        0.0031: lambda: rack.adjust.set("BIT@", True),
        0.0052: lambda: rack.write_view(rack.memory.view("WORD%"), [(0, 16)], ROS_WRITER),
        0.007: lambda: rack.adjust.write("OTHER@", False),
    }
    outside = assert_same_again(recorded_run(rack, tmp_path / "bag", 0.02, acts), tmp_path)
    view, bit, other = (rack.memory.view(name) for name in ("WORD%", "BIT@", "OTHER@"))
    assert [(event.at_ns, type(event.act)) for event in outside.events] == [
        (3_100_000, Operated),
        (5_200_000, Written),
        (7_000_000, Written),
    ]
    first, second, third = (event.act for event in outside.events)
    assert isinstance(first, Operated)
    assert isinstance(second, Written)
    assert isinstance(third, Written)
    assert first.written is not None
    assert first.written.entries == ((bit, 0, True),)
    assert (second.writer, second.entries) == (ROS_WRITER, ((view, 0, 16),))
    assert {entry[0] for entry in second.shown} == {rack.memory.view("SLOT:5%"), bit, other}
    assert third.entries == ((other, 0, False),)


def test_values_of_the_start_are_settings_and_presets_are_the_racks(tmp_path):
    rack = rack_from(tmp_path, POINTS, T=T)
    bag = recorded_run(rack, tmp_path / "bag", 0.01, settings=(("SUM%", 5), ("WORD%", 3)))
    outside = assert_same_again(bag, tmp_path)
    assert outside.settings == (("SUM%", 5), ("WORD%", 3))
    assert outside.events == ()


def test_forces_and_their_register_are_operations_alone(tmp_path):
    rack = rack_in(tmp_path)
    acts = {
        0.0021: lambda: rack.adjust.force("START_PB@", True),
        0.0042: lambda: rack.adjust.force("SPEED.N%", 4),
        0.0061: lambda: rack.adjust.unforce(["START_PB@"]),
        0.0081: rack.adjust.unforce,
    }
    outside = assert_same_again(recorded_run(rack, tmp_path / "bag", 0.02, acts), tmp_path)
    assert [event.act.what for event in outside.events if isinstance(event.act, Operated)] == [
        "force", "force", "unforce", "unforce",
    ]  # fmt: skip
    assert len(outside.events) == 4


def test_inputs_that_are_frozen_take_what_came_after_the_scan(tmp_path):
    """A sample (no operation) and a ``set`` (one) while the 57C411 holds its inputs for a slow task."""
    slow = FOLLOW.replace("70 RAW%", "65 FOR RAW% = 1 TO 40\n66 SEEN% = SEEN% + 0\n67 NEXT RAW%\n70 RAW%")
    for name, act in (("sample", "write"), ("set", "set")):
        folder = tmp_path / name
        folder.mkdir()
        rack = interrupting(folder, COMMON, execution="modeled", FOLLOW=(5, slow))
        acts = {
            0.0221: lambda rack=rack, act=act: getattr(rack.adjust, act)("POSITION%", 11),
            0.05: lambda rack=rack, act=act: getattr(rack.adjust, act)("POSITION%", 12),
        }
        bag = recorded_run(rack, folder / "bag", 0.1, acts)
        assert_same_again(bag, folder)


def test_a_tunable_that_ros_has_set(tmp_path):
    rack = rack_in(tmp_path)
    acts = {0.0033: lambda: rack.tune(rack.task("SPEED"), "KP", 2.5), 0.005: lambda: rack.adjust.tune("SPEED.KP", 3.5)}
    outside = assert_same_again(recorded_run(rack, tmp_path / "bag", 0.02, acts), tmp_path)
    assert [type(event.act) for event in outside.events] == [Tuned, Operated]
    assert outside.events[0].act == Tuned("SPEED", "KP", 2.5)


def test_what_came_after_the_scan_of_its_instant_comes_after_it(tmp_path):
    """As a step of a halted rack leaves it: the scan of 5 ms has been, and 5 ms it still is."""
    rack = rack_in(tmp_path)
    stream = RackStream(rack, rack.fingerprint)
    recorder = Recorder(rack, stream, tmp_path / "bag")
    stream.begin()
    rack.start()
    rack.scheduler.run_through(5_000_000)
    rack.write("REF%", 9)
    rack.adjust.tune("SPEED.KP", 2.0)
    rack.run(0.005)
    stream.end()
    recorder.close()
    outside = assert_same_again(tmp_path / "bag", tmp_path)
    assert [event.at_ns for event in outside.events] == [5_000_000, 5_000_000]


def test_a_rack_on_the_wall_clock_runs_again_by_its_contents(tmp_path):
    rack = rack_in(tmp_path)
    acts = {
        0.003: lambda: rack.write_view(rack.memory.view("REF%"), [(0, 21)], ROS_WRITER),
        0.0071: lambda: rack.write_view(rack.memory.view("TABLE%"), [(2, 4), (3, 5)], ROS_WRITER),
    }
    bag = recorded_run(rack, tmp_path / "bag", 0.02, acts, epoch_ns=1_700_000_000_123_456_789)
    report = run_again(bag, tmp_path / "after")
    assert report.deviation is None
    assert report.is_live
    assert not report.is_exact
    assert "recorded on the wall clock: here each scan comes at its deadline, whatever the host did" in report.notes
    assert data_of(tmp_path / "after") == data_of(bag)
    assert report.outside.counts()["ros"] == 2


def test_scans_that_a_late_host_left_out_are_told(tmp_path):
    rack = rack_in(tmp_path)
    stream = RackStream(rack, rack.fingerprint)
    recorder = Recorder(rack, stream, tmp_path / "bag")
    stream.begin(1_700_000_000_000_000_000)
    rack.start()
    for now_ms in (0, 1, 2, 7, 8, 9):
        rack.scheduler.run_due(now_ms * 1_000_000)
    stream.end()
    recorder.close()
    report = run_again(tmp_path / "bag", None)
    assert report.deviation is not None
    assert report.deviation.time_ns == 3_000_000
    assert report.notes[1:] == ("a late host left out 5 scans, the first before 0.006 s: here none is left out",)


def test_a_network_module_that_has_received_shows_what_it_showed(tmp_path):
    """The master's words, status bits and counters come from the recording; what the edit does with them does not."""
    folders = [tmp_path / name for name in ("line", "wind")]
    for folder in folders:
        folder.mkdir()
    line, wind = built(folders[0], MASTER, LINE), built(folders[1], SLAVE, WIND)
    cable = Cable(line, wind)
    stream = RackStream(wind, wind.fingerprint)
    recorder = Recorder(wind, stream, tmp_path / "bag")
    stream.begin()
    cable.start()
    for value in (4321, 77, -5):
        line.write("SPEED%", value)
        cable.cycles(8)
    stream.end()
    recorder.close()
    outside = outside_of(tmp_path / "bag")
    assert outside.played == {8}
    assert outside.counts()["network"] > 5
    report = run_again(tmp_path / "bag", tmp_path / "after")
    assert report.deviation is None, report.text()
    assert data_of(tmp_path / "after") == data_of(tmp_path / "bag")
    doubled = WIND.replace("INPUT1=REF%, OUTPUT1", "INPUT1=-3, OUTPUT1")
    edited = run_again(tmp_path / "bag", tmp_path / "edited", 0.07, WIND=doubled)
    assert edited.deviation is None
    assert any(note.startswith("the network module in slot 8 shows what it showed then") for note in edited.notes)
    feedback = wind.memory.view("FEEDBACK%")
    written = [scan.committed for scan in messages_of(tmp_path / "edited", Scan) if feedback in scan.committed.variable]
    assert {value for item in written for value in item.value} == {-3.0}


def test_a_network_module_that_is_alone_runs_by_itself(tmp_path):
    wind = built(tmp_path, SLAVE, WIND)
    outside = assert_same_again(recorded_run(wind, tmp_path / "bag", 0.1), tmp_path)
    assert (outside.played, outside.events) == (frozenset(), ())


@pytest.mark.parametrize("execution", ["ideal", "modeled"])
def test_with_an_end_the_rest_is_not_read(tmp_path, monkeypatch, execution):
    """What was found is what the whole recording has up to then, and the run is the recorded one."""
    bag = record(make(tmp_path / "rack", execution), tmp_path / "bag", operate, slices=40)
    read = []
    monkeypatch.setattr(module, "HOLD_NS", 0)
    monkeypatch.setattr(module.BagReader, "messages", counting(module.BagReader.messages, read))
    whole = outside_of(bag)
    for to_ns in (0, 1_000_000, 300_000_000, 1_155_000_000):
        read.clear()
        part = outside_of(bag, to_ns)
        assert read[-1] <= to_ns + 20_000_000 < whole.ends_ns
        assert to_ns < part.ends_ns < to_ns + 20_000_000
        assert part.events == tuple(event for event in whole.events if event.at_ns <= to_ns)
        assert (part.starting, part.settings, part.forced) == (whole.starting, whole.settings, whole.forced)
        report = Rerun(bag, {}, RerunOptions(to_ns=to_ns)).run(tmp_path / f"{to_ns}")
        assert report.deviation is None, report.text()


def counting(messages, read: list[int]):
    """Note the times of the messages that are read."""

    def counted(*arguments, **options):
        for entry in messages(*arguments, **options):
            read.append(entry.stamp)
            yield entry

    return counted


def test_a_task_that_rested_from_the_start_is_found_out_however_early_the_end_is(tmp_path, monkeypatch):
    monkeypatch.setattr(module, "HOLD_NS", 0)
    rack = rack_in(tmp_path, RACK.replace("rack: PM1", "rack: PM1\nauto_run: true"))
    rack.operations.starting = frozenset({"SPEED"})
    bag = recorded_run(rack, tmp_path / "bag", 0.02)
    assert outside_of(bag, 1_000_000).starting == outside_of(bag).starting == {"SPEED"}
    assert Rerun(bag, {}, RerunOptions(to_ns=1_000_000)).run(None).deviation is None


def test_more_from_outside_than_is_kept_is_refused_unless_the_end_is_earlier(tmp_path, monkeypatch):
    """An event counts, and each value that it wrote."""
    rack = rack_in(tmp_path)
    acts = {0.001 * number: lambda number=number: rack.write("REF%", number) for number in range(1, 6)}
    bag = recorded_run(rack, tmp_path / "bag", 0.01, acts)
    monkeypatch.setattr(module, "HOLD_NS", 0)
    monkeypatch.setattr(module, "MOST_EVENTS", 9)
    with pytest.raises(BagError, match="has more than 9 events from outside") as refused:
        outside_of(bag)
    assert (refused.value.code, refused.value.hint) == ("AMX6814", "end more than 1 s before that, with --to")
    assert len(outside_of(bag, 3_900_000).events) == 3


def test_many_writes_in_one_call_are_one_event(tmp_path):
    rack = rack_in(tmp_path)
    writes = [(number, number) for number in range(4)]
    acts = {0.0035: lambda: rack.write_view(rack.memory.view("TABLE%"), writes, OPERATOR_WRITER)}
    outside = assert_same_again(recorded_run(rack, tmp_path / "bag", 0.01, acts), tmp_path)
    assert [len(event.act.entries) for event in outside.events if isinstance(event.act, Written)] == [4]
