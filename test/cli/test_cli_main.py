"""The command line as a whole: subcommands, exit codes, broken pipes, interrupts, start-up."""

import errno
import os
import subprocess
import sys
from pathlib import Path

import pytest

import automax_ros
import automax_ros.cli.tasks.blocks
import automax_ros.cli.tasks.check
from automax_ros.cli.main import BROKEN_PIPE, INTERRUPTED, SUBCOMMANDS, main, module_of
from cli.support import TASK

ROOT = Path(automax_ros.__file__).parent.parent


def started(
    *arguments, stdout=subprocess.PIPE, code="import sys; from automax_ros.cli.main import main; sys.exit(main())"
):
    """`automax` as a process of its own, the way its console script calls it."""
    return subprocess.Popen(
        [sys.executable, "-c", code, *arguments],
        stdout=stdout,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )


def test_version(automax):
    code, out, err = automax("--version")
    first, *what_runs = out.splitlines()
    assert (code, first, err) == (0, f"automax {automax_ros.__version__}", "")
    assert what_runs
    assert all(line.startswith(("compiled: ", "plain Python: ")) for line in what_runs)


def test_help_has_one_line_for_every_subcommand(automax):
    result = automax("--help")
    assert result.code == 0
    lines = result.out.splitlines()
    for name, text in SUBCOMMANDS.items():
        assert [line.split() for line in lines].count([name, *text.split()]) == 1


@pytest.mark.parametrize("name", SUBCOMMANDS)
def test_every_subcommand_has_its_own_help(automax, name):
    result = automax(name, "--help")
    assert (result.code, result.err) == (0, "")
    assert result.out.startswith(f"usage: automax {name} ")


def test_no_subcommand_is_wrong_usage_and_shows_the_help(automax):
    result = automax()
    assert (result.code, result.out) == (2, "")
    assert "explain" in result.err


def test_unknown_subcommand_asks_what_was_meant(automax):
    result = automax("chekc", "A.BLK")
    assert (result.code, result.out) == (2, "")
    assert result.err == "automax: error: no subcommand 'chekc'\n  hint: did you mean check?\n"


def test_nothing_like_a_subcommand_lists_them(automax):
    assert "there are check, trace" in automax("zzz").err


@pytest.mark.parametrize(
    "arguments",
    [["check"], ["check", "--nonsense", "A.BLK"], ["trace", "A.BLK"], ["explain", "1", "2"], ["--nonsense"]],
)
def test_wrong_usage_is_2_with_nothing_on_standard_output(automax, arguments):
    result = automax(*arguments)
    assert (result.code, result.out) == (2, "")
    assert "usage: automax" in result.err


def test_interrupt_ends_silently(automax, monkeypatch):
    def interrupted(arguments):
        raise KeyboardInterrupt

    monkeypatch.setattr(automax_ros.cli.tasks.blocks, "run", interrupted)
    assert automax("blocks") == (INTERRUPTED, "", "")


@pytest.mark.parametrize("name", ["run", "node", "record", "play", "panel"])
def test_ctrl_c_before_a_command_takes_signals_is_the_end_of_what_runs_until_it_is_stopped(automax, monkeypatch, name):
    def interrupted(arguments):
        raise KeyboardInterrupt

    monkeypatch.setattr(module_of(name), "run", interrupted)
    words = {"node": ["rack.yaml", "--module", "1"]}.get(name, ["rack.yaml"])
    assert automax(name, *words) == (0, "", "")


def test_arguments_of_the_process_are_the_default(automax, monkeypatch):
    monkeypatch.setattr(sys, "argv", ["automax", "--version"])
    assert main() == 0


def test_output_that_nobody_reads_any_more_is_no_error(tmp_path):
    """A pipe is closed before anything is written, as by `automax compile FILE | true`."""
    path = tmp_path / "TASK.BLK"
    path.write_text(TASK)
    reading, writing = os.pipe()
    os.close(reading)
    with started("compile", str(path), stdout=writing) as process:
        os.close(writing)
        _, err = process.communicate(timeout=240)
    assert (process.returncode, err) == (BROKEN_PIPE, "")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs Linux's /dev/full")
def test_full_disk_is_told_without_a_traceback(tmp_path):
    with Path("/dev/full").open("w") as full, started("blocks", stdout=full) as process:
        _, err = process.communicate(timeout=240)
    assert process.returncode == 2
    assert err == f"automax: error: the output cannot be written: {os.strerror(errno.ENOSPC)}\n"


@pytest.mark.parametrize("closed", [">&-", "2>&-", "<&-", ">&- 2>&-", "<&- >&- 2>&-"])
@pytest.mark.parametrize(
    "arguments",
    [
        "blocks",
        "check rack.yaml",
        "run rack.yaml --simulated --duration 0.1",
        "run rack.yaml --duration 0.01 --state state",
        "bag info bag",
    ],
)
def test_closed_streams_are_nobody_who_reads(tmp_path, ros_domain_id, closed, arguments):
    """The command does what it should; its exit code tells, and nothing lands in a file that got the number."""
    config = ROOT / "config" / "section_drive" / "rack.yaml"
    line = arguments.replace("rack.yaml", str(config)).replace("bag info bag", f"bag info {ROOT}/bags/section_drive")
    command = f"{sys.executable} -m automax_ros.cli.main {line} {closed}"
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    result = subprocess.run(
        ["/bin/sh", "-c", command], capture_output=True, text=True, check=False, cwd=tmp_path, env=environment
    )
    assert (result.returncode, result.stderr) == (0, "")


def test_interrupt_while_imports_last_is_silent(tmp_path):
    """However early Ctrl-C comes once `automax` itself has begun."""
    code = (
        "import sys, importlib, builtins\n"
        "from automax_ros.cli import main\n"
        "class Interrupting:\n"
        "    def find_spec(self, name, *_):\n"
        "        if name == sys.argv[1]:\n"
        "            raise KeyboardInterrupt\n"
        "wanted = sys.argv[1]\n"
        "sys.meta_path.insert(0, Interrupting())\n"
        "sys.modules.pop(wanted, None)\n"
        "sys.argv[1:] = [wanted]\n"
        "main.sys.exit(main.main(['check', 'none.BLK']))\n"
    )
    for module in (
        "argparse",
        "automax_ros.core.user_error",
        "automax_ros.cli.tasks.check",
        "automax_ros.blocks.catalogue",
    ):
        with started(module, code=code) as process:
            out, err = process.communicate(timeout=240)
        assert (process.returncode, out, err) == (INTERRUPTED, "", ""), module


def test_interrupt_after_the_end_leaves_the_exit_code(tmp_path):
    code = (
        "import atexit, os, signal, sys\n"
        "atexit.register(lambda: os.kill(os.getpid(), signal.SIGINT))\n"
        "from automax_ros.cli.main import entry\n"
        "entry()"
    )
    with started("--version", code=code) as process:
        _, err = process.communicate(timeout=240)
    assert (process.returncode, err) == (0, "")


def test_terminal_without_a_character_does_not_stop_the_program(tmp_path):
    path = tmp_path / "TASK.BLK"
    path.write_text("10 CALL SCAN_LOOP(TICKS=4)\n20 PRINT 'Grüße', X%\n30 END\n", encoding="utf-8")
    code = (
        "import sys; sys.stdout.reconfigure(encoding='ascii'); from automax_ros.cli.main import main; sys.exit(main())"
    )
    with started("check", str(path), code=code) as process:
        out, err = process.communicate(timeout=240)
    assert process.returncode == 1
    assert "Gr\\xfc\\xdfe" in out
    assert err == ""


def test_module_can_be_started(tmp_path):
    command = [sys.executable, "-m", "automax_ros.cli.main", "check", "NONE.BLK"]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    result = subprocess.run(command, capture_output=True, text=True, check=False, cwd=tmp_path, env=environment)
    assert (result.returncode, result.stdout) == (2, "")
    assert result.stderr == "automax check: error: NONE.BLK cannot be read: No such file or directory\n"


def test_check_starts_with_what_it_needs_only(tmp_path):
    """What makes a start slow is imports: no numbers, bags, ROS or progress bars to check a task."""
    path = tmp_path / "TASK.BLK"
    path.write_text(TASK)
    code = (
        "import sys; from automax_ros.cli.main import main; main(['check', sys.argv[1]]); print(*sorted(sys.modules))"
    )
    with started(str(path), code=code) as process:
        out, _ = process.communicate(timeout=240)
    loaded = set(out.split())
    assert "automax_ros.language.checks.checker" in loaded
    heavy = {"numpy", "mcap", "rich", "rclpy", "yaml", "automax_ros.compile.compiler", "automax_ros.cli.tasks.trace"}
    assert not loaded & heavy
