"""`automax step`: a script through standard input, what it prints and its exit code; line editing on a terminal."""

import io
import os
import pty
import select
import signal
import subprocess
import sys
import time

import pytest
from scenario.test_stepper import DRAW, RACK, SPEED

from cli.support import Result


@pytest.fixture
def step(automax, monkeypatch):
    """Run a script of commands."""
    for name, text in (("rack.yaml", RACK), ("SPEED.BLK", SPEED), ("DRAW.BLK", DRAW)):
        automax.write(name, text)

    def call(*commands: str, options: tuple[str, ...] = ()) -> Result:
        monkeypatch.setattr(sys, "stdin", io.StringIO("\n".join(commands) + "\n"))
        return automax("step", "rack.yaml", *options)

    return call


def lines(result: Result) -> list[str]:
    assert (result.code, result.err) == (0, "")
    return [" ".join(line.split()) for line in result.out.splitlines()]


def test_a_breakpoint_and_lines(step):
    found = lines(step("set RUN@=on", "break SPEED:130", "go", "line", "clear all", "scan", "quit", "scan"))
    assert found == [
        "0 s",
        "SPEED:130",
        "0 s, SPEED before line 130",
        "at SPEED:130",
        "SPEED.N% 0 -> 1",
        "-> 130 SUM! = SUM! + N%",
        "0 s, SPEED before line 140",
        "SUM! 0 -> 1",
        "-> 140 TABLE%(1) = N%",
        "0 s",
    ]


def test_steps_by_scans_ticks_and_time(step):
    found = lines(step("watch SPEED.N%", "scan", "scan SPEED 3", "tick 2", "go 0.004", "until 0.02", "scan DRAW 2"))
    assert [line for line in found if line.endswith("s") or "->" in line] == [
        *("0 s", "0 s", "SPEED.N% 0 -> 1"),
        *("0.003 s", "SPEED.N% 1 -> 4"),
        *("0.005 s", "SPEED.N% 4 -> 5"),
        *("0.009 s", "SPEED.N% 5 -> 9"),
        *("0.02 s", "SPEED.N% 9 -> 20"),
        *("0.022 s", "SPEED.N% 20 -> 23"),
    ]


def test_a_variable_that_changes(step):
    found = lines(
        step("break SUM!", "go 0.01", "set RUN@=1", "go", "break", "force SUM!=50", "clear SUM!", "scan SPEED")
    )
    assert "changed: SUM!" in found
    assert found[found.index("changed: SUM!") - 1] == "0.01 s"
    assert "SUM! 0 -> 11" in found


def test_values_are_shown_set_forced_and_tuned(step):
    found = lines(
        step("set REF%=7", "show REF% table%(1)", "force REF%=9", "set SUM!=3", "show SPEED", "unforce REF%", "unforce")
    )
    assert found[1:3] == ["REF% 7", "TABLE%(1) 0"]
    assert found[3:] == ["REF% 9", "SUM! 3", "RUN@ FALSE", "SPEED.N% 0", "SPEED.NIL% 0"]


def test_operations_tasks_and_errors(automax, step):
    automax.write("SPEED.BLK", SPEED.replace("160 LIST%(2) = N%", "160 LIST%(2) = N% / NIL%"))
    found = lines(step("scan SPEED", "errors", "clear-errors", "stop draw", "tasks", "run-all", "stop-all", "tasks"))
    assert any(line.startswith("SPEED: scan 1, line 160: AMX70") for line in found)
    assert [line for line in found if line.startswith(("SPEED processor", "DRAW processor"))] == [
        "SPEED processor_0 running 1 0",
        "DRAW processor_0 stopped 0 0",
        "SPEED processor_0 stopped 1 0",
        "DRAW processor_0 stopped 0 0",
    ]


def test_the_source_around_a_line(step):
    found = step("list SPEED 130", "list draw").out.splitlines()
    assert "-> 130 SUM! = SUM! + N%" in found
    assert "   120 IF RUN@ THEN" in found
    assert "   30 N% = N% + 10" in found


def test_a_fault_is_told(automax, step):
    automax.write("SPEED.BLK", SPEED.replace("160 LIST%(2) = N%", "160 IF N% > 2 THEN 160"))
    found = lines(step("go"))
    assert any(line.startswith("STOP ALL (code 14): task SPEED: scan 3, line 160: AMX7040") for line in found)


def test_stimuli_and_settings(automax, step):
    automax.write("stimuli.yaml", "- {at: 0.0025, set: {REF%: 5}}\n")
    found = lines(step("break REF%", "go", options=("--stimuli", "stimuli.yaml", "--set", "REF%=2")))
    assert found[2:5] == ["0.0025 s", "changed: REF%", "REF% 2 -> 5"]


@pytest.mark.parametrize(
    ("command", "message"),
    [
        ("jump", "there is no command 'jump'"),
        ("sacn", "did you mean scan?"),
        ("until", "write until S"),
        ("go now", "is not a number"),
        ("scan SPEED 0", "between 1 and 1000000, not 0"),
        ("break SPEED:12x", "a line must be a whole number"),
        ("break NOTHING%", "no common variable 'NOTHING%'"),
        ("clear SUM!", "there is no breakpoint 'SUM!'"),
        ("show TABLE%", "name one element"),
        ("set AUTORUNSTATUS@=1", "AUTORUNSTATUS@"),
        ("tune SPEED.N%=1", "refused: task SPEED has no tunable"),
        ("tune SPEED.N%", "is not TASK.NAME=VALUE"),
        ("run SPEED", "refused: task SPEED runs already"),
        ("list NOBODY", "no task 'NOBODY'"),
    ],
)
def test_a_command_that_fails_is_told_and_the_script_goes_on(step, command, message):
    result = step(command, "tick")
    assert result.code == 1
    assert message in result.err
    assert "\n0.001 s\n" in result.out


def test_values_from_outside_wait_for_the_end_of_a_scan(step):
    result = step("break SPEED:130", "set RUN@=1", "go", "set REF%=1", "scan", "set REF%=1", "show REF%")
    assert (result.code, result.err.count("automax step:")) == (1, 1)
    assert "SPEED is held before line 130: a scan must end first" in result.err
    assert result.out.splitlines()[-1].split() == ["REF%", "1"]


def test_a_modeled_rack_is_held_at_lines_in_ideal_execution_only(automax, step):
    automax.write("rack.yaml", RACK.replace("rack: PM1\n", "rack: PM1\nexecution: modeled\n"))
    result = step("break SPEED:120")
    assert result.code == 1
    assert "automax step --ideal" in result.err
    assert "0 s, SPEED before line 120" in lines(step("break SPEED:120", "go", options=("--ideal",)))


def test_help_lists_every_command(step):
    found = lines(step("help", "help scan", "# a remark", ""))
    for usage in ("scan [TASK] [N]", "break [TASK:LINE | NAME]", "quit"):
        assert any(line.startswith(usage) for line in found)
    assert found[-1].startswith("scan [TASK] [N]")


def test_a_rack_with_errors_is_not_stepped(automax, step):
    automax.write("SPEED.BLK", "10 END\n")
    result = step("scan")
    assert result.code == 1
    assert "automax step: no task is started" in result.err


def until(terminal: int, text: bytes) -> bytes:
    """What a terminal shows, up to a text."""
    shown, end = b"", time.monotonic() + 240
    while text not in shown and time.monotonic() < end:
        if select.select([terminal], [], [], 1)[0]:
            shown += os.read(terminal, 4096)
    assert text in shown, shown
    return shown


def test_lines_are_edited_and_completed_on_a_terminal(automax, step):
    step("quit")
    ours, theirs = pty.openpty()
    command = [sys.executable, "-m", "automax_ros.cli.main", "step", "rack.yaml"]
    environment = {**os.environ, "TERM": "vt100"}
    process = subprocess.Popen(command, stdin=theirs, stdout=theirs, cwd=automax.folder, env=environment)
    try:
        os.close(theirs)
        until(ours, b"step> ")
        os.write(ours, b"unt\t 0.004\n")  # completed to `until`
        assert b"until" in until(ours, b"step> ")
        os.write(ours, b"\x1b[A\x7f5\n")  # the line before, its last figure changed
        assert b"0.005 s" in until(ours, b"step> ")
        os.write(ours, b"go\n")
        until(ours, b"\n")
        time.sleep(2.0)
        process.send_signal(signal.SIGINT)
        assert b"interrupted" in until(ours, b"step> ")
        os.write(ours, b"quit\n")
        assert process.wait(240) == 0
    finally:
        process.kill()
        process.wait()
        os.close(ours)


def test_a_forced_local_keeps_its_value_from_line_to_line(step):
    found = lines(
        step(
            "set RUN@=on",
            "force speed.n%=5",
            "watch SPEED.N%",
            "scan SPEED 3",
            "show SUM!",
            "unforce all",
            "scan SPEED",
        )
    )
    assert "SUM! 15" in found
    assert [line for line in found if line.startswith("SPEED.N% 5 ->")] == ["SPEED.N% 5 -> 6"]
    refused = step("force SPEED.N%=x", "force SPEED.NONE%=1")
    assert "'x' is not a value for SPEED.N%, type INTEGER" in refused.err + refused.out
    assert "task SPEED has no variable of its own 'NONE%'" in refused.err + refused.out


def test_a_forced_local_keeps_its_value_inside_a_scan(step):
    found = lines(step("set RUN@=on", "force SPEED.N%=5", "break SPEED:130", "go", "line", "show SPEED.N%"))
    assert "SUM! 0 -> 5" in found
    assert found[-1] == "SPEED.N% 5"


def test_entries_of_0_come_before_what_stands_before_scan_loop(automax, step):
    automax.write("stimuli.yaml", "- {at: 0, set: {REF%: 5}}\n")
    automax.write("SPEED.BLK", SPEED.replace("100 CALL", "90 N% = REF% * 100\n100 CALL"))
    found = lines(step("show SPEED.N%", options=("--stimuli", "stimuli.yaml")))
    assert "SPEED.N% 500" in found
