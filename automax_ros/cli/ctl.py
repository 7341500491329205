"""Operate a rack that runs, from any process of its ROS 2 domain.

RACK is the rack's name or namespace, or its YAML file or folder. The rack must say `operator: true`; what is asked
happens between two scans and is recorded. Exit code 0: done; 1: the rack refused something; 2: wrong usage, or
no such rack.
"""

from __future__ import annotations

import argparse
import importlib
import json
import sys
from typing import TYPE_CHECKING, Any

from automax_ros.cli.ctl_actions import ACTIONS
from automax_ros.cli.ctl_ask import Action, Ask
from automax_ros.cli.ctl_watch import values_of, watch
from automax_ros.cli.rack_space import space_of
from automax_ros.cli.ros import add_ros_arguments, prepare_ros, ros_arguments
from automax_ros.cli.signals import StopRequest, stop_signals
from automax_ros.cli.usage import UsageError
from automax_ros.cli.window import seconds_above_0

if TYPE_CHECKING:
    from automax_ros.nodes.operating import RackClient

DEFAULT_TIMEOUT_S = "5"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``automax ctl`` and of its actions."""
    parser.add_argument("rack", metavar="RACK", help="the rack's name or namespace, or its YAML file or folder")
    add_ros_arguments(parser)
    actions = parser.add_subparsers(title="actions", metavar="ACTION", dest="action", required=True)
    for name, action in ACTIONS.items():
        own = actions.add_parser(name, help=action.help, description=action.help)
        action.add_arguments(own)
        own.add_argument("--json", action="store_true", help="print the answers for programs to read")
        own.add_argument(
            "--timeout",
            type=seconds_above_0,
            metavar="S",
            default=DEFAULT_TIMEOUT_S,
            help=f"seconds to look for the rack, and to wait for each answer (default: {DEFAULT_TIMEOUT_S})",
        )


def run(arguments: argparse.Namespace) -> int:
    """Ask the rack; 1 where it refused something, 2 where it could not be asked."""
    with stop_signals() as stop:
        domain = prepare_ros(arguments)
        from automax_ros.nodes.operating import Interrupted, NotOperable

        try:
            return _run(arguments, stop)
        except Interrupted:
            return stop.code
        except NotOperable as fault:
            raise UsageError(f"{fault.message} (ROS domain {domain})", fault.hint) from fault


def _run(arguments: argparse.Namespace, stop: StopRequest) -> int:
    from automax_ros.nodes.operating import ALONE_NS, RackClient

    action = ACTIONS[arguments.action]
    ros = ros_arguments(arguments)
    space = space_of(arguments.rack, ros)
    asks = action.asks(arguments)
    with RackClient(space, ros, lambda: stop.requested) as client:
        if action.by_operator:
            client.find(arguments.timeout, 0 if action.read is not None else ALONE_NS)
        if action.repeats:
            return _watched(client, asks[0], arguments, stop)
        answers = [(ask, _answer(client, ask, arguments.timeout)) for ask in asks]
    if arguments.json:
        _print_json(action, arguments.action, answers)
    else:
        _print(action, arguments.action, answers)
    return 0 if all(_ok(answer) for _, answer in answers) else 1


_NOW = ("status", "now", "forced", "powered", "message")
"""Fields in which an answer says what is true now."""


class _Refused(Exception):
    """What was asked for was refused; the text says why."""


def _watched(client: RackClient, ask: Ask, arguments: argparse.Namespace, stop: StopRequest) -> int:
    from automax_ros.nodes.operating import Interrupted

    def read() -> list[dict[str, str]]:
        answer = _answer(client, ask, arguments.timeout)
        if not _ok(answer):
            raise _Refused(_reason(ask, answer))
        return values_of(answer)

    try:
        watch(read, arguments, lambda: stop.requested)
    except Interrupted:
        return 0
    except _Refused as refusal:
        print(f"automax ctl: watch {ask.of}: refused: {refusal}", file=sys.stderr)
        return 1
    return 0


def _answer(client: RackClient, ask: Ask, wait_ns: int) -> Any:
    package, _, name = ask.type_name.partition("/")
    kind = getattr(importlib.import_module(f"{package}.srv"), name)
    return client.call(kind, ask.service, kind.Request(**ask.fields), wait_ns)


def _ok(answer: Any) -> bool:
    """Return whether the rack did what was asked: the readings that cannot be refused do not say."""
    return bool(getattr(answer, "ok", getattr(answer, "success", True)))


def _reason(ask: Ask, answer: Any) -> str:
    return ask.worded(getattr(answer, "reason", getattr(answer, "message", "")))


def _print(action: Action, what: str, answers: list[tuple[Ask, Any]]) -> None:
    for ask, answer in answers:
        for text in getattr(answer, "findings", ()):
            print(ask.worded(text), file=sys.stderr)
        if not _ok(answer):
            print(f"automax ctl: {' '.join((what, ask.of)).strip()}: refused: {_reason(ask, answer)}", file=sys.stderr)
        elif action.read is None:
            done = f"{what} {ask.of}: done" if ask.of else f"{what}: done"
            told = getattr(answer, "message", "")
            print(f"{done}, {told}" if told else done)
        else:
            for line in action.lines(action.read(answer)):
                print(line)


def _print_json(action: Action, what: str, answers: list[tuple[Ask, Any]]) -> None:
    found = []
    for ask, answer in answers:
        ok = _ok(answer)
        entry: dict[str, Any] = {"what": what, "of": ask.of, "ok": ok, "reason": "" if ok else _reason(ask, answer)}
        if ok and action.read is None:
            told = [shown for name in _NOW if (shown := getattr(answer, name, "")) != ""]
            entry |= {"now": told[0]} if told else {}
        if getattr(answer, "findings", ()):
            entry["findings"] = [ask.worded(text) for text in answer.findings]
        if action.read is not None and _ok(answer):
            entry["answer"] = action.read(answer)
        found.append(entry)
    print(json.dumps(found, indent=2))
