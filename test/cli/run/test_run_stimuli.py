"""`automax run --stimuli` and `--report` in simulated time."""

import json

import pytest
from scenario.stimuli.helpers import DRAW, RACK, SPEED

FAULTY = SPEED.replace("TICKS=1)\n", "TICKS=1)\n105 IF RUN@ THEN 105\n")


@pytest.fixture
def run(automax):
    """Call `automax run` with stimuli and a report; give the result and the report."""
    automax.write("rack.yaml", RACK)
    automax.write("SPEED.BLK", SPEED)
    automax.write("DRAW.BLK", DRAW)

    def call(stimuli: str, *options: str, duration: str = "0.05"):
        automax.write("stimuli.yaml", stimuli)
        given = ("--stimuli", "stimuli.yaml", "--report", "report.json", "--duration", duration)
        result = automax("run", "rack.yaml", "--simulated", *given, *options)
        path = automax.folder / "report.json"
        return result, json.loads(path.read_text()) if path.exists() else None

    return call


def test_report_of_a_quiet_run(run):
    result, report = run(
        '- {at: 0.01, set: {REF%: 7, GAIN: 0.5, NOTE$: hi, TABLE%(3): 4, "DIAG%(1,0)": 9, START_PB@: true}}\n'
        "- {at: 0.02, force: {REF%: 3}}\n"
    )
    assert (result.code, result.err) == (0, "")
    quiet = {"count": 0, "first": None, "second": None, "last": None}
    assert report == {
        "rack": "PM1",
        "time_s": 0.05,
        "stopped": None,
        "tasks": {
            "SPEED": {"module": "processor_0", "status": "running", "scans": 50, "skipped": 0, "errors": quiet},
            "DRAW": {"module": "processor_0", "status": "running", "scans": 25, "skipped": 0, "errors": quiet},
        },
        "commons": {
            "REF%": 3,
            "RUN@": False,
            "SUM!": 50,
            "GAIN": 0.5,
            "NOTE$": "hi",
            "TABLE%": [0, 0, 0, 4],
            "DIAG%": [[0, 0, 0], [9, 0, 0]],
            "KEPT%": 0,
            "START_PB@": True,
            "FORCINGSTATUS@": True,
        },
        "displays": {"processor_0": {"code": None, "meaning": "no fault"}},
        "forced": ["REF%"],
        "operations": [{"at": 0.02, "what": "force", "of": "REF%", "ok": True}],
    }


def test_report_has_the_error_logs(run):
    _, report = run("- {at: 0.048, set: {RUN@: true}}\n", duration="0.049")
    first = {"line": 130, "code": "AMX7024", "scan": 49}
    assert report["tasks"]["SPEED"]["errors"] == {
        "count": 2,
        "first": first,
        "second": {"line": 130, "code": "AMX7020", "scan": 49},
        "last": None,
    }
    _, report = run("- {at: 0.048, set: {RUN@: true}}\n", duration="0.05")
    errors = report["tasks"]["SPEED"]["errors"]
    assert (errors["count"], errors["first"], errors["last"]["scan"]) == (4, first, 50)


def test_a_rack_that_was_stopped_and_runs_again_ends_well(run):
    result, report = run("- {at: 0.012, stop_all: true}\n- {at: 0.0305, run_all: true}\n")
    assert result.code == 0
    assert report["stopped"] is None
    assert report["time_s"] == 0.05
    assert report["operations"] == [
        {"at": 0.012, "what": "stop_all", "ok": True},
        {"at": 0.0305, "what": "run_all", "ok": True},
    ]
    assert report["tasks"]["SPEED"]["scans"] == 12 + 19
    assert report["commons"]["SUM!"] == 19


def test_a_stop_all_of_the_stimuli_is_a_good_end(run):
    result, report = run("- {at: 0.0125, stop_all: true}\n")
    assert result.code == 0
    stopped = report["stopped"]
    assert (stopped["time_s"], stopped["code"], stopped["task"]) == (0.0125, None, None)
    assert report["tasks"]["SPEED"]["status"] == "stopped"
    assert report["time_s"] == 0.05


def test_a_fault_is_a_bad_end_and_reported(automax, run):
    automax.write("SPEED.BLK", FAULTY)
    result, report = run("- {at: 0.01, set: {RUN@: true}}\n")
    assert result.code == 1
    assert "STOP ALL: task SPEED" in result.err
    stopped = report["stopped"]
    assert (stopped["time_s"], stopped["code"], stopped["task"]) == (0.01, "14", "SPEED")
    task = report["tasks"]["SPEED"]
    assert task["status"] == "faulted"
    assert task["errors"]["first"]["hardware"] == "14"
    assert report["tasks"]["DRAW"]["status"] == "stopped"


def test_a_report_without_stimuli(automax, run):
    run("[]\n")
    automax.write("SPEED.BLK", FAULTY)
    result = automax("run", "rack.yaml", "--simulated", "--duration", "9", "--set", "RUN@=1", "--report", "report.json")
    assert result.code == 1
    report = json.loads((automax.folder / "report.json").read_text())
    assert (report["stopped"]["time_s"], report["operations"]) == (0.0, [])


def test_a_refused_operation_makes_the_exit_code_1(run):
    result, report = run("- {at: 0.012, run: [SPEED]}\n")
    assert result.code == 1
    assert "stimuli: run SPEED was refused: task SPEED runs already" in result.out
    assert report["operations"] == [
        {"at": 0.012, "what": "run", "ok": False, "of": "SPEED", "why": "task SPEED runs already"}
    ]


def test_without_a_duration_a_run_ends_when_nothing_is_to_come(automax, run):
    run("[]\n")
    automax.write("stimuli.yaml", "- {at: 0.25, stop_all: true}\n- {at: 0.35, set: {REF%: 1}}\n")
    result = automax("run", "rack.yaml", "--simulated", "--stimuli", "stimuli.yaml")
    assert result.code == 0
    assert "ran 0.400 s" in result.out


def test_errors_are_told_before_the_run_with_file_line_and_key(automax, run):
    result, report = run("- {at: 0.1, set: {REF%: 40000}}\n- {at: 0.2, stop: [SPEDE]}\n")
    assert (result.code, report, result.out) == (1, None, "")
    lines = [line for line in result.err.splitlines() if "error[" in line]
    assert lines == [
        "stimuli.yaml:1:25: error[AMX6736]: REF% cannot be '40000': it takes a whole number from -32768 to 32767",
        "stimuli.yaml:2:20: error[AMX6739]: the rack has no task 'SPEDE'",
    ]
    assert not (automax.folder / "bag").exists()


@pytest.mark.parametrize("content", [None, b"\xff\xfe", b"#" * 2_000_001])
def test_a_file_that_cannot_be_read_is_wrong_usage(automax, run, content):
    run("[]\n")
    (automax.folder / "report.json").unlink()
    (automax.folder / "stimuli.yaml").unlink()
    if content is not None:
        (automax.folder / "stimuli.yaml").write_bytes(content)
    result = automax("run", "rack.yaml", "--simulated", "--duration", "1", "--stimuli", "stimuli.yaml")
    assert result.code == 2
    assert "AMX6730" in result.err


@pytest.mark.parametrize("path", ["nowhere/report.json", ".", "rack.yaml", "stimuli.yaml"])
def test_a_report_that_cannot_be_written_is_told_before_the_run(automax, run, path):
    run("[]\n")
    result = automax(
        "run", "rack.yaml", "--simulated", "--duration", "1", "--stimuli", "stimuli.yaml", "--report", path
    )
    assert (result.code, result.out) == (2, "")
    assert "report" in result.err or "cannot be written" in result.err


def test_stimuli_are_recorded_and_the_same_run_gives_the_same_bag(automax, run):
    text = "- {at: 0.0, sine: {REF%: {amplitude: 100, hz: 20}}}\n- {at: 0.02, force: {RUN@: true}}\n"
    bags = []
    for name in ("one", "two"):
        assert run(text, "--record", name)[0].code == 0
        bags.append((automax.folder / name / "scans_0.mcap").read_bytes())
    assert bags[0] == bags[1]
    assert automax("replay", "one").code == 0


EVERY_VERB = """\
- {at: 0.005, set: {REF%: 3, NOTE$: hi, "DIAG%(1,2)": 4, START_PB@: true}}
- {at: 0.01, ramp: {REF%: {to: 300, over: 0.5}}}
- {at: 0.02, sine: {GAIN: {amplitude: 2.5, hz: 7, for: 0.3}}}
- {at: 0.1, square: {RUN@: {hz: 10, for: 0.2}}}
- {at: 0.15, tune: {SPEED.KP: 3.5}}
- {at: 0.2, force: {REF%: 7}}
- {at: 0.3, unforce: all}
- {at: 0.35, reload: {SPEED: {file: NEW.BLK, keep_state: true}}}
- {at: 0.4, stop: [DRAW]}
- {at: 0.41, delete: [DRAW]}
- {at: 0.42, run: [DRAW]}
- {at: 0.45, reload: {DRAW: DRAW.BLK, SPEED: BAD.BLK}}
- {at: 0.46, run: [DRAW]}
- {at: 0.5, power: {off_for: 0.1}}
- {at: 0.65, stop_all: true}
- {at: 0.7, clear_errors: all}
- {at: 0.75, run_all: true}
- {at: 0.8, power: {off_for: 0.05, battery: false}}
- {at: 0.9, run_all: true}
"""


def test_a_recording_of_every_verb_replays_bit_for_bit(automax, run):
    automax.write("rack.yaml", RACK.replace("rack: PM1\n", "rack: PM1\nauto_run: true\n"))
    automax.write("NEW.BLK", SPEED.replace("SUM! + 1", "SUM! + 3").replace("CURRENT=1.0", "CURRENT=2.0"))
    automax.write("BAD.BLK", "10 END\n")
    result, report = run(EVERY_VERB, "--record", "bag", duration="1")
    assert result.code == 1
    operations = [(item["at"], item["what"], item.get("of"), item["ok"]) for item in report["operations"]]
    assert operations == [
        (0.15, "tune", "SPEED.KP", True),
        (0.2, "force", "REF%", True),
        (0.3, "unforce", None, True),
        (0.35, "reload", "SPEED", True),
        (0.4, "stop", "DRAW", True),
        (0.41, "delete", "DRAW", True),
        (0.42, "run", "DRAW", False),
        (0.45, "reload", "DRAW", True),
        (0.45, "reload", "SPEED", False),
        (0.46, "run", "DRAW", True),
        (0.5, "power", None, True),
        (0.65, "stop_all", None, True),
        (0.7, "clear_errors", None, True),
        (0.75, "run_all", None, True),
        (0.8, "power", None, True),
        (0.9, "run_all", None, True),
    ]
    why = [item["why"] for item in report["operations"] if not item["ok"]]
    assert why[0] == "task DRAW was deleted: reload it first"
    assert "BAD.BLK:1: AMX4040" in why[1]
    # each ms, from the tick after a start on: reload at 0.35, AUTO RUN at 0.6 and 0.85, run_all at 0.75
    scans = 350 + (499 - 350) + (649 - 600) + (799 - 750) + (999 - 850)
    assert (report["stopped"], report["tasks"]["SPEED"]["scans"]) == (None, scans)
    replayed = automax("replay", "bag")
    assert replayed.code == 0, replayed.out
    assert "no difference" in replayed.out
