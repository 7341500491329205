"""The example of a section drive does what its README says, figure by figure."""

import itertools
import math
import re

import pytest

from automax_ros.core.kinds import Direction
from automax_ros.core.types import DataType, Value, bare_name
from automax_ros.rack.rack import Rack
from automax_ros.rackfile.checks.tasks import check_tasks
from automax_ros.rackfile.model.config import RackConfig
from automax_ros.rackfile.model.ros_names import set_topic
from config.examples import CONFIG, loaded

FOLDER = CONFIG / "section_drive"
README = (FOLDER / "README.md").read_text(encoding="utf-8")
SCAN_S = 0.011
SEQUENCE_SCAN_S = 0.055
CRUISE = 2457
"""Counts of the preset 1500 fpm: 1500 * 4095 / 2500."""
AT_CRUISE_S = 20.0


@pytest.fixture(scope="module")
def config() -> RackConfig:
    return loaded(FOLDER)


@pytest.fixture
def rack(config):
    """The rack in RUN; whatever a test does with it, no task may log a run-time error."""
    made = started(config)
    yield made
    assert [(task.name, entry.describe()) for task in made.tasks for entry in task.errors.entries] == []


@pytest.fixture
def cruising(rack):
    """The rack on its preset speed."""
    rack.run(AT_CRUISE_S)
    return rack


def started(config: RackConfig, **tunables: Value) -> Rack:
    """A rack in RUN; ``tunables`` are INTEGERs and REALs of SPEED, an INTEGER's type character left out."""
    made = Rack(config)
    made.start()
    task = made.task("SPEED")
    for name, value in tunables.items():
        task.tune(name if isinstance(value, float) else f"{name}%", value)
    return made


def sampled(rack: Rack, seconds: float, *names: str) -> list[tuple[Value, ...]]:
    """The values after each scan of 11 ms."""
    rows = []
    for _ in range(round(seconds / SCAN_S)):
        rack.run(SCAN_S)
        rows.append(tuple(rack.value(name) for name in names))
    return rows


def seconds_until(rack: Rack, name: str, value: Value, most: float) -> float:
    """How long it takes until a variable has a value, to the ms."""
    for milliseconds in range(round(most * 1000)):
        if rack.value(name) == value:
            return milliseconds / 1000
        rack.run(0.001)
    pytest.fail(f"{name} is not {value} within {most} s")


def press(rack: Rack, button: str) -> None:
    """Press a push-button long enough for SEQUENCE, and release it long enough."""
    for pressed in (True, False):
        rack.write(button, pressed)
        rack.run(3 * SEQUENCE_SCAN_S)


# What it is made of


def test_tasks_check_without_a_word(config):
    results = [(task.name, result.diagnostics) for task, _, result in check_tasks(config)]
    assert results == [("LINE", []), ("SEQUENCE", []), ("SPEED", []), ("MOTOR", [])]
    assert Rack(config).warnings == []


def test_variables_are_described():
    text = (FOLDER / "rack.yaml").read_text(encoding="utf-8")
    entries = re.findall(r"^  ([A-Z_]+[%@!]): \{(.*)\}$", text, re.M)
    assert len(entries) == len(loaded(FOLDER).variables)
    assert [name for name, options in entries if "ros: " not in options or 'description: "' not in options] == []
    assert [name for name, options in entries if not name.endswith("@") and "unit: " not in options] == []


def test_it_uses_as_many_blocks_as_the_readme_says(config):
    used = {call.block.name for _, _, result in check_tasks(config) for call in result.program.calls.values()}
    assert "The 15 blocks used" in README
    assert len(used) == 15


def test_readme_names_only_what_exists(config):
    names = {variable.name for variable in config.variables}
    tunables = {
        name
        for _, _, result in check_tasks(config)
        for name, symbol in result.program.symbols.items()
        if symbol.tuning is not None
    }
    planned = {"S2_SECT_REF%"}
    assert set(re.findall(r"`([A-Z][A-Z0-9_]*[%@!])`", README)) <= names | tunables | planned
    settable = {set_topic(f"/pm1/common/{bare_name(v.name)}") for v in config.variables if v.direction is Direction.IN}
    assert set(re.findall(r"/pm1/common/\w+/set", README)) <= settable
    parameters = {f"SPEED.{name.rstrip('%')}" for name in tunables}
    assert set(re.findall(r"\bSPEED\.(?!BLK)[A-Z_]+", README)) <= parameters


# The ramp


def test_line_ramps_at_its_rate(rack):
    """RAMP with SCALE=91 gains 164/91 of a count per scan, exactly; that is 164 counts/s within 0.1 %."""
    values = [reference for (reference,) in sampled(rack, 16.0, "LINE_REF%")]
    # LINE scans before SEQUENCE at time 0, so it sees RUN@ on its second scan
    assert values == [min(164 * scan // 91, CRUISE) for scan in range(len(values))]
    assert (values[900] - values[0]) / (900 * SCAN_S) == pytest.approx(164, rel=0.002)


def test_rate_of_the_line_is_told_in_counts_a_second(rack):
    assert {rate for (rate,) in sampled(rack, 10.0, "LINE_RATE%")[20:]} == {164}
    rack.run(10.0)
    assert rack.value("LINE_RATE%") == 0


# The regulator


def test_speed_settles_on_its_reference_and_stays(rack):
    rack.run(AT_CRUISE_S)
    rows = sampled(rack, 40.0, "SECT_REF%", "SPEED_FDBK%", "SHAFT_SPEED%")
    assert {reference for reference, _, _ in rows} == {CRUISE}
    assert max(abs(feedback - CRUISE) for _, feedback, _ in rows) <= 1
    assert max(abs(shaft - CRUISE) for _, _, shaft in rows) <= 1
    assert rows[-1] == (CRUISE, CRUISE, CRUISE)


def test_start_stays_inside_of_all_limits(rack):
    rows = sampled(rack, 60.0, "SHAFT_SPEED%", "CUR_REF%", "CUR_LIMITED@", "FAULT@")
    assert max(shaft for shaft, *_ in rows) <= CRUISE + 5
    assert min(shaft for shaft, *_ in rows) >= 0
    assert max(current for _, current, *_ in rows) <= 2200
    assert min(current for _, current, *_ in rows) >= 0
    assert not any(limited or fault for *_, limited, fault in rows)


def test_load_current_is_that_of_the_plant_data(cruising):
    cruising.run(20.0)
    load = (0.20 + 0.30 * CRUISE / 4095) * 2730
    assert cruising.value("CUR_REF%") == pytest.approx(load, abs=2)
    assert cruising.value("ARM_CUR%") == cruising.value("CUR_REF%")
    volts = CRUISE / 4095 * 2865 + load / 2730 * 135
    assert cruising.value("ARM_VOLTS%") == pytest.approx(volts, abs=2)


def peak_of_load_step(acceleration: float) -> float:
    """Largest speed error (counts) after a torque step, from the poles of s^2 + w s + w w_lead."""
    crossover, lead = 0.15 * 26.7, 0.8
    root = math.sqrt(crossover * crossover / 4 - crossover * lead)
    slow, fast = crossover / 2 - root, crossover / 2 + root
    at = math.log(fast / slow) / (fast - slow)
    return acceleration * (math.exp(-slow * at) - math.exp(-fast * at)) / (fast - slow)


def test_nip_makes_the_dip_that_theory_says(cruising):
    cruising.run(10.0)
    cruising.write("NIP_CLOSED@", True)
    errors = [shaft - CRUISE for (shaft,) in sampled(cruising, 10.0, "SHAFT_SPEED%")]
    assert min(errors) == pytest.approx(-peak_of_load_step(0.15 * 546), abs=1)
    assert min(errors) == -16
    assert max(errors) <= 1
    assert max(abs(error) for error in errors[round(3.1 / SCAN_S) :]) <= 1


def overshoot(rack: Rack) -> int:
    return max(shaft - CRUISE for (shaft,) in sampled(rack, 25.0, "SHAFT_SPEED%"))


def test_overshoot_of_the_ramp_is_5_counts(rack):
    assert overshoot(rack) == 5


def test_without_inertia_compensation_overshoot_is_32_counts(config):
    assert overshoot(started(config, INERTIA=0)) == 32 == pytest.approx(peak_of_load_step(164), abs=1)


def test_low_gain_dips_deep_and_overshoots(config):
    rack = started(config, KP_SPEED=5.0)
    rack.run(30.0)
    rack.write("NIP_CLOSED@", True)
    errors = [shaft - CRUISE for (shaft,) in sampled(rack, 15.0, "SHAFT_SPEED%")]
    assert (min(errors), max(errors)) == (-59, 10)


def test_current_limit_holds_the_integrator(config):
    rack = started(config, CUR_LIM=1900)
    rows = sampled(rack, 25.0, "SECT_REF%", "SHAFT_SPEED%", "CUR_REF%", "CUR_LIMITED@")
    assert max(reference - shaft for reference, shaft, *_ in rows) == 110
    assert max(shaft for _, shaft, *_ in rows) <= CRUISE + 1
    assert max(current for *_, current, _ in rows) == 1900
    assert any(limited for *_, limited in rows)
    assert not rows[-1][3]


# The operator


@pytest.mark.parametrize(("set_point", "counts"), [(1000, 1638), (9000, 4095), (-500, 0), (2500, 4095)])
def test_set_point_is_limited_and_scaled(cruising, set_point, counts):
    cruising.write("LINE_SPEED_SP%", set_point)
    cruising.run(25.0)
    assert cruising.value("LINE_REF%") == counts
    assert cruising.value("SPEED_FDBK%") == pytest.approx(counts, abs=1)
    assert not cruising.value("FAULT@")


def test_thread_speed(cruising):
    cruising.write("THREAD_SEL@", True)
    cruising.run(20.0)
    assert cruising.value("LINE_REF%") == 250 * 4095 // 2500
    assert cruising.value("SPEED_FPM%") in (249, 250)


def test_stop_leads_down_the_ramp(cruising):
    cruising.write("STOP_PB@", True)
    rows = sampled(cruising, 20.0, "LINE_REF%", "SHAFT_SPEED%", "RUN@")
    down = [reference for reference, _, _ in rows if 100 < reference < CRUISE]
    assert (down[0] - down[-1]) / ((len(down) - 1) * SCAN_S) == pytest.approx(164, rel=0.002)
    assert {before - after for before, after in itertools.pairwise(down)} == {1, 2}
    assert max(abs(shaft - reference) for reference, shaft, run in rows if run) <= 45
    stopped = next(index for index, row in enumerate(rows) if not row[2])
    assert stopped * SCAN_S == pytest.approx((CRUISE - 41) / 164, abs=0.3)
    assert rows[-1] == (0, 0, False)
    assert min(shaft for _, shaft, _ in rows) >= -1
    assert cruising.value("CUR_REF%") == 0


def test_stop_beats_start(cruising):
    cruising.write("STOP_PB@", True)
    cruising.write("START_PB@", False)
    cruising.run(20.0)
    press(cruising, "START_PB@")
    assert not cruising.value("LINE_RUN@")
    assert not cruising.value("RUN@")


def test_start_is_an_edge_and_resumes_on_the_ramp(cruising):
    press(cruising, "STOP_PB@")
    cruising.run(2.0)
    assert (cruising.value("LINE_RUN@"), cruising.value("RUN@")) == (False, True)
    cruising.write("START_PB@", False)
    cruising.run(0.2)
    press(cruising, "START_PB@")
    cruising.run(10.0)
    assert cruising.value("LINE_REF%") == CRUISE


@pytest.mark.parametrize(("draw", "used"), [(10050, 10050), (9900, 9900), (12000, 10500), (0, 9500)])
def test_draw_moves_the_section_by_its_ratio(cruising, draw, used):
    cruising.write("DRAW%", draw)
    rows = sampled(cruising, 30.0, "SECT_REF%", "SHAFT_SPEED%")
    reference = CRUISE * used // 10000
    assert cruising.value("LINE_REF%") == CRUISE
    assert rows[-1][0] == reference
    assert rows[-1][1] == pytest.approx(reference, abs=1)
    arrived = next(index for index, (value, _) in enumerate(rows) if value == reference)
    assert arrived * SCAN_S == pytest.approx(abs(used - 10000) / 25, abs=0.2)
    assert max(abs(after[0] - before[0]) for before, after in itertools.pairwise(rows)) == 1


def test_draw_of_a_stopped_line_is_there_at_once(config):
    rack = Rack(config)
    rack.start([("DRAW%", 10500)])
    rows = sampled(rack, 5.0, "LINE_REF%", "SECT_REF%")
    assert [section for _, section in rows] == [line * 10500 // 10000 for line, _ in rows]
    assert rows[-1][1] > 800


# Interlocks


@pytest.mark.parametrize("permissive", ["ESTOP_OK@", "LUBE_OK@"])
def test_lost_permissive_drops_run_and_the_roll_coasts(cruising, permissive):
    cruising.write(permissive, False)
    assert seconds_until(cruising, "RUN@", value=False, most=1.0) <= SEQUENCE_SCAN_S
    cruising.run(2 * SCAN_S)
    assert (cruising.value("READY@"), cruising.value("LINE_RUN@")) == (False, False)
    assert (cruising.value("CUR_REF%"), cruising.value("SECT_REF%")) == (0, 0)
    rows = sampled(cruising, 30.0, "SHAFT_SPEED%", "CUR_REF%")
    assert {current for _, current in rows} == {0}
    assert rows[round(10 / SCAN_S)][0] > 1000
    assert rows[-1][0] == 0


def test_line_does_not_start_again_by_itself(cruising):
    cruising.write("LUBE_OK@", False)
    cruising.run(1.0)
    cruising.write("LUBE_OK@", True)
    cruising.run(1.0)
    assert (cruising.value("READY@"), cruising.value("RUN@")) == (True, False)
    cruising.write("START_PB@", False)
    cruising.run(0.2)
    press(cruising, "START_PB@")
    assert not cruising.value("RUN@"), "the roll still coasts"
    cruising.run(30.0)
    assert not cruising.value("RUN@")
    press(cruising, "START_PB@")
    assert cruising.value("RUN@")
    cruising.run(20.0)
    assert cruising.value("SPEED_FDBK%") == pytest.approx(CRUISE, abs=1)


def test_start_without_permissive_is_refused(config):
    rack = Rack(config)
    rack.start([("ESTOP_OK@", False)])
    rack.run(5.0)
    assert not rack.value("RUN@")
    assert rack.value("SHAFT_SPEED%") == 0


def test_tach_loss_trips_and_stays(cruising):
    cruising.write("TACH_FAIL@", True)
    assert 0.1 < seconds_until(cruising, "TACH_LOSS@", value=True, most=1.0) < 0.25
    assert seconds_until(cruising, "RUN@", value=False, most=1.0) < 2 * SEQUENCE_SCAN_S
    assert cruising.value("SHAFT_SPEED%") < CRUISE * 1.03
    cruising.write("TACH_FAIL@", False)
    cruising.run(30.0)
    assert (cruising.value("FAULT@"), cruising.value("READY@")) == (True, False)
    press(cruising, "FAULT_RESET_PB@")
    assert (cruising.value("FAULT@"), cruising.value("READY@"), cruising.value("RUN@")) == (False, True, False)


def test_reset_does_not_clear_a_fault_that_lasts(cruising):
    cruising.write("TACH_FAIL@", True)
    cruising.run(0.5)
    press(cruising, "FAULT_RESET_PB@")
    assert cruising.value("TACH_LOSS@")


@pytest.mark.parametrize(("tach", "trips"), [(4504, False), (4505, True), (-4505, True)])
def test_overspeed_trips_at_110_percent(config, tach, trips):
    rack = Rack(config)
    rack.start([("START_PB@", False)])
    for _ in range(60):
        rack.write("TACH%", tach)
        rack.run(SCAN_S)
    assert rack.value("OVERSPEED@") is trips
    assert rack.value("FAULT@") is trips


# The web


def test_web_length_loses_nothing(cruising):
    before = cruising.value("WEB_LENGTH!")
    feet = 0.0
    for _ in range(400):
        cruising.run(SEQUENCE_SCAN_S)
        feet += cruising.value("SPEED_FDBK%") * 2500 / 4095 * SEQUENCE_SCAN_S / 60
    assert (cruising.value("WEB_LENGTH!") - before) / 100 == pytest.approx(feet, rel=0.0005)


def test_web_length_starts_again_with_a_new_reel(cruising):
    cruising.write("LENGTH_RESET@", True)
    cruising.run(1.0)
    assert cruising.value("WEB_LENGTH!") == 0
    cruising.write("LENGTH_RESET@", False)
    cruising.run(10.0)
    assert cruising.value("WEB_LENGTH!") == pytest.approx(25_000, abs=200)


# Twice the same


class Log:
    """All that was written to common memory, and all that the tasks saw."""

    def __init__(self) -> None:
        self.entries: list[object] = []

    def scanned(self, task, record, writes) -> None:
        self.entries += [task.name, repr(record)]
        self.written(writes)

    def written(self, writes) -> None:
        self.entries += [entry for group in writes for entry in group.entries()]

    def operated(self, operation) -> None:
        self.entries.append(operation)


def test_two_runs_write_the_same(config):
    logs = []
    for _ in range(2):
        rack, log = Rack(config), Log()
        rack.observe(log)
        rack.start()
        for seconds, name, value in ((20.0, "DRAW%", 10100), (10.0, "STOP_PB@", True)):
            rack.run(seconds)
            rack.write(name, value)
        rack.run(30.0)
        logs.append(log.entries)
    assert len(logs[0]) > 50_000
    assert logs[0] == logs[1]


def test_types_of_the_interface(config):
    """The commands of the README have the right message types."""
    types = {bare_name(variable.name): variable.type for variable in config.variables}
    words = {"Int16": DataType.INTEGER, "Bool": DataType.BOOLEAN}
    commands = re.findall(r"/pm1/common/(\w+)/set std_msgs/msg/(\w+)", README)
    assert len(commands) >= 4
    assert [name for name, word in commands if types[name] is not words[word]] == []
