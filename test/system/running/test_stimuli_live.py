"""Stimuli and reports on the wall clock, with services in between."""

import json
import signal
from pathlib import Path

from scenario.stimuli.helpers import DRAW, RACK, SPEED

from system.support import Automax, automax, automax_here


def written(folder: Path, stimuli: str) -> tuple[Path, Path, Path]:
    """A rack with an operator, its tasks and a stimuli file; where the report goes."""
    (folder / "SPEED.BLK").write_text(SPEED)
    (folder / "DRAW.BLK").write_text(DRAW)
    config, file = folder / "rack.yaml", folder / "stimuli.yaml"
    config.write_text(RACK.replace("rack: PM1\n", "rack: PM1\noperator: true\n").replace("tick_ms: 1.0", "tick_ms: 10"))
    file.write_text(stimuli)
    return config, file, folder / "report.json"


def test_a_run_with_stimuli_ends_with_a_report(ros_domain_id, tmp_path):
    text = (
        "- {at: 0.1, set: {REF%: 7}}\n- {at: 0.2, ramp: {GAIN: {to: 1.5, over: 0.2}}}\n"
        "- {at: 0.3, force: {RUN@: false}}\n- {at: 0.5, stop: [DRAW]}\n- {at: 0.6, run: [SPEED]}\n"
    )
    config, file, report = written(tmp_path, text)
    ended = automax("run", config, "--duration", "1", "--stimuli", file, "--report", report)
    assert ended.code == 1
    assert "stimuli: run SPEED was refused: task SPEED runs already" in ended.out
    found = json.loads(report.read_text())
    assert (found["commons"]["REF%"], found["commons"]["GAIN"], found["forced"]) == (7, 1.5, ["RUN@"])
    assert [(item["what"], item["of"], item["ok"]) for item in found["operations"]] == [
        ("force", "RUN@", True),
        ("stop", "DRAW", True),
        ("run", "SPEED", False),
    ]
    assert found["stopped"] is None
    assert {name: task["status"] for name, task in found["tasks"].items()} == {"SPEED": "running", "DRAW": "stopped"}
    assert 0.5 <= found["operations"][1]["at"] < 1.0


def test_ctrl_c_ends_with_a_report_that_has_what_services_did(ros_domain_id, tmp_path):
    config, file, report = written(tmp_path, "- {at: 0.01, set: {REF%: 7}}\n- {at: 0.02, stop: [DRAW]}\n")
    with Automax("run", config, "--stimuli", file, "--report", report) as process:
        process.wait_for_line("Ctrl-C ends the run")
        refused = automax_here("ctl", "PM1", "stop", "NOBODY")
        stopped = automax_here("ctl", "PM1", "stop-all")
        ended = process.end(signal.SIGINT)
    assert (refused.code, stopped.code) == (1, 0)
    assert ended.code == 0
    found = json.loads(report.read_text())
    told = [(item["what"], item.get("of"), item["ok"]) for item in found["operations"]]
    assert told == [("stop", "DRAW", True), ("stop", "NOBODY", False), ("stop_all", None, True)]
    assert (found["stopped"]["code"], found["stopped"]["task"]) == (None, None)
    assert {task["status"] for task in found["tasks"].values()} == {"stopped"}
