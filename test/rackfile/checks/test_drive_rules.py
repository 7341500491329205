"""Rules of a rack's current minor loop tasks: what `check` says, where, and what is right."""

from __future__ import annotations

import pytest
from rack.drives.drive_tasks import CML, YAML, folder_of
from rack.helpers import config_at
from replay.replays import edited

from automax_ros.rackfile.checks.tasks import check_tasks


def found(folder, **changes):
    """Code, task, line and message of what the rack has against its tasks."""
    config = config_at(folder_of(folder, **changes))
    return [
        (item.code, task.name, item.span.line, item.message, item.hint)
        for task, _, checked in check_tasks(config)
        for item in checked.diagnostics
    ]


def test_example_is_right(tmp_path):
    assert found(tmp_path) == []


@pytest.mark.parametrize(
    ("change", "code", "column_line", "message"),
    [
        (("IO_CNTL_SLOT=7", "IO_CNTL_SLOT=3"), "AMX6486", 3, "slot 3 holds no module in rack.yaml"),
        (("IO_CNTL_SLOT=7", "IO_CNTL_SLOT=8"), "AMX6486", 3, "slot 8 holds the 57C408 (rack.yaml:5)"),
        (("DIG_IO_SLOT=8", "DIG_IO_SLOT=7"), "AMX6487", 3, "slot 7 holds the 57C406 (rack.yaml:4)"),
    ],
)
def test_slots_are_told_with_both_lines(tmp_path, change, code, column_line, message):
    ((seen, task, line, text, hint),) = found(tmp_path, cml=edited(CML, change))
    assert (seen, task, line) == (code, "CML", column_line)
    assert message in text
    assert "the rack has one in slot" in hint


def test_equal_priority_is_not_before(tmp_path):
    assert found(tmp_path, yaml=edited(YAML, ("SPEED: {priority: 6}", "SPEED: {priority: 4}"))) == []
    ((code, task, _, text, _),) = found(tmp_path, yaml=edited(YAML, ("CML: {priority: 4}", "CML: {priority: 8}")))
    assert (code, task) == ("AMX6492", "CML")
    assert "SPEED of the same Processor" in text


@pytest.mark.parametrize(
    ("hertz", "given", "told"), [(50, 60, True), (50, 50, False), (50, 48, False), (60, 60, False), (59.5, 60, True)]
)
def test_ac_line_freq_is_not_above_the_line_of_the_plant(tmp_path, hertz, given, told):
    """52.1.1: the lowest frequency that is expected; a warning, since the drive runs."""
    yaml = edited(
        YAML,
        ("{motor: dc_150hp_500v, inertia: 100.0}", f"{{motor: dc_10hp_240v, line: {{hz: {hertz}}}}}"),
    )
    tasks = found(tmp_path, yaml=yaml, cml=edited(CML, ("IO_CNTL_SLOT=7", f"IO_CNTL_SLOT=7, AC_LINE_FREQ={given}")))
    assert [(code, task) for code, task, *_ in tasks] == [("AMX6788", "CML")] * told
    for _, _, line, message, hint in tasks:
        assert line == 3
        assert f"AC_LINE_FREQ is {given} Hz, but the line of plant UNWIND (rack.yaml:" in message
        assert hint.endswith(f"write {50 if hertz == 50 else 59} or less")


def test_tick_of_the_processor_must_be_the_default(tmp_path):
    """52.0: set to the default tick rate (5.5 ms)."""
    tasks = found(tmp_path, yaml=edited(YAML, ("module: 57C435, tasks", "module: 57C435, tick_ms: 5, tasks")))
    assert tasks
    assert {task for _, task, *_ in tasks} == {"CML"}


def test_outputs_may_not_be_input_points(tmp_path):
    yaml = edited(YAML, ("  STATE@: {}", "  STATE@: {slot: 8, register: 0, bit: 5}"))
    assert [task for _, task, *_ in found(tmp_path, yaml=yaml)] == ["CML"]
