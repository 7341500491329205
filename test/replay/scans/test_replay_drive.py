"""Recordings of a rack with a drive: its loop runs again without the plant, and an edit shows at its first scan."""

from __future__ import annotations

import pytest
from rack.drives.drive_tasks import CML, SPEED, YAML, rack_of

from automax_ros.core.ticks import NS_PER_S
from automax_ros.messages.stream.stream import RackStream
from automax_ros.messages.types.messages import CommonWrite, Scan
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.recordings.read.reader import BagReader
from automax_ros.recordings.write.recorder import Recorder, RecordingOptions
from automax_ros.replay.scans.report import DifferenceKind
from automax_ros.runtime.scan.drive_record import COMMAND_VIEW, MEASURED_VIEW
from replay.replays import edited, record, replayed, rewritten

SECONDS = 2.0
HAPPENS = {
    0: (("PERMIT@", True), ("SPEED%", 1000), ("SPEED_REF%", 3000)),
    6: (("START@", True),),
    10: (("SPEED_REF%", -2000),),
    13: (("OSV%", 6000),),
    14: (("OSV%", 0), ("START@", False), ("RESET@", True)),
    15: (("START@", True), ("RESET@", False)),
}
"""In twentieths of the run: a start, a reversal, a trip, its reset and a second start."""


def happens(rack, number):
    for name, value in HAPPENS.get(number, ()):
        rack.write(name, value)


def recording(folder, steps=happens, *, options=None, **changes):
    return record(rack_of(folder, **changes), folder / "bag", steps, seconds=SECONDS, options=options)


@pytest.fixture(scope="module")
def bag(tmp_path_factory):
    return recording(tmp_path_factory.mktemp("drive"))


def scans_of(bag, task="CML"):
    return [
        item.message
        for item in BagReader(bag).messages()
        if isinstance(item.message, Scan) and item.message.task == task
    ]


def test_drive_runs_again_without_its_plant(bag):
    report = replayed(bag)
    assert report.identical, report.text()
    loop = next(task for task in report.tasks if task.name == "CML")
    assert loop.scans == len(scans_of(bag)) > 720
    assert loop.states >= 1
    errors = [error.code for scan in scans_of(bag) for error in scan.errors]
    assert 7113 in errors, "the recording has a fault that runs again"


def test_recording_is_small(bag):
    """A drive at rest takes a few numbers a scan, one that runs some more: 720 scans are not a burden."""
    scans = scans_of(bag)
    views = [sum(view in (MEASURED_VIEW, COMMAND_VIEW) for view in scan.read.variable) for scan in scans]
    assert max(views[10:200]) <= 11
    assert max(views) <= 26
    assert sum(path.stat().st_size for path in bag.glob("*.mcap")) < 500_000


def done(scan):
    """What a scan has committed, written and commanded."""
    entries = zip(scan.read.variable, scan.read.element, scan.read.value, strict=True)
    return scan.committed, scan.written, [entry for entry in entries if entry[0] == COMMAND_VIEW]


def test_edited_gain_shows_at_the_first_scan_that_does_otherwise(bag, tmp_path):
    """Up to the first difference open and closed loop are the same: a rack with the edited task shows it."""
    text = edited(CML, ("KP=0.2", "KP=0.25"))
    pairs = zip(scans_of(bag), scans_of(recording(tmp_path, cml=text)), strict=False)
    expected = next(one.scan for one, other in pairs if done(one) != done(other))
    report = replayed(bag, {"CML": text})
    assert (report.first.task, report.first.scan) == ("CML", expected)
    assert expected > 200, "the drive does not regulate before it is started"
    (pulses,) = [item for item in report.first.differences if item.kind is DifferenceKind.COMMAND]
    assert pulses.name == "gate pulses commanded to the 57C406"
    assert " at " in pulses.first.recorded
    assert pulses.first.recorded != pulses.first.replayed
    assert "57C406 status" in report.text()
    assert not any(item.task != "CML" for item in report.differences), "others saw what was recorded"


def test_edit_that_changes_nothing_is_identical(bag):
    assert replayed(bag, {"CML": edited(CML, ("1010 SCANS%", "1009 ! nothing\n1010 SCANS%"))}).identical


def test_edited_level_shows_at_the_first_scan(bag):
    report = replayed(bag, {"CML": edited(CML, ("IOC_THRESH=250", "IOC_THRESH=240"))})
    assert [item.name for item in report.first.differences] == ["overcurrent level commanded to the 57C406"]
    assert report.first.scan == 1
    assert (report.first.differences[0].first.recorded, report.first.differences[0].first.replayed) == (
        "250 %",
        "240 %",
    )


def test_tolerance_passes_over_commands(bag):
    report = replayed(bag, {"CML": edited(CML, ("IOC_THRESH=250", "IOC_THRESH=240"))}, tolerance=1)
    assert report.identical


def test_loop_that_became_another_task_commands_nothing(bag):
    other = "10 COMMON REF%\n1000 CALL SCAN_LOOP(TICKS=1)\n1010 END\n"
    report = replayed(bag, {"CML": other})
    assert {item.first.replayed for item in report.differences if item.kind is DifferenceKind.COMMAND} == {"no command"}


def test_edited_speed_loop_shows_its_own_first_difference(bag):
    report = replayed(bag, {"SPEED": edited(SPEED, ("CURRENT=8192", "CURRENT=8000"))})
    assert report.first.task == "SPEED"
    assert [item.name for item in report.first.differences] == ["REF%"]


@pytest.mark.parametrize("from_s", [0.5, 0.65, 1.02, 1.32, 1.61])
def test_replay_begins_at_a_state_inside(tmp_path_factory, from_s):
    """Split files begin with the states of the tasks: the loop goes on from the numbers that are in them."""
    folder = tmp_path_factory.mktemp("split")
    bag = recording(folder, options=RecordingOptions(split_ns=NS_PER_S // 8))
    report = replayed(bag, from_ns=round(from_s * NS_PER_S))
    assert report.identical, report.text()
    loop = next(task for task in report.tasks if task.name == "CML")
    assert loop.states >= 2
    assert loop.scans == pytest.approx((SECONDS - from_s) * 360, abs=2)
    different = replayed(bag, {"CML": edited(CML, ("KP=0.2", "KP=0.3"))}, from_ns=round(from_s * NS_PER_S))
    assert different.first.time_s >= from_s


def test_recording_with_stamps_of_the_day_runs_again(tmp_path):
    """A live run's stamps are those of the wall clock: the loop still counts ticks of rack time."""
    rack = rack_of(tmp_path)
    stream = RackStream(rack, rack.fingerprint)
    recorder = Recorder(rack, stream, tmp_path / "bag")
    stream.begin(1_795_368_236_123_456_789)
    rack.start()
    for number in range(20):
        happens(rack, number)
        rack.run(SECONDS / 20)
    stream.end()
    recorder.close()
    report = replayed(tmp_path / "bag")
    assert report.identical, report.text()


def test_modeled_recording_runs_again(tmp_path):
    report = replayed(recording(tmp_path, extra="execution: modeled\n"))
    assert report.identical, report.text()


def test_what_is_under_a_force_is_recorded(tmp_path):
    def forced(rack, number):
        happens(rack, number)
        if number == 4:
            rack.force("OSV%", 100)
            rack.force("REF%", 1200)
        if number == 17:
            rack.unforce("OSV%")
            rack.unforce("REF%")

    bag = recording(tmp_path, forced)
    assert 7113 in [error.code for scan in scans_of(bag) for error in scan.errors], "it trips under the force"
    report = replayed(bag)
    assert report.identical, report.text()


def test_operations_on_the_loop_run_again(tmp_path):
    def operated(rack, number):
        happens(rack, number)
        if number == 11:
            rack.operations.stop("CML")
        if number == 12:
            rack.operations.run("CML")
        if number == 16:
            rack.operations.stop_all("test")
        if number == 17:
            rack.operations.run_all()

    report = replayed(recording(tmp_path, operated))
    assert report.identical, report.text()


def test_local_diagnostic_data_is_state(tmp_path):
    local = edited(CML, (", DIAG%(37,1)\n20 LOCAL", "\n20 LOCAL DIAG%(37,1),"))
    bag = recording(tmp_path, cml=local)
    report = replayed(bag)
    assert report.identical, report.text()
    assert all(not scan.written.variable for scan in scans_of(bag))


def with_number(scan, element, number):
    """A scan that has measured another number."""
    place = next(
        index
        for index, (view, at) in enumerate(zip(scan.read.variable, scan.read.element, strict=True))
        if (view, at) == (MEASURED_VIEW, element)
    )
    values = [*scan.read.value[:place], number, *scan.read.value[place + 1 :]]
    return scan._replace(read=scan.read._replace(value=values))


@pytest.mark.parametrize("number", [float("nan"), float("inf"), 0.5, 2.0**31, 1e300])
def test_measurement_that_is_none_is_refused(bag, tmp_path, number):
    def change(message):
        wrong = isinstance(message, Scan) and message.task == "CML" and message.scan == 300
        return with_number(message, 0, number) if wrong else message

    with pytest.raises(BagError) as caught:
        replayed(rewritten(bag, tmp_path / "bag", change))
    assert caught.value.code == "AMX6813"


def test_another_measurement_makes_a_difference(bag, tmp_path):
    def change(message):
        other = isinstance(message, Scan) and message.task == "CML" and message.scan == 400
        return with_number(message, 1, 250_001.0) if other else message

    report = replayed(rewritten(bag, tmp_path / "bag", change))
    assert (report.first.task, report.first.scan) == ("CML", 400)


def test_recording_that_ends_within_a_scan_has_all_writes(tmp_path):
    """A 57C405 shows the voltage at the interrupt, and in modeled execution the scan ends later than the recording."""
    yaml = YAML.replace("  8: {module: 57C408}\n", "  8: {module: 57C408}\n  9: {module: 57C405, drive: 7}\n")
    yaml = yaml.replace("  START@: {}", "  VOLTS%: {slot: 9, register: 0}\n  START@: {}")
    rack = rack_of(tmp_path, extra="execution: modeled\n", yaml=yaml)
    stream = RackStream(rack, rack.fingerprint)
    recorder = Recorder(rack, stream, tmp_path / "bag")
    stream.begin()
    rack.start()
    for number in range(9):
        happens(rack, number)
        rack.run(0.1)
    before = rack.value("VOLTS%")
    while rack.value("VOLTS%") == before:
        rack.run(1e-6)
    stream.end()
    recorder.close()
    view, last = rack.memory.view("VOLTS%"), None
    for item in BagReader(tmp_path / "bag").messages():
        if isinstance(item.message, CommonWrite):
            values = item.message.values
            last = dict(zip(values.variable, values.value, strict=True)).get(view, last)
    assert last == rack.value("VOLTS%") != before
