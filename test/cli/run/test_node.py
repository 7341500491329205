"""`automax node` and `automax run --distributed` as command lines; test/system has their processes."""

from __future__ import annotations

from pathlib import Path

import pytest

LINE4 = Path(__file__).parents[2] / "system" / "racks" / "line4"


def test_processes_of_a_rack_with_the_reasons(automax):
    result = automax("node", LINE4)
    assert (result.code, result.err) == (0, "")
    assert result.out.splitlines() == [
        "common_memory     common_memory",
        "processor_1       processor_1 drive_7 digital_io_8",
        "                  task CML fires the gates of drive_7",
        "                  task CML reads the permissive of digital_io_8",
        "processor_2       processor_2",
        "processor_3       processor_3",
        "processor_4       processor_4",
        "digital_io_5      digital_io_5",
        "udc_10            udc_10",
    ]


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--module", "11"], "the rack has no module '11'"),
        (["--module", "procesor_3"], "did you mean processor_3?"),
        (["--module", "3", "--set", "LINE_REF%=5"], "--set belongs to the process of common memory"),
        (["--module", "3", "--run-id", "0"], "'0' is not a number from 1 to 9223372036854775807"),
        (["--module", "3", "--run-id", "9223372036854775808"], "is not a number from 1 to"),
        (["--module", "3", "--run-id", "-1"], "is not a number from 1 to"),
        (["--module", "3", "--watch", "NONE%"], "--watch: "),
        (["--module", "3", "--record", "bag"], "unrecognized arguments: --record"),
    ],
)
def test_wrong_usage_of_node(automax, options, said):
    result = automax("node", LINE4, *options)
    assert result.code == 2
    assert said in result.err
    assert result.out == ""


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--simulated", "--distributed"], "--distributed needs the wall clock, by which its processes agree"),
        (["--no-restart"], "--no-restart belongs to --distributed"),
        (["--simulated", "--no-restart"], "--no-restart belongs to --distributed"),
        (["--distributed", "--record", "bag", "--record-locals"], "--record-locals is not possible with --distributed"),
    ],
)
def test_wrong_usage_of_run(automax, options, said):
    result = automax("run", LINE4, *options)
    assert result.code == 2
    assert said in result.err


def test_rack_with_errors_starts_no_process(automax):
    automax.write(
        "rack.yaml", "rack: PM1\nslots:\n  0: {module: 57C413}\n  1: {module: 57C435, tasks: {T: {priority: 5}}}\n"
    )
    automax.write("T.BLK", "10 CALL SCAN_LOOP(TICKS=0)\n20 END\n")
    result = automax("run", "rack.yaml", "--distributed")
    assert result.code == 1
    assert "T.BLK:1:" in result.err
    assert "in 2 processes" not in result.out
