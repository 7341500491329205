"""`automax bag info`: texts, JSON and exit codes; the numbers are tested in test/recordings/info/test_bag_info.py."""

import json

import pytest
from recordings.independent import GOLDEN
from recordings.recordings import MS, TABLE, record, sample_recording, write_of

from automax_ros.messages.types.messages import Int16


@pytest.fixture
def bag(automax):
    return sample_recording(automax.folder / "bag", seconds=0.2).name


def test_what_the_example_holds(automax):
    result = automax("bag", "info", GOLDEN)
    assert (result.code, result.err) == (0, "")
    lines = result.out.splitlines()
    assert lines[0] == f"{GOLDEN}: rack PM1, run 52ae3d5aa9353aeb"
    assert lines[1].strip() == "10 s; from 0 to 10 s of the run, rack time from 0 (simulated)"
    assert lines[2].strip().startswith("13357 messages, 2916 scans, 510.2 KiB, chunks compressed 6.3 : 1, 179 bytes")
    words = [line.split() for line in lines]
    assert ["SPEED", "2", "57C431", "automax", "2", "11", "ms", "911", "0", "910", "0", "0"] in words
    assert ["30:", "13", "integers,", "16", "booleans,", "1", "double", "integer"] in words
    assert ["/pm1/scans", "automax_msgs/msg/Scan", "2916", "291.60"] in words
    assert ["task", "LINE,", "SEQUENCE,", "MOTOR,", "SPEED"] in words
    assert any(line[0] == "rack.yaml" and line[-2] == "sha256" for line in words if line)
    assert lines[-1] == "sound: all checksums are right"


def test_json_holds_everything(automax, bag):
    result = automax("bag", "info", bag, "--json", "--check")
    assert (result.code, result.err) == (0, "")
    content = json.loads(result.out)
    assert (content["sound"], content["checked"], content["rack"], content["clock"]) == (
        True,
        True,
        "LINE1",
        "simulated",
    )
    assert content["variables"]["names"] == [variable.name for variable in TABLE.variables]
    (task,) = content["tasks"]
    assert (task["name"], task["scans"], task["first_scan"], task["last_scan"], task["errors"]) == (
        "SPEED",
        36,
        1,
        36,
        6,
    )
    assert task["errors_by_line"] == [{"line": 1030, "code": "AMX7001", "count": 6}]
    assert content["custom_data"] == {"program_hash": "a1b2", "step": "5500000"}
    assert content["duration_s"] == pytest.approx(0.198, abs=1e-6)
    rates = {topic["name"]: topic["rate_hz"] for topic in content["topics"]}
    assert rates["/line1/scans"] == pytest.approx(36 / 0.198, rel=1e-4)


def test_errors_stand_in_the_text(automax, bag):
    assert "SPEED  line 1030  AMX7001  6 times" in automax("bag", "info", bag).out


def test_a_run_on_the_wall_clock_has_times_of_day(automax):
    noon = 1_795_268_062 * 10**9
    log = [
        ("/a/variables", TABLE._replace(stamp=noon)),
        ("/a/backplane", write_of(1, noon + 90_500 * MS, {(0, 0): 1})),
    ]
    record(automax.folder / "b", log)
    line = automax("bag", "info", "b").out.splitlines()[1].strip()
    assert line == (
        "90.5 s, 2026-11-21 13:34:22 UTC to 2026-11-21 13:35:52 UTC; from 0 to 90.5 s of the run, "
        "rack time on the wall clock"
    )


def test_a_truncated_recording_is_1_and_points_to_repair(automax, bag):
    with (automax.folder / bag / "scans_0.mcap").open("r+b") as file:
        file.truncate(3000)
    result = automax("bag", "info", bag)
    assert (result.code, result.err) == (1, "")
    assert "not sound; what is counted above is readable:" in result.out
    assert "bag/scans_0.mcap: error[AMX6812]: ends early, at byte 3000" in result.out
    assert "automax bag repair" in result.out
    content = json.loads(automax("bag", "info", bag, "--json").out)
    assert content["sound"] is False
    assert content["problems"][0]["code"] == "AMX6812"


def test_a_recording_of_something_else(automax):
    record(automax.folder / "b", [("/number", Int16(1))])
    result = automax("bag", "info", "b")
    assert result.code == 0
    assert result.out.startswith("b: no rack\n")
    assert "tasks" not in result.out.splitlines()


@pytest.mark.parametrize("name", ["none", "TEXT.mcap", "."])
def test_what_is_no_recording_is_2(automax, name):
    if name == "TEXT.mcap":
        automax.write(name, "no recording")
    result = automax("bag", "info", name)
    assert (result.code, result.out) == (2, "")
    assert "error[AMX6810]" in result.err


def test_odd_names_do_not_reach_the_terminal(automax):
    table = TABLE._replace(
        rack="LINE1\x1b[2J", writers=(TABLE.writers[0]._replace(name="X\x1b]0;y\x07" * 90, kind=99),)
    )
    record(automax.folder / "b", [("/a/variables", table)], custom_data={"k\x1b": "v" * 500})
    result = automax("bag", "info", "b")
    assert result.code == 0
    assert "\x1b" not in result.out
    assert max(map(len, result.out.splitlines())) < 200
