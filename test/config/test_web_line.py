"""The example of a web line does what its README says, figure by figure; recordings of it replay bit for bit."""

from __future__ import annotations

import gc
import hashlib
import itertools
import math
import resource
import shutil
from pathlib import Path

import pytest
from soaking import in_soak

from automax_ros.cli.main import main
from automax_ros.messages.stream.stream import RackStream
from automax_ros.rack.base.stop_cause import OperationRefused
from automax_ros.rack.rack import Rack
from automax_ros.rackfile.checks.cpu_load import faults, loads_of
from automax_ros.rackfile.checks.tasks import check_tasks
from automax_ros.recordings.write.recorder import Recorder
from config.examples import CONFIG, built, loaded, play

FOLDER = CONFIG / "web_line"
START, WEB_BREAK = "start.yaml", "web_break.yaml"


def playing(stimuli: str, folder: Path = FOLDER) -> Rack:
    """The rack in RUN with the stimuli about to happen."""
    rack = built(folder)
    play(rack, FOLDER / stimuli)
    return rack


class Observer:
    """Keeps the records of all scans, by task."""

    def __init__(self, rack: Rack) -> None:
        self.records: dict[str, list] = {}
        rack.observe(self)

    def __getattr__(self, _name):
        return lambda *_arguments: None

    def scanned(self, task, record, _writes):
        if record.scan:
            self.records.setdefault(task.name, []).append(record)


def values(rack: Rack, seconds: float, *names: str) -> list[object]:
    rack.scheduler.run_until(round(seconds * 1e9))
    return [rack.value(name) for name in names]


def without_errors(rack: Rack) -> None:
    assert rack.operations.stopped is None
    assert [(task.name, entry) for task in rack.tasks for entry in task.errors.entries] == []


def test_its_tasks_are_right_and_fit():
    config = loaded(FOLDER)
    checked = check_tasks(config)
    assert [item.result.diagnostics for item in checked] == [[]] * 8
    loads = loads_of(config, checked)
    assert faults(config, loads) == []
    assert {item.module.name: round(item.percent) for item in loads} == {
        "processor_1": 8, "processor_2": 9, "processor_3": 8, "udc_10": 62
    }  # fmt: skip
    assert loads[-1].least_ticks == 3


def test_time_of_wind_a_by_hand():
    """Table 5: five commons of the dual port, three INTEGER and two BOOLEAN; two tasks share the module."""
    udc = loads_of(loaded(FOLDER), check_tasks(loaded(FOLDER)))[-1]
    expected = (
        (350.00 + 3 * 2.20 + 2 * 2.00)  # SCAN_LOOP
        + 7.97  # DIFFERENCE
        + 70.85  # PROP_INT
        + 46.10  # THERMAL_OVERLOAD
        + (130.00 + 3 * 2.40 + 2 * 2.50)  # END
    )
    assert udc.tasks[0].times.most_ns / 1000 == pytest.approx(expected, abs=0.01)


def test_a_days_start():
    rack = playing(START)
    lamps = ("LINE_RUN@", "RUN@", "RUN_LAMP@", "SECT_CONT@", "UNW_CONT@")
    assert values(rack, 0.9, "READY@", *lamps) == [True, False, False, False, False, False]
    assert values(rack, 1.3, "READY@", *lamps) == [True] * 6
    ramp = values(rack, 1.4, "LINE_REF%")[0]
    assert values(rack, 1.9, "LINE_REF%")[0] - ramp == pytest.approx(100, abs=2)
    assert values(rack, 9.9, "LINE_REF%", "SECT_SPD%", "UNW_SPD%", "DISPLAY%") == [200, 200, 100, 100]
    assert values(rack, 34.9, "LINE_REF%", "DISPLAY%", "SECT_SPD%", "SECT_CUR%") == [2000, 1000, 2000, 2000 // 5]
    assert values(rack, 34.9, "TENSION%", "TENS_TRIM%", "UNW_REF%", "UNW_SPD%") == [500, 500 // 5, 1900, 1900]
    assert values(rack, 49.9, "TENSION%", "TENS_TRIM%", "UNW_SPD%") == [600, 600 // 5, 2000 - 600 // 5]
    assert values(rack, 60.0, "LINE_REF%", "SECT_CUR%", "WIND_CUR%", *lamps) == [0, 0, 0, *[False] * 5]
    assert {item.task.name: item.task.scan_number for item in rack.scheduled if item.task.name != "DIAG"} == {
        "LINE": 5455, "SECTION": 5455, "UNWIND": 5455, "WINDER": 6000, "MOTORS": 6000, "WIND_A": 30000, "WIND_B": 30000
    }  # fmt: skip
    without_errors(rack)


def test_the_roll_grows_by_the_web_that_is_on_it():
    """Core 10 in, web 0.002 in: d2 = 1000 * 1000 + 3.0558 for each 0.01 ft; its surface is 1 % faster."""
    rack = playing(START)
    length, diameter, surface = values(rack, 49.9, "WEB_LENGTH!", "DIAMETER%", "WIND_SURF%")
    assert diameter == int(math.sqrt(1000 * 1000 + 3.0558 * length))
    assert surface == pytest.approx(2000 * 1.010, abs=3)
    # 2000 counts are 1000 fpm, 16.67 ft/s, and 1 % more
    later = values(rack, 49.95, "WEB_LENGTH!")[0] - length
    assert later == pytest.approx(0.05 * 1683.3, abs=18)


def test_a_web_break():
    rack = playing(WEB_BREAK)
    assert values(rack, 29.9, "LINE_REF%", "TENSION%", "BREAK@", "READY@") == [1600, 500, False, True]
    faults_now = values(rack, 30.02, "BREAK@", "BREAK_LAMP@", "READY@", "LINE_RUN@", "RUN@", "TENSION%")
    assert faults_now == [True, True, False, False, True, 0]
    before = values(rack, 30.1, "LINE_REF%")[0]
    assert before - values(rack, 30.2, "LINE_REF%")[0] == pytest.approx(
        200, abs=22
    )  # 2000 counts/s, a scan more or less
    assert values(rack, 34.0, "BREAK@", "RUN@", "SECT_CONT@") == [True, False, False]
    assert values(rack, 37.5, "BREAK@", "READY@", "BREAK_LAMP@") == [False, True, False]
    assert values(rack, 60.0, "LINE_REF%", "SECT_SPD%", "TENSION%", "UNW_SPD%") == [1600, 1600, 500, 1500]
    assert list(rack.task("DIAG").printed) == [
        "WEB BREAK 1 AT 336 FT, LINE AT 1578",
        "LINE AT 0, TENSION 0, ROLL 1051",
    ]
    without_errors(rack)


def test_winder_scans_when_the_udc_interrupts():
    """After every fifth scan of the UDC, which scans every 2 ms; its scan then takes its time."""
    rack = playing(START)
    seen = Observer(rack)
    rack.run(0.2)
    scans = [record.time_ns for record in seen.records["WINDER"]]
    assert len(scans) in (19, 20)
    assert {after - before for before, after in itertools.pairwise(scans)} == {10_000_000}
    assert len(seen.records["WIND_B"]) == 100


def test_modeled_scans_take_what_load_says():
    """Of tasks that nothing pre-empts the most holds too; MOTORS and SECTION may have to wait."""
    rack = playing(START)
    seen = Observer(rack)
    rack.run(2.0)
    durations = {
        name: {item.duration_ns for item in records} for name, records in seen.records.items() if name != "DIAG"
    }
    config = loaded(FOLDER)
    times = {task.task: task.times for item in loads_of(config, check_tasks(config)) for task in item.tasks}
    for name, taken in durations.items():
        assert times[name].least_ns <= min(taken), name
    for name in ("LINE", "UNWIND", "WINDER", "WIND_A", "WIND_B"):
        assert max(durations[name]) <= times[name].most_ns, name
    assert durations["WIND_A"] == {times["WIND_A"].most_ns}
    assert durations["UNWIND"] == {times["UNWIND"].most_ns}


def changed(tmp_path: Path, ticks: int, scans: int, winder_ticks: int) -> Path:
    """A copy of the example with other TICKS on the UDC and other scans from interrupt to interrupt."""
    edits = [
        ("WIND_A", "TICKS=4", f"TICKS={ticks}"),
        ("WIND_B", "TICKS=4", f"TICKS={ticks}"),
        ("WINDER", "UDC_SCANS% = 5", f"UDC_SCANS% = {scans}"),
        ("WINDER", "TICKS=10", f"TICKS={winder_ticks}"),
    ]
    folder = tmp_path / "web_line"
    shutil.copytree(FOLDER, folder)
    for name, old, new in edits:
        path = folder / f"{name}.BLK"
        text = path.read_text()
        assert old in text
        path.write_text(text.replace(old, new))
    return folder


def test_the_winder_does_not_turn_backwards_after_a_break():
    rack = playing(WEB_BREAK)
    speeds = [values(rack, 30 + number / 10, "WIND_SPD%", "WEB_LENGTH!") for number in range(80)]
    assert min(speed for speed, _ in speeds) >= 0
    lengths = [length for _, length in speeds]
    assert lengths == sorted(lengths)
    assert values(rack, 38.5, "WIND_RUN@") == [True]


def test_with_two_ticks_the_udc_overlaps(tmp_path):
    """1241.73 us in 2 x 500 us: the README's exercise."""
    folder = changed(tmp_path, ticks=2, scans=10, winder_ticks=10)
    (finding,) = faults(loaded(folder), loads_of(loaded(folder), check_tasks(loaded(folder))))
    assert (finding.code, finding.hint) == ("AMX6770", "write TICKS=3 or more")
    rack = playing(START, folder)
    rack.run(0.1)
    assert rack.operations.stopped is not None
    assert rack.operations.stopped.code == "14"


def test_with_three_ticks_it_does_not(tmp_path):
    rack = playing(START, changed(tmp_path, ticks=3, scans=10, winder_ticks=15))
    rack.run(1.0)
    without_errors(rack)


def test_line_is_critical_and_the_line_survives_a_power_cycle():
    rack = playing(START)
    with pytest.raises(OperationRefused):
        rack.operations.stop("LINE")
    length = values(rack, 20.0, "WEB_LENGTH!")[0]
    assert length > 0
    rack.operations.power_off()
    rack.operations.power_on()
    rack.run(0.5)
    assert rack.value("WEB_LENGTH!") == pytest.approx(length, abs=20)
    assert rack.value("UDC_CCLK@") is True
    assert not rack.value("LINE_RUN@")
    before = rack.task("WIND_A").scan_number
    rack.run(0.1)
    assert rack.task("WIND_A").scan_number - before == 50


def digest(folder: Path) -> dict[str, str]:
    return {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in sorted(folder.iterdir())}


def recorded(folder: Path, seconds: float) -> dict[str, str]:
    arguments = ["--simulated", "--duration", str(seconds), "--stimuli", str(FOLDER / WEB_BREAK)]
    assert main(["run", str(FOLDER), *arguments, "--record", str(folder)]) == 0
    return digest(folder)


def test_recordings_are_identical_and_replay_bit_for_bit(tmp_path, capsys):
    assert recorded(tmp_path / "one", 3) == recorded(tmp_path / "two", 3)
    capsys.readouterr()
    assert main(["replay", str(tmp_path / "one")]) == 0
    assert "no difference" in capsys.readouterr().out


def recorded_in_parts(folder: Path, seconds: float, parts: int) -> tuple[dict[str, str], list[int]]:
    """Record a run; return what is in the recording, and the memory in use after each part of the run."""
    rack = built(FOLDER)
    stream = RackStream(rack, rack.fingerprint)
    recorder = Recorder(rack, stream, folder)
    stream.begin()
    play(rack, FOLDER / START)
    sizes = []
    for part in range(1, parts + 1):
        rack.scheduler.run_until(round(seconds * 1e9) * part // parts)
        gc.collect()
        sizes.append(resident())
    stream.end()
    recorder.close()
    without_errors(rack)
    return digest(folder), sizes


@pytest.mark.parametrize("seconds", [6, in_soak(3600, timeout_s=3600)])
def test_a_run_twice_in_flat_memory(tmp_path, seconds) -> None:
    first, sizes = recorded_in_parts(tmp_path / "one", seconds, 12)
    assert recorded_in_parts(tmp_path / "two", seconds, 1)[0] == first
    assert max(sizes[1:]) <= sizes[1] * 1.02


def resident() -> int:
    """The memory of this process in bytes."""
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * resource.getpagesize()
