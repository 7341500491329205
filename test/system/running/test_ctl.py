"""`automax ctl` and the services of a running rack, over real DDS; what was done is recorded and replayed."""

import json
import os
import signal
import subprocess
from contextlib import nullcontext
from pathlib import Path

import pytest

from automax_ros.recordings.read.reader import BagReader
from automax_ros.replay.engine import ReplayOptions, replay
from system.support import COMMAND, PATIENCE_S, RACKS, TYPES, Automax, Client, automax_here, wait_until

OPERATED = RACKS / "operated" / "rack.yaml"
READY = "Ctrl-C ends the run"
PATIENT = ("--timeout", "30")


@pytest.fixture(scope="module")
def rack(module_domain_id, tmp_path_factory):
    """A rack that runs for all tests of the module, and its recording."""
    bag = tmp_path_factory.mktemp("operated") / "bag"
    with Automax("run", OPERATED, "--record", bag) as process:
        process.wait_for_line(READY)
        process.bag = bag
        yield process


@pytest.fixture(scope="module")
def caller(rack):
    from automax_ros.ros.clients.rack_client import RackClient

    with RackClient("/operated") as made:
        yield made


@pytest.fixture
def one_client(caller, monkeypatch):
    """Calls in this process speak through one client: each of its own takes up to 3 s to find the rack."""
    from automax_ros.ros.clients import rack_client as operating

    def joined(space: str, *_: object):
        assert space == "/operated"
        return nullcontext(caller)

    monkeypatch.setattr(operating, "RackClient", joined)


def ctl(*arguments: str | Path):
    return ctl_of("OPERATED", *arguments)


def ctl_of(rack: str, *arguments: str | Path):
    return automax_here("ctl", rack, *arguments, *PATIENT)


@pytest.mark.usefixtures("rack", "one_client")
def test_a_rack_is_operated_from_another_process(tmp_path):
    with Automax("ctl", "OPERATED", "watch", "REF%", "COUNT!", "--every", "0.1", "--json", *PATIENT) as watch:
        wait_until(lambda: "".join(watch.out).count("COUNT!") > 3)
        watched = watch.end(signal.SIGINT)
    told = [json.loads(line) for line in watched.out.splitlines()]
    assert watched.code == 0
    assert [item["name"] for item in told].count("REF%") == 1, "told once: it does not change"
    counts = [int(item["value"]) for item in told if item["name"] == "COUNT!"]
    assert counts == sorted(set(counts))
    assert len(counts) > 3
    unknown = ctl("watch", "NIL%")
    assert (unknown.code, unknown.out) == (1, "")
    assert "automax ctl: watch NIL%: refused: " in unknown.err
    assert ctl("stop", "LINE").out == "stop LINE: done\n"
    refused = ctl("stop", "SPEED")
    assert (refused.code, refused.out) == (1, "")
    assert "automax ctl: stop SPEED: refused: task SPEED is critical" in refused.err
    ended = ctl("set", "REF%=200", "NIL%=1", "--json")
    assert ended.code == 1
    good, bad = json.loads(ended.out)
    assert good == {"what": "set", "of": "REF% = 200", "ok": True, "reason": "", "now": "200"}
    assert bad["ok"] is False
    assert "no common variable" in bad["reason"]
    assert ctl("tune", "SPEED.TRIM%=5").code == 0
    assert ctl("tune", "SPEED.TRIM%=5").out == "tune SPEED.TRIM% = 5: was already 5\n"
    assert ctl("get", "REF%", "SPEED.TRIM%", "OUT%").out == "REF% = 200\nSPEED.TRIM% = 5\nOUT% = 205\n"
    assert ctl("get", "R*").out == "REF% = 200\n"
    assert ctl("force", "OUT%=-1").code == 0
    assert ctl("forces").out == "OUT% = -1\n"
    errors = ctl("errors").out
    assert errors.startswith("LINE     first  scan 3, line 120: AMX")
    tasks = json.loads(ctl("tasks", "--json").out)[0]["answer"]
    assert [(item["task"], item["module"], item["status"], item["priority"]) for item in tasks] == [
        ("LINE", "processor_1", "stopped", 4),
        ("SPEED", "processor_1", "running", 5),
    ]
    assert tasks[1]["period_ms"] == 11.0
    edited = tmp_path / "LINE.BLK"
    edited.write_text(OPERATED.with_name("LINE.BLK").read_text().replace("COUNT! + 1", "COUNT! + NIL!"))
    wrong = ctl("reload", "LINE", edited)
    assert wrong.code == 1
    assert "LINE.BLK:4:" in wrong.err
    edited.write_text(OPERATED.with_name("LINE.BLK").read_text().replace("COUNT! + 1", "COUNT! + 10"))
    assert ctl("reload", "LINE", edited).code == 0
    assert ctl("run", "LINE").code == 0
    assert ctl("stop-all").code == 0
    status = json.loads(ctl("status", "--json").out)[0]["answer"]
    assert (status["rack"], status["running"], status["tasks"], status["forced"]) == ("OPERATED", 0, 2, 1)
    assert (status["stopped"], status["stopped_reason"]) == (True, "STOP ALL by the operator")
    assert ctl("unforce", "--all").code == 0
    assert ctl("run-all").out == "run-all: done, 2 of 2 tasks run\n"
    assert "stopped" not in ctl("status").out


@pytest.mark.usefixtures("rack", "one_client")
def test_a_rack_is_halted_and_stepped_from_another_process():
    assert ctl("pause").out.startswith("pause: done, rack time is frozen at ")
    (stepped,) = json.loads(ctl("step", "scan", "SPEED", "--count", "2", "--json").out)
    at_s = stepped["answer"]["time_s"]
    assert (stepped["answer"]["why"], at_s) == ("done", pytest.approx(round(at_s / 0.0055) * 0.0055))
    assert ctl("step", "tick", "--count", "4").out == f"step: done at {at_s + 0.022:.9g} s, 2 scans\n"
    assert ctl("resume").code == 0
    refused = ctl("step")
    assert refused.code == 1
    assert refused.err == "automax ctl: step scan: refused: the rack is not halted: pause it first\n"


def test_what_was_done_is_told_to_late_joiners_and_recorded_and_the_recording_replays(rack):
    from automax_msgs.msg import Operation

    with Client() as client:
        told = client.listen(Operation, "/operated/operations", latched=True, depth=100)
        client.until(lambda: bool(told) and not told[-1].ok and told[-1].what == "step", "the last operation")
    assert rack.end(signal.SIGINT).code == 0
    recorded = [item.message for item in BagReader(rack.bag).messages(types={"automax_msgs/msg/Operation"})]
    assert [(item.what, item.task, item.ok) for item in told] == [(item.what, item.task, item.ok) for item in recorded]
    assert [(item.what, item.ok) for item in recorded] == [
        ("stop", True),
        ("stop", False),
        ("set", True),
        ("set", False),
        ("tune", True),
        ("tune", True),
        ("force", True),
        ("reload", False),
        ("reload", True),
        ("run", True),
        ("stop_all", True),
        ("unforce", True),
        ("run_all", True),
        ("pause", True),
        ("step", True),
        ("step", True),
        ("resume", True),
        ("step", False),
    ]
    report = replay(rack.bag, {}, ReplayOptions())
    assert report.identical
    notes = {task.name: task.notes for task in report.tasks}
    assert any(note.startswith("reloaded at") for note in notes["LINE"])
    assert not any("not stored" in note or "could not" in note for task in report.tasks for note in task.notes)


def test_without_an_operator_nothing_can_be_operated(ros_domain_id):
    absent = automax_here("ctl", "TYPES", "status", "--timeout", "0.5")
    assert absent.code == 2
    assert "no rack /types is seen within 0.5 s" in absent.err
    with Automax("run", TYPES) as rack:
        rack.wait_for_line(READY)
        closed = automax_here("ctl", TYPES, "stop-all", *PATIENT)
        with Client() as client:
            names = [name for name, _ in client.node.get_service_names_and_types()]
        assert not [name for name in names if name in ("/types/stop_all", "/types/run", "/types/set")]
    assert closed.code == 2
    assert "rack /types has no operator's services" in closed.err
    assert "operator: true" in closed.err


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (("PM 1!", "status"), "neither a rack's name"),
        (("PM1", "set", "REF%"), "is not NAME=VALUE"),
        (("PM1", "unforce"), "takes names, or --all"),
        (("PM1", "reload", "LINE", "missing.BLK"), "missing.BLK"),
        (("PM1", "fly"), "invalid choice"),
        (("PM1", "step", "until", "soon"), "takes a rack time in seconds"),
        (("PM1", "step", "--count", "0"), "--count: 0 is not a number from 1 to 1000000"),
        (("PM1", "status", "--timeout", "0"), "too short"),
    ],
)
def test_wrong_usage(ros_domain_id, arguments, reason):
    result = automax_here("ctl", *arguments)
    assert result.code == 2
    assert reason in result.err


def test_two_racks_of_one_name_are_operated_by_nobody(ros_domain_id, tmp_path):
    """As on two hosts: each has its own folder of locks."""
    (tmp_path / "other").mkdir()
    with Automax("run", OPERATED) as first:
        first.wait_for_line(READY)
        with Automax("run", OPERATED, environment=os.environ | {"TMPDIR": str(tmp_path / "other")}) as second:
            second.wait_for_line(READY)
            for words in (("stop-all",), ("lifecycle", "deactivate")):
                refused = ctl(*words)
                assert refused.code == 2
                assert "2 racks are called /operated" in refused.err
            assert second.end(signal.SIGINT).code == 0
        assert first.end(signal.SIGINT).code == 0
    assert "STOP ALL" not in "".join((*first.out, *second.out))


def test_a_prompt_stays_connected_and_a_press_is_seen_by_the_tasks(ros_domain_id):
    with Automax("run", RACKS / "line4" / "rack.yaml", "--distributed") as rack:
        rack.wait_for_line(READY)
        wait_until(lambda: ctl_of("LINE4", "status").code == 0)  # all processes have met
        lines = "get START_PB@\npress START_PB@ --for 0.05\nget 'START*' NIL@\nget 'RING_9.*'\nstatus\n"
        command = [*COMMAND, "ctl", "LINE4", "shell", *PATIENT]
        shell = subprocess.run(command, input=lines, capture_output=True, text=True, timeout=PATIENCE_S, check=False)
        assert shell.returncode == 1
        assert "START_PB@ = FALSE\npress START_PB@: done\nrack LINE4:" in shell.stdout
        assert "display of processor_4: blank, no fault" in shell.stdout
        assert shell.stderr.count("refused") == 2
        assert rack.end(signal.SIGINT).code == 0
