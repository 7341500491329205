"""The command line `automax`: finds the subcommand, runs it, and turns errors into exit codes.

The top imports only modules that Python has loaded anyway: while later imports run, signals are already handled.
"""

from __future__ import annotations

import io
import os
import sys
from typing import TYPE_CHECKING

from automax_ros.cli import startup_signals as early

if TYPE_CHECKING:
    import argparse
    from collections.abc import Mapping, Sequence
    from types import ModuleType
    from typing import NoReturn

    from automax_ros.ros.setup.arguments import RosArguments

SUBCOMMANDS: dict[str, str] = {
    "check": "find everything that is wrong with tasks and rack files",
    "trace": "run a task scan by scan on a CSV table",
    "compile": "print the function that a task becomes",
    "diagram": "draw the block diagram of a task",
    "tune-info": "coefficients and limits of dynamic blocks in a task",
    "response": "step response and Bode diagram of a dynamic block",
    "sweep": "run a rack many times with other values, and measure",
    "load": "CPU load of each module by the manual's execution times",
    "xref": "who writes and who reads each common of a rack",
    "drive-check": "judge drives by the manual's formulas, propose gains",
    "new": "make a rack file from a folder of tasks",
    "import": "make a rack file from a plant's disks",
    "convert": "make tasks of an old plant acceptable",
    "run": "run a rack",
    "node": "run one process of a rack that is distributed",
    "step": "step a rack: a tick, a scan, a BASIC line at a time",
    "panel": "show a rack or a recording in the browser",
    "record": "record a rack that runs",
    "ctl": "operate a rack that runs: RUN, STOP, force, set, tune",
    "replay": "execute a recording again, find the first difference",
    "rerun": "run a recorded rack again with an edit, in closed loop",
    "play": "send the messages of a recording again, with /clock",
    "bag": "tell what a recording holds, repair one",
    "export": "write common memory or scans of a recording to a table",
    "plot": "draw variables of a recording",
    "report": "a rack's run as one HTML page and a picture",
    "compare": "two recordings side by side: what differs, and when",
    "bridge": "steady state of an SCR bridge, or a motor's run on it",
    "blocks": "describe the control blocks",
    "security-policy": "SROS 2 policy and keys for a rack",
    "schema": "JSON schema of rack files or stimuli files, for editors",
    "completion": "what makes a shell complete this command line",
    "explain": "say what a problem code means and how to cure it",
}
"""Every subcommand and its line of help; its module is imported only when it is used."""
_FOLDERS = {
    "tasks": (
        "check",
        "trace",
        "compile",
        "diagram",
        "tune-info",
        "response",
        "convert",
        "blocks",
        "explain",
    ),
    "racks": (
        "sweep",
        "load",
        "xref",
        "drive-check",
        "new",
        "import",
        "step",
        "bridge",
        "security-policy",
        "schema",
        "panel",
    ),
    "run": ("run", "node"),
    "recordings": ("record", "replay", "rerun", "play", "bag", "export", "plot", "report", "compare"),
    "operate": ("ctl",),
    "shell": ("completion",),
}
"""The folder of each subcommand's module."""

ROS_ARGUMENTS = "--ros-args"
"""The argument that introduces the ROS arguments of a command line."""
UNTIL_STOPPED = ("run", "node", "record", "play", "panel")
"""The subcommands that run until they are stopped."""
INTERRUPTED = 130
"""Exit code after Ctrl-C: 128 + SIGINT, as in the shell."""
BROKEN_PIPE = 141
"""Exit code when the reader of the output has closed its pipe: 128 + SIGPIPE."""


def entry() -> NoReturn:
    """Run `automax` as the program of this process; once the exit code is final, no signal changes it any more."""
    early.until_work_begins(ends_well=_until_stopped(sys.argv[1:]))
    code = main()
    try:
        early.work_has_ended()
    except KeyboardInterrupt:
        early.work_has_ended()
    sys.exit(code)


def main(argv: Sequence[str] | None = None) -> int:
    """Run `automax` with the arguments (the process's own by default) and return its exit code."""
    words = sys.argv[1:] if argv is None else list(argv)
    try:
        _open_closed_streams()
        _accept_every_character()
        from automax_ros.cli.visible import VisibleOutput

        output = VisibleOutput()
    except KeyboardInterrupt:
        return _interrupt_code(words)
    try:
        code = _run(words)
        sys.stdout.flush()
    except KeyboardInterrupt:
        return _interrupt_code(words)
    except BrokenPipeError:
        _discard_output()
        return BROKEN_PIPE
    except OSError as error:  # a full disk, for example; for a file that was asked for it is a UsageError
        _discard_output()
        what = "the output cannot be written" if error.filename is None else error.filename
        print(f"automax: error: {what}: {error.strerror or error}", file=sys.stderr)
        return 2
    finally:
        if argv is not None:  # else it stays for the process's further output, including a traceback
            output.undo()
    return code


def _run(argv: list[str]) -> int:
    from automax_ros.core.user_error import UserError

    name: str | None = None
    try:
        words, ros = _split(argv)
        name = _name(words)
        if name is not None and name not in SUBCOMMANDS:
            raise _unknown_command(name)
        module = module_of(name) if name is not None else None
        parser, subparsers = parsers({} if module is None else {str(name): module})
        own = subparsers.get(str(name), parser)
        arguments, unknown = parser.parse_known_args(words)
        if unknown:
            own.error(f"unrecognized arguments: {' '.join(unknown)}")
        if module is None:
            parser.print_help(sys.stderr)
            return 2
        _hand_over(ros, arguments)
        early.work_begins()
        return _exit_code(module.run(arguments))
    except UserError as error:
        head = "" if error.place else f"automax{f' {name}' if name in SUBCOMMANDS else ''}: error: "
        print(f"{head}{error}", file=sys.stderr)
        return 2
    except SystemExit as stop:  # argparse's way to end after --help, --version and wrong usage
        return _exit_code(stop.code)


def _name(words: Sequence[str]) -> str | None:
    """Return the subcommand: the options before it take no values, so it is the first word."""
    return next((word for word in words if not word.startswith("-")), None)


def _interrupt_code(words: Sequence[str]) -> int:
    """Return the exit code after a Ctrl-C before the command handles signals itself: the same as in ``early``."""
    return 0 if _until_stopped(words) else INTERRUPTED


def _until_stopped(words: Sequence[str]) -> bool:
    """Whether the command runs until it is stopped; a simulated run without ROS has work to finish."""
    return _name(words) in UNTIL_STOPPED and ("--simulated" not in words or "--ros" in words)


def _split(argv: list[str]) -> tuple[list[str], RosArguments | None]:
    """Return the command line without its ROS arguments, and the ROS arguments, None if there are none."""
    if ROS_ARGUMENTS not in argv:
        return argv, None
    from automax_ros.ros.setup.arguments import split_arguments

    return split_arguments(argv)


def _hand_over(ros: RosArguments | None, arguments: argparse.Namespace) -> None:
    """Pass the ROS arguments to a subcommand.

    A subcommand that creates no nodes refuses them: they would have no effect. Launch files always pass
    ``--ros-args``, which alone is allowed (decision).
    """
    if ros is None:
        return
    if hasattr(arguments, "ros"):
        arguments.ros = ros
    elif ros.given:
        from automax_ros.core.user_error import UsageError

        raise UsageError(f"{ROS_ARGUMENTS}: this subcommand makes no ROS nodes", "leave it out")


def parsers(
    modules: Mapping[str, ModuleType],
) -> tuple[argparse.ArgumentParser, dict[str, argparse.ArgumentParser]]:
    """Return the parser of the whole command line and those of its subcommands; ``modules`` add their arguments."""
    import argparse

    class WideHelp(argparse.HelpFormatter):
        """Leaves room for the longest subcommand: argparse ignores that they are indented twice."""

        def add_argument(self, action: argparse.Action) -> None:
            super().add_argument(action)
            self._action_max_length = max(self._action_max_length, max(map(len, SUBCOMMANDS)) + 4)

    class ShowVersion(argparse.Action):
        """Prints the version and whether compiled modules run; on request only, since it reads all sources."""

        def __call__(self, parser: argparse.ArgumentParser, *_: object) -> None:
            print("\n".join(version_lines()))
            parser.exit()

    parser = argparse.ArgumentParser(
        prog="automax", description="A Reliance Electric AutoMax rack, emulated.", formatter_class=WideHelp
    )
    parser.add_argument("--version", action=ShowVersion, nargs=0, help="show version and whether compiled modules run")
    subcommands = parser.add_subparsers(title="subcommands", metavar="SUBCOMMAND")
    found: dict[str, argparse.ArgumentParser] = {}
    for name, text in SUBCOMMANDS.items():
        own = modules.get(name)
        if modules and own is None:
            continue  # building a parser takes time, and this one will not be used
        found[name] = subcommands.add_parser(
            name,
            help=text,
            description=own.__doc__ if own else None,
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        if own is not None:
            own.add_arguments(found[name])
    return parser, found


def version_lines() -> list[str]:
    """Return the version, and whether modules compiled ahead of time or plain Python modules run."""
    import automax_ros
    from automax_ros.core.compiled import describe

    return [f"automax {automax_ros.__version__}", *describe(automax_ros.__path__[0])]


def module_of(name: str) -> ModuleType:
    """Return the module of a subcommand, which has the functions ``add_arguments`` and ``run``.

    A dash in the subcommand's name is an underscore in the module's; a keyword of Python gets one appended.
    """
    import importlib
    import keyword

    word = f"{name}_" if keyword.iskeyword(name) else name.replace("-", "_")
    folder = next(folder for folder, names in _FOLDERS.items() if name in names)
    return importlib.import_module(f"automax_ros.cli.{folder}.{word}")


def _unknown_command(name: str) -> Exception:
    from automax_ros.core.text import did_you_mean, quoted
    from automax_ros.core.user_error import UsageError

    hint = did_you_mean(name, SUBCOMMANDS) or f"there are {', '.join(SUBCOMMANDS)}"
    return UsageError(f"no subcommand {quoted(name)}", hint)


def _exit_code(code: object) -> int:
    return code if isinstance(code, int) else 0 if code is None else 1


def _open_closed_streams() -> None:
    """Open /dev/null for each standard stream that the caller closed: Python has None there, files take its number."""
    for number, name, mode in ((0, "stdin", "r"), (1, "stdout", "w"), (2, "stderr", "w")):
        if getattr(sys, name) is None:
            nowhere = os.open(os.devnull, os.O_RDWR)
            if nowhere != number:
                os.dup2(nowhere, number)
                os.close(nowhere)
            setattr(sys, name, os.fdopen(number, mode, encoding="utf-8"))


def _accept_every_character() -> None:
    """Escape characters that the terminal's encoding lacks, so that no file name or text stops the program."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


def _discard_output() -> None:
    """Redirect standard output to /dev/null, so that Python's flush at exit does not fail again."""
    try:
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, sys.stdout.fileno())
        os.close(nowhere)
    except (OSError, ValueError):
        pass


if __name__ == "__main__":
    entry()
