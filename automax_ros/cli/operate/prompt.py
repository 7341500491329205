"""The prompt of `automax ctl RACK shell`: the actions of `automax ctl`, without looking for the rack each time."""

from __future__ import annotations

import argparse
import shlex
import sys
from collections.abc import Callable, Iterable
from contextlib import AbstractContextManager
from typing import TYPE_CHECKING

from automax_ros.cli.operate.actions import ACTIONS, ServiceCall, add_actions
from automax_ros.cli.shell.prompt import PromptInterrupt, edit_lines, typed_lines
from automax_ros.core.ticks import NS_PER_S
from automax_ros.core.user_error import UserError

_QUIT = ("quit", "exit")
_HELP = "help"


_STATUS = ServiceCall("status", "automax_msgs/ReadStatus", {"home_only": True})

if TYPE_CHECKING:
    from automax_ros.cli.operate.ctl import RackSession

    Connected = Callable[[argparse.Namespace, Callable[[], bool]], AbstractContextManager[RackSession]]


def run_shell(arguments: argparse.Namespace, connected: Connected) -> int:
    """Carry out lines of standard input until its end or ``quit``; 1 where a line of a script failed.

    ``connected`` opens the session with the rack.

    Raises:
        UsageError: there is no such rack, several have the name, or it cannot be operated.
    """
    interrupt = PromptInterrupt()
    with interrupt.watching(), connected(arguments, interrupt.taken) as session:
        shell = _Shell(session, arguments)
        session.call(_STATUS, arguments.timeout)
        interactive = sys.stdin.isatty()
        if interactive:
            edit_lines(shell.completions)
            print("help lists the actions, Ctrl-D leaves", flush=True)
        lines: Iterable[str] = typed_lines(f"{arguments.rack}> ", interrupt) if interactive else sys.stdin
        failed = shell.execute_all(lines)
    return int(failed and not interactive)


class _Shell:
    """Carries out lines; errors are printed and do not end it."""

    def __init__(self, session: RackSession, arguments: argparse.Namespace) -> None:
        self._session, self._given = session, arguments
        self._names: list[str] | None = None
        self._parser = argparse.ArgumentParser(prog="automax ctl", usage="ACTION ...", add_help=False)
        add_actions(self._parser, timeout_s=f"{arguments.timeout / NS_PER_S:g}")

    def execute_all(self, lines: Iterable[str]) -> bool:
        """Carry out lines until their end or quit; return whether one failed."""
        failed = False
        for line in lines:
            words = self._words(line)
            if words and words[0] in _QUIT:
                break
            failed |= words is None or (bool(words) and self._execute(words) != 0)
            sys.stdout.flush()
        return failed

    def completions(self, text: str) -> list[str]:
        """Return the actions, commons and tasks that begin with a text; without a match, upper and lower case alike."""
        if self._names is None:
            self._names = self._known_names()
        words = [*ACTIONS, _HELP, _QUIT[0], *self._names]
        exact = [word for word in words if word.startswith(text)]
        return exact or [word for word in words if word.lower().startswith(text.lower())]

    def _words(self, line: str) -> list[str] | None:
        try:
            return shlex.split(line, comments=True)
        except ValueError as error:
            print(f"automax ctl: {error}: quote a name with a blank or a * in it", file=sys.stderr)
            return None

    def _execute(self, words: list[str]) -> int:
        from automax_ros.ros.clients.rack_client import Interrupted

        try:
            if words[0] == _HELP:
                self._help(words[1:])
                return 0
            arguments = self._parser.parse_args(words)
            return self._session.do(ACTIONS[arguments.action], arguments)
        except SystemExit as stop:  # argparse has printed an error or its help
            return int(bool(stop.code))
        except Interrupted:
            return 1
        except UserError as fault:
            print(f"automax ctl: {fault}", file=sys.stderr)
            return 2

    def _help(self, words: list[str]) -> None:
        if words:
            self._parser.parse_args([words[0], "--help"])
        for name, action in ACTIONS.items():
            print(f"  {name:10} {action.help}")
        print("  quit       leave; so does Ctrl-D. ACTION --help says what one takes")

    def _known_names(self) -> list[str]:
        """Return the names of commons and tasks, as far as the rack answers."""
        wait_ns = self._given.timeout
        calls = [
            ServiceCall("get", "automax_msgs/ReadValues", {"names": ["*"]}),
            ServiceCall("tasks", "automax_msgs/ReadTasks"),
        ]
        try:
            commons, tasks = (self._session.call(call, wait_ns) for call in calls)
        except UserError:
            return []
        found = list(commons.found) if commons is not None else []
        return [*found, *(item.task for item in tasks.tasks)] if tasks is not None else found
