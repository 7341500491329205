"""Runs of a sweep: exact measures, no trace of one run in another, the same rows wherever they are run."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from rack.helpers import config_at, rack_at

from automax_ros.core.ticks import NS_PER_MS
from automax_ros.parallel.job import Workers
from automax_ros.rack.rack import Rack
from automax_ros.sweep.points import grid, read_varied
from automax_ros.sweep.run import RunOutcome, Stimuli, best_rows, run_point, run_points, run_sweep
from sweep.helpers import plan_of, rack_in

DRIVE = Path(__file__).parents[2] / "config" / "dc_drive" / "rack.yaml"
MEASURES = (
    "rms(ERR%) mean(FDBK%, from=0.02) max(ERR%, from=0.0105 to=0.05) settle(FDBK%, 2 %) rise(FDBK%) overshoot(FDBK%)"
    " itae(ERR%) count(NEAR@) time(NEAR@, from=0.0305) final(TABLE%(1)) errors(LOOP) stopped"
)


@pytest.fixture
def rack(tmp_path: Path) -> Rack:
    return rack_in(tmp_path)


def each_ms(rack: Rack, names: list[str], milliseconds: int) -> np.ndarray:
    """What commons hold in each millisecond of a run; nothing happens within one."""
    rows = []
    for number in range(1, milliseconds + 1):
        rack.scheduler.run_until(number * NS_PER_MS)
        rows.append([rack.value(name) for name in names])
    return np.array(rows, float).T


def test_measures_are_those_of_the_values_of_each_instant(rack: Rack):
    plan = plan_of(rack, ["LOOP.KP=1.7", "REF%=900", "SLOW=1"], MEASURES)
    (outcome,) = run_points(plan, [(plan_value(rack, "LOOP.KP=1.7"), 900, 1.0)])
    rack.tune(rack.task("LOOP"), "KP", 1.7)
    rack.start([("REF%", 900), ("SLOW", 1.0)])
    e, f, n = each_ms(rack, ["ERR%", "FDBK%", "NEAR@"], 200)
    t = np.arange(200) * 1e-3
    final = f[-1]
    outside = np.flatnonzero(np.abs(f - final) > 0.02 * final)
    expected = [
        np.sqrt((e**2).mean()),
        f[20:].mean(),
        e[10:50].max(),
        t[outside[-1]] + 1e-3,
        t[np.argmax(f >= 0.9 * final)] - t[np.argmax(f >= 0.1 * final)],
        max(0, f.max() - final) / final * 100,
        (np.abs(e) * ((t + 1e-3) ** 2 - t**2) / 2).sum(),
        (np.diff(n) > 0).sum(),
        (n[31:].sum() + 0.5 * n[30]) * 1e-3,
        3 * 100,
        0,
        0,
    ]
    assert outcome.measures == pytest.approx(expected, rel=1e-9)
    assert outcome.fault == ""
    assert outcome.measures[3] > 0.01
    assert outcome.measures[5] > 0


def plan_value(rack: Rack, text: str) -> float:
    (value,) = read_varied(rack, text).values
    assert isinstance(value, float)
    return value


def points_of(rack: Rack, texts: list[str]) -> list[tuple]:
    return grid([read_varied(rack, text) for text in texts])


def test_no_run_knows_of_another(rack: Rack):
    texts = ["LOOP.KP=0.2:2.4:4", "REF%=500,-800", "LOOP.STEPS=1,9"]
    plan, points = plan_of(rack, texts, MEASURES), points_of(rack, texts)
    alone = [run_point(plan_of(rack, texts, MEASURES), point) for point in points]
    assert run_points(plan, points) == alone
    assert run_points(plan, points[::-1]) == alone[::-1]
    assert len({outcome.measures for outcome in alone}) == len(alone)


def test_rows_are_the_same_with_more_processes(rack: Rack):
    texts = ["LOOP.KP=0.2:2.4:10", "REF%=500,-800"]
    plan, points = plan_of(rack, texts, MEASURES), points_of(rack, texts)
    told: list[int] = []
    expected = run_sweep(plan, points, Workers(1), lambda rows: told.extend(row.number for row in rows))
    assert told == [row.number for row in expected] == list(range(1, 21))
    assert run_sweep(plan, points, Workers(2)) == expected


def faults_of(rack: Rack) -> int:
    """How many errors the task logs until its scan is too long."""
    rack.start([("RUN@", False)])
    rack.run(0.01)
    return rack.task("LOOP").errors.count


def test_a_run_that_faults_is_a_row(rack: Rack):
    texts = ["RUN@=true,false", "REF%=700,900"]
    plan, points = plan_of(rack, texts, "rms(ERR%) final(FDBK%) errors(LOOP) stopped"), points_of(rack, texts)
    rows = run_sweep(plan, points, Workers(1))
    assert [bool(row.outcome.fault) for row in rows] == [False, False, True, True]
    assert rows[2].outcome.measures == (None, None, faults_of(rack), 1)
    assert rows[2].outcome.fault.startswith("task LOOP: ")
    assert rows[1].outcome.measures[1] == pytest.approx(900, abs=4)
    assert [row.number for row in best_rows(rows, 1)] == [1, 2]
    assert [row.number for row in best_rows(rows, 1, greatest=True)] == [2, 1]


def test_an_error_of_ours_is_the_fault_of_its_run_alone(rack: Rack, monkeypatch: pytest.MonkeyPatch):
    texts = ["REF%=700,800,900"]
    plan, points = plan_of(rack, texts, "rms(ERR%)"), points_of(rack, texts)
    expected = run_points(plan, points)
    start = Rack.start

    def failing(self: Rack, settings: list, *others: object) -> None:
        if ("REF%", 800) in settings:
            raise ZeroDivisionError("in\x1bside")
        start(self, settings, *others)

    monkeypatch.setattr(Rack, "start", failing)
    assert run_points(plan, points) == [
        expected[0],
        RunOutcome((None,), "ZeroDivisionError: in\N{REPLACEMENT CHARACTER}side"),
        expected[2],
    ]


def test_stimuli_happen_in_each_run(rack: Rack, tmp_path: Path):
    path = tmp_path / "stimuli.yaml"
    path.write_text(
        "- {at: 0.1, set: {REF%: 2000}}\n- {at: 0.15, tune: {LOOP.STEPS%: 0}}\n- {at: 0.19, stop_all: true}\n"
    )
    plan = plan_of(
        rack, ["REF%=500"], "final(FDBK%, to=0.1) final(FDBK%, to=0.189) final(FDBK%) stopped",
        stimuli=Stimuli.of(path, allow_outside=False),
    )  # fmt: skip
    (outcome,) = run_points(plan, [(500,)])
    assert outcome.fault == ""
    assert outcome.measures == (pytest.approx(500, abs=4), pytest.approx(2000, abs=4), 0, 1)
    path.write_text("- {at: 0.1, set: {REF%: 2001}}\n")
    (row,) = run_sweep(plan, [(500,)], Workers(1))
    assert "another one" in row.outcome.fault


def test_what_stimuli_are_refused_is_told_with_the_measures(rack: Rack, tmp_path: Path):
    path = tmp_path / "stimuli.yaml"
    path.write_text("- {at: 0.1, tune: {LOOP.KP: 99}}\n")
    plan = plan_of(rack, [], "final(FDBK%)", stimuli=Stimuli.of(path, allow_outside=False))
    outcome = run_point(plan, ())
    assert outcome.fault.startswith("stimuli: ")


def test_a_rack_with_another_plant_is_that_of_an_edited_file(tmp_path: Path):
    config = config_at(DRIVE)
    rack = Rack(config)
    texts = ["MOTOR.inertia=1.5", "MOTOR.load.friction_nm=25", "MOTOR.line.v_ll=430"]
    plan = plan_of(rack, texts, "final(RPM) max(CUR_REF%) rms(ARM_V)", "1.5")
    (point,) = points_of(rack, texts)
    edited = config.text.replace("inertia: 2.0", "inertia: 1.5").replace("v_ll: 460", "v_ll: 430")
    edited = edited.replace("ros: in}     # a fan", "ros: in, friction_nm: 25}     # a fan")
    for source in DRIVE.parent.glob("*.B*"):
        (tmp_path / source.name).write_bytes(source.read_bytes())
    (tmp_path / "rack.yaml").write_text(edited, encoding="utf-8")
    other = config_at(tmp_path / "rack.yaml")
    assert other.plants[0].load.friction_nm == 25
    varied = run_point(plan, point)
    by_hand = plan_of(Rack(other), [], "final(RPM) max(CUR_REF%) rms(ARM_V)", "1.5")
    assert varied == run_point(by_hand, ())
    assert varied.fault == ""
    assert varied != run_point(replace(by_hand, template=plan.template), ())


def test_numbers_that_contradict_each_other_are_a_fault_of_the_run(tmp_path: Path):
    text = DRIVE.read_text(encoding="utf-8").replace(
        "motor: dc_150hp_500v ", "motor: {hp: 150, volts: 500, rpm: 1750} "
    )
    for source in DRIVE.parent.glob("*.B*"):
        (tmp_path / source.name).write_bytes(source.read_bytes())
    (tmp_path / "rack.yaml").write_text(text, encoding="utf-8")
    rack = rack_at(tmp_path / "rack.yaml")
    plan = plan_of(rack, ["MOTOR.motor.volts=500"], "final(RPM)", "0.01")
    good, bad = run_points(plan, [(500.0,), (1e-9,)])
    assert good.fault == ""
    assert bad.fault.startswith("plant MOTOR")
