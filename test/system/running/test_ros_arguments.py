"""Programs as launch files and docs/ros.md start them: --ros-args, ROS_NAMESPACE, simulated time with nodes."""

import json
import os
import signal

import pytest

from system.support import TYPES, Automax, automax, automax_here

READY = "Ctrl-C ends"


def test_simulated_run_with_nodes_ends_as_one_without(ros_domain_id, tmp_path):
    """The report has tasks, scans, errors and all commons; times of the host are not in it."""
    reports = []
    for name, options in (("plain", ()), ("nodes", ("--ros",))):
        path = tmp_path / f"{name}.json"
        ended = automax(
            "run", TYPES, "--simulated", "--duration", "1.5", "--set", "REF%=77", "--report", path, *options
        )
        assert (ended.code, ended.err) == (0, "")
        reports.append(json.loads(path.read_text()))
    assert reports[0] == reports[1]
    assert reports[0]["commons"]["TWICE%"] == 154


def test_wrong_tunable_refuses_the_start_with_the_reason(ros_domain_id, tmp_path):
    path = tmp_path / "params.yaml"
    path.write_text("/**:\n  ros__parameters:\n    FAST:\n      TRIM: 101\n")
    ended = automax("run", TYPES, "--duration", "1", "--ros-args", "--params-file", str(path), "--")
    assert ended.code == 2
    assert f"{path}:4: FAST.TRIM: " in ended.err
    assert "Traceback" not in ended.err


def test_use_sim_time_of_a_distributed_rack_is_refused(ros_domain_id):
    ended = automax_here("run", TYPES, "--distributed", "--ros-args", "-p", "use_sim_time:=true", "--")
    assert ended.code == 2
    assert "use_sim_time: processes of a distributed rack agree by the wall clock" in ended.err


def test_namespace_of_the_environment_moves_rack_and_client_alike(ros_domain_id):
    """`automax ctl TYPES` finds the rack in the same namespace."""
    environment = {**os.environ, "ROS_NAMESPACE": "/plant/hall_2"}
    with Automax("run", TYPES, "--ros-args", "-r", "processor_1:__node:=cpu", "--", environment=environment) as rack:
        rack.wait_for_line(READY)
        assert "ROS 2 namespace /plant/hall_2/types in domain" in "".join(rack.out)
        ended = automax("ctl", "TYPES", "status", environment=environment)
        # The rack of this test has no operator: ctl has found it, or it would say that there is none.
        assert "rack /plant/hall_2/types has no operator's services" in ended.err
        ended = rack.end(signal.SIGINT)
    assert (ended.code, ended.err) == (0, "")


@pytest.mark.soak
def test_rack_follows_the_clock_of_a_recording_that_is_played(ros_domain_id, tmp_path):
    bag = tmp_path / "bag"
    assert automax("run", TYPES, "--simulated", "--duration", "3", "--record", bag).code == 0
    report = tmp_path / "report.json"
    words = ("--duration", "1", "--report", report, "--ros-args", "-p", "use_sim_time:=true", "--")
    with Automax("run", TYPES, *words) as rack:
        rack.wait_for_line("follows /clock")
        played = automax("play", bag, "--namespace", "/replay")
        assert (played.code, played.err) == (0, "")
        ended = rack.end()
    assert (ended.code, ended.err) == (0, "")
    tasks = json.loads(report.read_text())["tasks"]
    assert {name: (task["scans"], task["skipped"]) for name, task in tasks.items()} == {
        "FAST": (182, 0),
        "SLOW": (61, 0),
        "COPY": (400, 0),
    }
