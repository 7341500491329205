"""What happens to a rack by its stimuli, to the nanosecond."""

import math
from pathlib import Path

import pytest
from scenario.stimuli.helpers import SPEED, playing, rack_in

from automax_ros.core.kinds import WriterKind
from automax_ros.core.types import Value
from automax_ros.rack.rack import Rack
from automax_ros.runtime.memory.views import WriteGroup
from automax_ros.runtime.tasks.task import ScanRecord, Status, Task
from automax_ros.scenario.stimuli.player import StimuliPlayer
from rack.helpers import Observer

MS = 1_000_000


class Log(Observer):
    """Writes from outside and scans of SPEED, by time."""

    def __init__(self, rack: Rack) -> None:
        self.rack = rack
        self.writes: list[tuple[int, str, Value]] = []
        self.latched: list[tuple[int, tuple[Value, ...]]] = []
        rack.observe(self)

    def scanned(self, task: Task, record: ScanRecord, _: list[WriteGroup]) -> None:
        if task.name == "SPEED":
            self.latched.append((record.time_ns, tuple(record.latched)))

    def written(self, writes: list[WriteGroup]) -> None:
        kinds = {writer.id: writer.kind for writer in self.rack.writers}
        self.writes += [
            (item.time_ns, self.rack.memory.specs[item.view].name, item.value)
            for group in writes
            for item in group.entries()
            if kinds[item.writer] is WriterKind.OPERATOR
        ]

    def of(self, name: str) -> list[tuple[int, Value]]:
        return [(time, value) for time, label, value in self.writes if label == name]


def played(folder: Path, text: str, seconds: float) -> tuple[Rack, Log, StimuliPlayer]:
    rack = rack_in(folder)
    log = Log(rack)
    stimulation = playing(rack, folder, text)
    rack.run(seconds)
    return rack, log, stimulation


def test_set_is_exact_to_the_nanosecond_and_comes_before_the_scan_of_its_instant(tmp_path):
    text = '- {at: 0.002, set: {REF%: 7, "DIAG%(1,0)": 5, TABLE%(3): 9, NOTE$: hello, GAIN: 0.1, START_PB@: true}}\n'
    rack, log, _ = played(tmp_path, text + "- {at: 0.002500001, set: {REF%: 8}}\n", 0.004)
    assert log.of("REF%") == [(2 * MS, 7), (2_500_001, 8)]
    assert [latched[0] for _, latched in log.latched[1:]] == [0, 0, 7, 8]
    values = [rack.value("DIAG%", 3), rack.value("TABLE%", 3), rack.value("NOTE$"), rack.value("START_PB@")]
    assert values == [5, 9, "hello", True]


def test_entries_need_not_be_sorted_and_those_of_one_instant_keep_their_order(tmp_path):
    text = "- {at: 0.003, set: {REF%: 3}}\n- {at: 0.001, set: {REF%: 1}}\n- {at: 0.001, set: {REF%: 2}}\n"
    _, log, _ = played(tmp_path, text, 0.004)
    assert log.of("REF%") == [(MS, 1), (MS, 2), (3 * MS, 3)]


def test_ramp_goes_from_the_present_value_each_ms_and_ends_exactly(tmp_path):
    text = "- {at: 0, set: {REF%: -10}}\n- {at: 0.0015, ramp: {REF%: {to: 0, over: 0.004}}}\n"
    _, log, _ = played(tmp_path, text, 0.02)
    at = 1_500_000
    # 2.5 counts per ms; whole numbers are rounded to the nearest, halves upward
    assert log.of("REF%") == [(0, -10), (at + MS, -7), (at + 2 * MS, -5), (at + 3 * MS, -2), (at + 4 * MS, 0)]


def test_ramp_of_a_time_that_is_not_whole_ms_has_a_last_sample_at_its_end(tmp_path):
    _, log, _ = played(tmp_path, "- {at: 0.001, ramp: {GAIN: {to: 1, over: 0.0025}}}\n", 0.02)
    samples = [(2 * MS, 0.4), (3 * MS, 0.8), (3_500_000, 1.0)]
    assert log.of("GAIN") == [(time, pytest.approx(value, rel=1e-7)) for time, value in samples]


def test_a_ramp_that_takes_no_time_is_a_set(tmp_path):
    _, log, _ = played(tmp_path, "- {at: 0.001, ramp: {REF%: {to: 9, over: 0}}}\n", 0.02)
    assert log.of("REF%") == [(MS, 9)]


def test_a_ramp_that_follows_another_begins_at_its_end(tmp_path):
    text = "- {at: 0.0, ramp: {REF%: {to: 10, over: 0.01}}}\n- {at: 0.01, ramp: {REF%: {to: 0, over: 0.01}}}\n"
    rack, log, _ = played(tmp_path, text, 0.03)
    assert (10 * MS, 10) in log.of("REF%")
    assert max(value for _, value in log.of("REF%")) == 10
    assert (rack.value("REF%"), len(log.of("REF%"))) == (0, 20)


def test_sine_is_sampled_each_ms_and_leaves_its_last_sample(tmp_path):
    text = "- {at: 0.001, sine: {REF%: {mean: 50, amplitude: 100, hz: 20.0, for: 0.03}}}\n"
    rack, log, _ = played(tmp_path, text, 0.1)
    expected = [math.floor(50 + 100 * math.sin(2 * math.pi * 20 * k / 1000) + 0.5) for k in range(30)]
    changed = [(MS * (k + 1), value) for k, value in enumerate(expected) if k == 0 or value != expected[k - 1]]
    assert log.of("REF%") == changed
    assert rack.value("REF%") == expected[-1]


def test_square_begins_high_and_ends_low_after_whole_periods(tmp_path):
    text = (
        "- {at: 0.001, square: {RUN@: {hz: 250, for: 0.008}}}\n"
        "- {at: 0.001, square: {REF%: {low: -5, high: 5, hz: 125, for: 0.012}}}\n"
    )
    rack, log, _ = played(tmp_path, text, 0.1)
    assert log.of("RUN@") == [(MS, True), (3 * MS, False), (5 * MS, True), (7 * MS, False)]
    assert log.of("REF%") == [(MS, 5), (5 * MS, -5), (9 * MS, 5)]
    assert (rack.value("RUN@"), rack.value("REF%")) == (False, 5)


@pytest.mark.parametrize("later", ["set: {REF%: 4}", "ramp: {REF%: {to: 4, over: 0}}"])
def test_the_latest_entry_drives_a_signal(tmp_path, later):
    text = f"- {{at: 0, sine: {{REF%: {{amplitude: 100, hz: 20}}}}}}\n- {{at: 0.01, {later}}}\n"
    rack, log, stimulation = played(tmp_path, text, 0.05)
    assert log.of("REF%")[-1] == (10 * MS, 4)
    assert rack.value("REF%") == 4
    assert stimulation.is_over


def test_a_wave_without_an_end_goes_on(tmp_path):
    _, log, stimulation = played(tmp_path, "- {at: 0, square: {RUN@: {hz: 100}}}\n", 1.0)
    assert len(log.of("RUN@")) == 200
    assert not stimulation.is_over


def test_tasks_are_stopped_and_run(tmp_path):
    text = "- {at: 0.0105, stop: [SPEED, DRAW]}\n- {at: 0.0205, run: SPEED}\n- {at: 0.03, run_all: true}\n"
    rack, _, stimulation = played(tmp_path, text, 0.04)
    # SPEED: 0 to 10 ms, 21 to 39 ms; DRAW: 0 to 10 ms in steps of 2, 31 to 39 ms
    assert {name: item.scans for name, item in rack.statistics.items()} == {"SPEED": 11 + 19, "DRAW": 6 + 5}
    told = [(item.at_ns, item.what, item.of, item.ok) for item in stimulation.happened]
    assert told == [
        (10_500_000, "stop", "SPEED", True),
        (10_500_000, "stop", "DRAW", True),
        (20_500_000, "run", "SPEED", True),
        (30 * MS, "run_all", "", True),
    ]


def test_an_operation_that_is_refused_is_told_and_the_run_goes_on(tmp_path):
    rack, _, stimulation = played(tmp_path, "- {at: 0.001, run: [SPEED]}\n- {at: 0.002, set: {REF%: 3}}\n", 0.01)
    assert [(item.ok, item.why) for item in stimulation.happened] == [(False, "task SPEED runs already")]
    assert stimulation.news() == ["stimuli: run SPEED was refused: task SPEED runs already"]
    assert stimulation.news() == []
    assert (stimulation.refused, rack.value("REF%")) == (1, 3)


def test_forces_and_releases(tmp_path):
    text = (
        "- {at: 0.001, force: {REF%: 200, RUN@: false}}\n- {at: 0.002, set: {RUN@: true}}\n"
        "- {at: 0.003, unforce: [REF%]}\n- {at: 0.004, set: {REF%: 5}}\n- {at: 0.005, unforce: all}\n"
    )
    rack = rack_in(tmp_path)
    playing(rack, tmp_path, text)
    rack.run(0.0025)
    assert (rack.value("REF%"), rack.value("RUN@"), rack.value("FORCINGSTATUS@")) == (200, False, True)
    rack.run(0.0025)
    assert (rack.value("REF%"), rack.value("FORCINGSTATUS@")) == (5, True)
    rack.run(0.001)
    assert (rack.memory.forced, rack.value("FORCINGSTATUS@")) == (frozenset(), False)


def test_locals_are_forced_and_released(tmp_path):
    text = (
        "- {at: 0.0015, force: {SPEED.SEEN%: 7, DRAW.N%: 5}}\n- {at: 0.0035, unforce: DRAW.N%}\n"
        "- {at: 0.0065, unforce: all}\n"
    )
    rack = rack_in(tmp_path)
    playing(rack, tmp_path, text)
    rack.run(0.003)
    assert (rack.task("SPEED").value("SEEN%"), rack.task("DRAW").value("N%")) == (7, 5)
    rack.run(0.003)
    assert [item.name for item in rack.forces()] == ["SPEED.SEEN%"]
    assert (rack.task("SPEED").value("SEEN%"), rack.task("DRAW").value("N%")) == (7, 6)
    rack.run(0.002)
    assert (rack.task("SPEED").value("SEEN%"), rack.value("FORCINGSTATUS@")) == (0, False)


def test_a_forced_common_cannot_be_set_and_a_wave_goes_on_under_the_force(tmp_path):
    text = (
        "- {at: 0, ramp: {REF%: {to: 100, over: 0.01}}}\n- {at: 0.0025, force: {REF%: 7}}\n"
        "- {at: 0.005, unforce: REF%}\n- {at: 0.02, force: {REF%: 8}}\n- {at: 0.03, set: {REF%: 9}}\n"
    )
    rack, log, stimulation = played(tmp_path, text, 0.04)
    # the sample of 5 ms comes before the release, and the force holds it off
    assert [value for time, value in log.of("REF%") if time <= 6 * MS] == [10, 20, 7, 7, 60]
    assert rack.value("REF%") == 8
    (refused,) = [item for item in stimulation.happened if not item.ok]
    assert (refused.what, refused.of) == ("set", "REF%")
    assert "forced at 8" in refused.why


def test_a_task_is_deleted_and_reloaded_with_its_values(tmp_path):
    text = (
        "- {at: 0.0005, tune: {SPEED.KP: 5}}\n- {at: 0.0105, reload: {SPEED: {file: SPEED.BLK, keep_state: true}}}\n"
        "- {at: 0.0105, stop: SPEED}\n- {at: 0.0105, delete: SPEED}\n- {at: 0.0115, run: SPEED}\n"
    )
    rack, _, stimulation = played(tmp_path, text, 0.0106)
    assert [item.ok for item in stimulation.happened] == [True] * 4
    assert rack.task("SPEED").value("KP") == 1.0
    rack.run(0.01)
    assert [item.ok for item in stimulation.happened] == [True] * 4 + [False]


def test_values_are_kept_over_a_reload(tmp_path):
    text = "- {at: 0.0005, tune: {SPEED.KP: 5}}\n- {at: 0.0105, reload: {SPEED: {file: SPEED.BLK, keep_state: true}}}\n"
    rack, _, _ = played(tmp_path, text, 0.02)
    assert rack.task("SPEED").value("KP") == 5.0


def test_tunables_are_set(tmp_path):
    rack, _, _ = played(tmp_path, "- {at: 0.001, tune: {SPEED.KP: 1.2, speed.count%: 5}}\n", 0.01)
    assert rack.task("SPEED").value("KP") == pytest.approx(1.2, rel=1e-7)
    assert rack.task("SPEED").value("COUNT%") == 5


def test_reload_installs_the_source_that_was_read_before_the_run(tmp_path):
    (tmp_path / "new").mkdir()
    (tmp_path / "new" / "SPEED.BLK").write_text(SPEED.replace("SUM! + 1", "SUM! - 1"))
    rack, _, stimulation = played(tmp_path, "- {at: 0.0105, reload: {SPEED: new/SPEED.BLK}}\n", 0.02)
    assert rack.value("SUM!") == 11 - 9
    assert [item.ok for item in stimulation.happened] == [True]


def test_reload_of_a_source_with_errors_leaves_the_old_one_running(tmp_path):
    (tmp_path / "bad.blk").write_text(SPEED.replace("REF%\n", "NOWHERE%\n"))
    rack, _, stimulation = played(tmp_path, "- {at: 0.0105, reload: {SPEED: {file: bad.blk}}}\n", 0.02)
    assert rack.value("SUM!") == 20
    (refused,) = stimulation.happened
    assert (refused.what, refused.of, refused.ok) == ("reload", "SPEED", False)
    assert "bad.blk:5: AMX" in refused.why


def test_power_goes_and_comes_back(tmp_path):
    text = "- {at: 0.001, set: {REF%: 7, KEPT%: 8}}\n- {at: 0.0055, power: {off_for: 0.01}}\n"
    rack = rack_in(tmp_path)
    stimulation = playing(rack, tmp_path, text)
    rack.run(0.01)
    assert (rack.operations.powered, rack.value("REF%"), rack.value("KEPT%")) == (False, 0, 8)
    rack.run(0.01)
    assert rack.operations.powered
    assert [(item.what, item.at_ns) for item in stimulation.happened] == [("power", 5_500_000)]
    assert rack.task("SPEED").status is Status.STOPPED


def test_without_power_only_inputs_take_samples(tmp_path):
    text = (
        "- {at: 0.001, power: {off_for: 0.02}}\n- {at: 0.002, ramp: {KEPT%: {to: 50, over: 0.01}}}\n"
        "- {at: 0.002, square: {START_PB@: {hz: 100, for: 0.007}}}\n"
        "- {at: 0.004, square: {REF%: {hz: 5, low: 1, high: 3}}}\n"
    )
    rack, _, stimulation = played(tmp_path, text, 0.0029)
    assert [rack.value(name) for name in ("KEPT%", "START_PB@", "REF%")] == [0, True, 0]
    rack.run(0.01)
    assert [rack.value(name) for name in ("KEPT%", "START_PB@", "REF%")] == [0, False, 0]
    rack.run(0.0122)
    assert [rack.value(name) for name in ("KEPT%", "REF%")] == [0, 3]
    assert [item.ok for item in stimulation.happened] == [True]


def test_power_without_a_battery_takes_non_volatile_memory_along(tmp_path):
    text = "- {at: 0.001, set: {KEPT%: 8}}\n- {at: 0.0055, power: {off_for: 0.01, battery: false}}\n"
    rack, _, _ = played(tmp_path, text, 0.02)
    assert rack.value("KEPT%") == 0


def test_errors_are_cleared_and_stop_all_is_commanded(tmp_path):
    text = (
        "- {at: 0.001, set: {RUN@: true}}\n- {at: 0.0055, clear_errors: [SPEED]}\n"
        "- {at: 0.0075, stop_all: true}\n- {at: 0.0085, clear_errors: all}\n"
    )
    rack = rack_in(tmp_path)
    stimulation = playing(rack, tmp_path, text)
    rack.run(0.0056)
    assert rack.task("SPEED").errors.count == 0
    rack.run(0.0021)
    assert rack.task("SPEED").errors.count == 4  # two scans, each with a division by 0 and a clamp
    stopped = rack.operations.stopped
    assert stopped is not None
    assert (stopped.time_ns, stopped.code, stopped.is_fault) == (7_500_000, None, False)
    rack.run(0.01)
    assert rack.task("SPEED").errors.count == 0
    assert [item.what for item in stimulation.happened] == ["clear_errors", "stop_all", "clear_errors"]


def test_the_same_file_gives_the_same_run(tmp_path):
    text = (
        "- {at: 0.0, sine: {REF%: {amplitude: 999.5, hz: 13.37}}}\n- {at: 0.01, square: {RUN@: {hz: 31.7, for: 0.3}}}\n"
        "- {at: 0.1, ramp: {GAIN: {to: -3.3, over: 0.2}}}\n"
    )
    one, other = played(tmp_path, text, 0.5), played(tmp_path, text, 0.5)
    assert one[1].writes == other[1].writes
    assert one[0].state() == other[0].state()
