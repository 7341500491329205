"""The example of a paper line does what its README says; what crosses webs with other features is tried with it."""

from __future__ import annotations

import csv
import shutil
from pathlib import Path

import pytest

from automax_ros.cli.main import main
from automax_ros.rack.rack import Rack
from automax_ros.rackfile.checks.cpu_load import faults, loads_of
from automax_ros.rackfile.checks.tasks import check_tasks
from automax_ros.rackfile.processes import processes_of
from config.examples import CONFIG, built, loaded, play

FOLDER = CONFIG / "paper_line"
COUNTS_A_NEWTON = 4.095


@pytest.fixture(scope="module")
def shift() -> dict[float, dict[str, float]]:
    """Values at the instants of the README's table: commons by name, signals of webs and rolls by theirs."""
    rack = built(FOLDER)
    play(rack, FOLDER / "shift.yaml")
    names = [item.name for item in rack.config.variables if not item.dimensions]
    seen = {}
    for instant in (0.9, 1.4, 3.4, 11.9, 24.0, 29.9, 30.3, 39.9, 40.1, 42.0, 43.0, 49.5, 55.0, 67.9, 77.0, 79.9):
        rack.scheduler.run_until(round(instant * 1e9))
        seen[instant] = {name: rack.value(name) for name in names if ":" not in name} | tensions(rack)
    assert rack.operations.stopped is None
    assert [(task.name, list(task.errors.entries)) for task in rack.tasks if task.errors.entries] == []
    return seen


def tensions(rack: Rack) -> dict[str, float]:
    for span in rack.plants.webs.values():
        span.advance(rack.scheduler.now_ns)
    webs = {name: span.tension_n for name, span in rack.plants.webs.items()}
    return webs | {name: end.diameter_m for name, end in rack.plants.ends.items()}


def test_its_tasks_are_right_and_fit():
    config = loaded(FOLDER)
    checked = check_tasks(config)
    assert [item.result.diagnostics for item in checked] == [[]] * 7
    loads = loads_of(config, checked)
    assert faults(config, loads) == []
    assert max(item.percent for item in loads) < 65


def test_the_line_starts_once_both_webs_are_taut(shift):
    drives = ("PRS_ON@", "UNW_ON@", "WND_ON@")
    assert shift[0.9]["READY@"]
    assert not shift[0.9]["LINE_RUN@"]
    assert [shift[1.4][name] for name in drives] == [True] * 3
    assert min(shift[1.4]["TENSION_1%"], shift[1.4]["TENSION_2%"]) > 410
    assert shift[3.4]["LINE_REF%"] <= 15
    assert [shift[77.0][name] for name in drives] == [True] * 3
    assert [shift[79.9][name] for name in drives] == [False] * 3


@pytest.mark.parametrize("instant", [11.9, 24.0, 29.9, 39.9, 67.9, 77.0])
def test_tension_is_what_was_asked_for_at_each_diameter(shift, instant):
    now = shift[instant]
    assert now["W1"] == pytest.approx(now["TENS_SP%"], abs=12)
    assert now["TENSION_1%"] == pytest.approx(now["W1"] * COUNTS_A_NEWTON, abs=3)
    taper = 500 * (1 - 0.30 * (1 - 0.15 / now["WINDER"]))
    assert now["W2"] == pytest.approx(taper, abs=15)


def test_speeds_are_those_of_one_web(shift):
    """The surface of each roll runs with the press, but for what the web stretches."""
    now = shift[24.0]
    assert now["PRS_SPD%"] == pytest.approx(300 / 60 / (0.25 / 5.25 * 183.26) * 4095, abs=2)
    press = now["PRS_SPD%"] / 5.25 * 0.5
    assert now["UNW_SPD%"] / 2.5 * now["UNWINDER"] == pytest.approx(press, rel=5e-3)
    assert now["WND_SPD%"] / 2.5 * now["WINDER"] == pytest.approx(press, rel=5e-3)


@pytest.mark.parametrize("instant", [24.0, 29.9, 39.9, 67.9])
def test_tasks_find_the_diameters_that_turn(shift, instant):
    """Within a count of the slower speed, 446 of them with the large roll."""
    now = shift[instant]
    assert now["UNW_DIA%"] / 1000 == pytest.approx(now["UNWINDER"], rel=4e-3, abs=0.002)
    assert now["WND_DIA%"] / 1000 == pytest.approx(now["WINDER"], rel=4e-3, abs=0.002)


def test_a_flying_splice_keeps_speed_and_tension(shift):
    assert shift[30.3]["UNW_SPD%"] == pytest.approx(shift[29.9]["UNW_SPD%"] * shift[29.9]["UNWINDER"] / 1.25, abs=3)
    assert shift[30.3]["PRS_SPD%"] == pytest.approx(shift[29.9]["PRS_SPD%"], abs=2)
    assert shift[30.3]["W1"] == pytest.approx(500, abs=30)


def test_paper_is_not_lost_between_the_rolls(shift):
    """What left the unwinder from 11.9 to 29.9 s is on the winder or in the spans, whose content hardly changes."""

    def wound(diameter: float) -> float:
        return 3.14159265 / 4 * diameter**2 / 90e-6

    before, after = shift[11.9], shift[29.9]
    gone = wound(before["UNWINDER"]) - wound(after["UNWINDER"])
    assert gone == pytest.approx(wound(after["WINDER"]) - wound(before["WINDER"]), abs=0.1)
    assert gone == pytest.approx(5.0 * 9 + 3.15 * 9, rel=0.15)


def test_a_break_stops_the_line_and_spares_the_other_web(shift):
    assert (shift[40.1]["BREAK@"], shift[40.1]["BREAK_LAMP@"], shift[40.1]["LINE_RUN@"]) == (True, True, False)
    assert shift[40.1]["TENSION_1%"] == 0
    assert shift[42.0]["W2"] == pytest.approx(435, abs=40)
    assert shift[43.0]["PRS_SPD%"] < 20
    assert (shift[49.5]["BREAK@"], shift[49.5]["READY@"]) == (False, True)
    assert shift[55.0]["LINE_RUN@"]


def copy_with(tmp_path: Path, old: str, new: str) -> Path:
    folder = tmp_path / "paper_line"
    shutil.copytree(FOLDER, folder)
    path = folder / "rack.yaml"
    assert old in path.read_text()
    path.write_text(path.read_text().replace(old, new))
    return folder


def recorded(folder: Path, tmp_path: Path, name: str, *options: str) -> Path:
    stimuli = FOLDER / "tear.yaml"
    bag = tmp_path / name
    words = ["run", str(folder), "--simulated", "--duration", "6.5", "--stimuli", str(stimuli), "--record", str(bag)]
    assert main([*words, *options]) == 0
    return bag


@pytest.mark.parametrize("execution", ["ideal", pytest.param("modeled", marks=pytest.mark.soak)])
def test_a_recording_replays_and_runs_again_from_its_middle(execution, tmp_path, capsys):
    folder = copy_with(tmp_path, "operator: true ", f"execution: {execution}\noperator: true ")
    bag = recorded(folder, tmp_path, "out")
    again = recorded(folder, tmp_path, "again")
    (file,), (other,) = bag.glob("*.mcap"), again.glob("*.mcap")
    assert file.read_bytes() == other.read_bytes()
    assert main(["replay", str(bag)]) == 0
    assert main(["rerun", str(bag), "--from", "4", "--record", str(tmp_path / "rerun")]) == 0
    assert main(["compare", str(bag), str(tmp_path / "rerun"), "--from", "4"]) == 0
    tuned = tmp_path / "tuned"
    assert main(["rerun", str(bag), "--from", "4", "--tune", "UNWIND.KI_UNW=2.0", "--record", str(tuned)]) == 0
    assert main(["compare", str(bag), str(tuned), "TENSION_1%", "W1.tension_n", "--from", "4"]) == 1
    assert "W1" in capsys.readouterr().out


@pytest.mark.soak
def test_without_slack_control_the_web_breaks_as_the_readme_says(tmp_path):
    folder = copy_with(tmp_path, "rack: PAPER1", "rack: PAPER2")
    path = folder / "WINDER.BLK"
    text = path.read_text()
    old = "1180 SLACK@ = GONE@ OR T% < 82"
    assert old in text
    path.write_text(text.replace(old, "1180 SLACK@ = GONE@"))
    rack = built(folder)
    play(rack, FOLDER / "shift.yaml")
    rack.scheduler.run_until(53_000_000_000)
    assert rack.value("NO_WEB_2@")


def test_its_recording_replays_and_has_webs_and_rolls(capsys, tmp_path):
    bag = CONFIG.parent / "bags" / "paper_line"
    assert main(["replay", str(bag)]) == 0
    table, watch = tmp_path / "out.csv", "W2/tension_n,W2/broken,UNWINDER/diameter_m"
    assert main(["export", str(bag), "--output", str(table), "--watch", watch]) == 0
    rows = list(csv.DictReader(table.read_text().splitlines()))
    assert max(float(row["W2/tension_n"] or 0) for row in rows) > 400
    last = {key: [row[key] for row in rows if row[key]][-1] for key in rows[0]}
    assert (float(last["W2/tension_n"]), float(last["W2/broken"])) == (0, 1)
    assert float(last["UNWINDER/diameter_m"]) == pytest.approx(0.8, abs=1e-3)


def test_its_drives_hang_together_and_share_a_process():
    """The chain of webs ties slots 7 and 10, and the loop's task its Processor."""
    groups = [set(process.slots) for process in processes_of(loaded(FOLDER))]
    assert any({1, 7, 8, 10} <= group for group in groups)
