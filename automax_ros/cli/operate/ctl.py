"""Operate a rack that runs, from any process of its ROS 2 domain.

RACK is the rack's name or namespace, or its YAML file or folder. The rack must say `operator: true`; what is asked
happens between two scans and is recorded. `shell`, or no action on a terminal, is a prompt that stays connected; it
takes the same actions, from a pipe too. Exit code 0: done; 1: the rack refused something; 2: wrong usage, or no such
rack.
"""

from __future__ import annotations

import argparse
import importlib
import json
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from automax_ros.cli.operate.actions import (
    ACTIONS,
    DEFAULT_TIMEOUT_S,
    STATE,
    Action,
    Mode,
    ServiceCall,
    add_actions,
    add_common,
)
from automax_ros.cli.operate.press import press
from automax_ros.cli.operate.text import ALREADY
from automax_ros.cli.operate.watch import values_of, watch
from automax_ros.cli.options.ros import add_ros_arguments, prepare_ros, ros_arguments, space_of
from automax_ros.cli.options.values import seconds_above_0
from automax_ros.cli.output.signals import stop_signals
from automax_ros.core.text import printable
from automax_ros.core.user_error import UsageError

if TYPE_CHECKING:
    from automax_ros.ros.clients.rack_client import RackClient


Answers = list[tuple[ServiceCall, Any]]
_NOW = ("status", "now", "forced", "powered", "message")
"""Fields of an answer that contain the new state."""


class _Refused(Exception):
    """The rack refused a request; the text says why."""


class RackSession:
    """Operates one rack through a client; ``should_stop`` ends waits and repetitions."""

    def __init__(self, client: RackClient, should_stop: Callable[[], bool]) -> None:
        self._client, self._should_stop = client, should_stop

    def do(self, action: Action, arguments: argparse.Namespace) -> int:
        """Carry out an action; 1 where the rack refused something."""
        calls = action.calls(arguments)
        if action.by_operator:
            self._find(arguments.timeout, alone=not action.reads)
        elif arguments.transition != STATE:
            self._client.refuse_twins(arguments.node)
            if self._client.has_operator:
                self._find(arguments.timeout, alone=True)
        if action.mode is Mode.WATCH:
            return self._watch(calls[0], arguments)
        if action.mode is Mode.PRESS:
            answers = press(self._answer, calls, arguments, self._should_stop)
        else:
            answers = [(call, self._answer(call, arguments.timeout)) for call in calls]
        (_print_json if arguments.json else _print)(action, arguments.action, answers)
        return 0 if all(_ok(answer) for _, answer in answers) else 1

    def call(self, call: ServiceCall, wait_ns: int) -> Any:
        """Return the answer to one request that only reads; None where it was refused."""
        self._find(wait_ns, alone=False)
        answer = self._answer(call, wait_ns)
        return answer if _ok(answer) else None

    def _find(self, wait_ns: int, *, alone: bool) -> None:
        """Check that the rack is there and, before it is operated, that it is the only one of its name.

        A rack that has long been in the graph knows more of it than a program that has just started. So the rack is
        asked how many there are, provided that all racks in reach are on this host and thus reach each other, too.
        Else the graph is observed for a while (decision).
        """
        from automax_ros.ros.clients.rack_client import ALONE_NS
        from automax_ros.ros.setup.discovery import is_this_host_alone

        self._client.find(wait_ns)
        if alone:
            known = self._answer(ServiceCall("status", "automax_msgs/ReadStatus", {"home_only": True}), wait_ns).racks
            self._client.refuse_several(known)
            self._client.find(wait_ns, 0 if known == 1 and is_this_host_alone() else ALONE_NS)

    def _answer(self, call: ServiceCall, wait_ns: int) -> Any:
        package, _, name = call.type_name.partition("/")
        kind = getattr(importlib.import_module(f"{package}.srv"), name)
        return self._client.call(kind, call.service, kind.Request(**call.fields), wait_ns)

    def _watch(self, call: ServiceCall, arguments: argparse.Namespace) -> int:
        from automax_ros.ros.clients.rack_client import Interrupted

        def read() -> list[dict[str, str]]:
            answer = self._answer(call, arguments.timeout)
            if not _ok(answer):
                raise _Refused(_reason(call, answer))
            return values_of(answer)

        try:
            watch(read, arguments, self._should_stop)
        except Interrupted:
            return 0
        except _Refused as refusal:
            _complain("watch", call, str(refusal))
            return 1
        return 0


@contextmanager
def connected(arguments: argparse.Namespace, should_stop: Callable[[], bool]) -> Iterator[RackSession]:
    """Join the graph, and yield a session with the rack while the block lasts.

    Raises:
        UsageError: there is no such rack, several have the name, or it cannot be operated.
    """
    domain = prepare_ros(arguments)
    from automax_ros.ros.clients import rack_client as operating

    ros = ros_arguments(arguments)
    try:
        with operating.RackClient(space_of(arguments.rack, ros), ros, should_stop) as client:
            yield RackSession(client, should_stop)
    except operating.NotOperable as fault:
        raise UsageError(f"{fault.message} (ROS domain {domain})", fault.hint) from fault


def _ok(answer: Any) -> bool:
    """Return whether the rack carried out the request; answers to reads that cannot be refused have no such field."""
    return bool(getattr(answer, "ok", getattr(answer, "success", True)))


def _reason(call: ServiceCall, answer: Any) -> str:
    return call.reword(getattr(answer, "reason", getattr(answer, "message", "")))


def _complain(what: str, call: ServiceCall, reason: str) -> None:
    print(f"automax ctl: {printable(' '.join((what, call.of)).strip())}: refused: {printable(reason)}", file=sys.stderr)


def _print(action: Action, what: str, answers: Answers) -> None:
    for call, answer in answers:
        for text in getattr(answer, "findings", ()):
            print(call.reword(text), file=sys.stderr)
        if not _ok(answer):
            _complain(what, call, _reason(call, answer))
        elif action.read is None:
            done_text = action.done_text(call, answer) or "done"
            print(printable(f"{what} {call.of}: {done_text}" if call.of else f"{what}: {done_text}"))
        else:
            for line in action.lines(action.read(answer)):
                print(printable(line))


def _print_json(action: Action, what: str, answers: Answers) -> None:
    found = []
    for call, answer in answers:
        ok = _ok(answer)
        entry: dict[str, Any] = {"what": what, "of": call.of, "ok": ok, "reason": "" if ok else _reason(call, answer)}
        if ok and action.read is None:
            now = [shown for name in _NOW if (shown := getattr(answer, name, "")) != ""]
            entry |= {"now": now[0]} if now else {}
            entry |= {"already": True} if action.done_text(call, answer).startswith(ALREADY) else {}
            entry |= {"lost": text} if (text := getattr(answer, "lost", "")) else {}
        if getattr(answer, "findings", ()):
            entry["findings"] = [call.reword(text) for text in answer.findings]
        if action.read is not None and ok:
            entry["answer"] = action.read(answer)
        found.append(entry)
    print(json.dumps(found, indent=2))


SHELL = "shell"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``automax ctl`` and of its actions."""
    parser.add_argument("rack", metavar="RACK", help="the rack's name or namespace, or its YAML file or folder")
    add_ros_arguments(parser)
    actions = add_actions(parser, required=not sys.stdin.isatty())
    shell = actions.add_parser(SHELL, help="a prompt that stays connected; commands from a pipe, too")
    add_common(shell)
    parser.set_defaults(action=SHELL, json=False)
    parser.set_defaults(timeout=seconds_above_0(DEFAULT_TIMEOUT_S))


def run(arguments: argparse.Namespace) -> int:
    """Send the requests to the rack; 1 where it refused something, 2 where it could not be reached."""
    if arguments.action == SHELL:
        from automax_ros.cli.operate.prompt import run_shell

        return run_shell(arguments, connected)
    with stop_signals() as stop, connected(arguments, lambda: stop.requested) as session:
        from automax_ros.ros.clients.rack_client import Interrupted

        try:
            return session.do(ACTIONS[arguments.action], arguments)
        except Interrupted:
            return stop.code
