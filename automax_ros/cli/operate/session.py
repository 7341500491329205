"""What `automax ctl` does with one rack: asks, and prints the answers; one action or, at the prompt, many."""

from __future__ import annotations

import argparse
import importlib
import json
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from automax_ros.cli.operate.actions import STATE
from automax_ros.cli.operate.press import press
from automax_ros.cli.operate.requests import Action, Means, ServiceCall
from automax_ros.cli.operate.text import ALREADY
from automax_ros.cli.operate.watch import values_of, watch
from automax_ros.cli.options.rack_name import space_of
from automax_ros.cli.options.ros import prepare_ros, ros_arguments
from automax_ros.cli.usage import UsageError
from automax_ros.core.text import printable

if TYPE_CHECKING:
    from automax_ros.ros.clients.rack_client import RackClient

Answers = list[tuple[ServiceCall, Any]]
_NOW = ("status", "now", "forced", "powered", "message")
"""Fields in which an answer says what is true now."""


class _Refused(Exception):
    """What was asked for was refused; the text says why."""


class Session:
    """Speaks with one rack by a client; ``should_stop`` ends what waits or repeats."""

    def __init__(self, client: RackClient, should_stop: Callable[[], bool]) -> None:
        self._client, self._should_stop = client, should_stop

    def do(self, action: Action, arguments: argparse.Namespace) -> int:
        """Carry out an action; 1 where the rack refused something."""
        asks = action.asks(arguments)
        if action.by_operator:
            self._find(arguments.timeout, alone=not action.reads)
        elif arguments.transition != STATE:
            self._client.refuse_twins(arguments.node)
        if action.means is Means.WATCH:
            return self._watch(asks[0], arguments)
        if action.means is Means.PRESS:
            answers = press(self._answer, asks, arguments, self._should_stop)
        else:
            answers = [(ask, self._answer(ask, arguments.timeout)) for ask in asks]
        (_print_json if arguments.json else _print)(action, arguments.action, answers)
        return 0 if all(_ok(answer) for _, answer in answers) else 1

    def ask(self, ask: ServiceCall, wait_ns: int) -> Any:
        """Return the answer to one request of a rack that only reads; None where it was refused."""
        self._find(wait_ns, alone=False)
        answer = self._answer(ask, wait_ns)
        return answer if _ok(answer) else None

    def _find(self, wait_ns: int, *, alone: bool) -> None:
        """See that the rack is there and, before something is done to it, that it is the only one of its name.

        A rack that has looked around for long knows better than a program that has just come: it is asked, where all
        racks that this program reaches are on this host and so reach each other, too. Else the graph is looked at for
        a while (decision).
        """
        from automax_ros.ros.clients.rack_client import ALONE_NS
        from automax_ros.ros.setup.discovery import is_this_host_alone

        self._client.find(wait_ns)
        if alone:
            known = self._answer(ServiceCall("status", "automax_msgs/ReadStatus", {"home_only": True}), wait_ns).racks
            self._client.refuse_several(known)
            self._client.find(wait_ns, 0 if known == 1 and is_this_host_alone() else ALONE_NS)

    def _answer(self, ask: ServiceCall, wait_ns: int) -> Any:
        package, _, name = ask.type_name.partition("/")
        kind = getattr(importlib.import_module(f"{package}.srv"), name)
        return self._client.call(kind, ask.service, kind.Request(**ask.fields), wait_ns)

    def _watch(self, ask: ServiceCall, arguments: argparse.Namespace) -> int:
        from automax_ros.ros.clients.rack_client import Interrupted

        def read() -> list[dict[str, str]]:
            answer = self._answer(ask, arguments.timeout)
            if not _ok(answer):
                raise _Refused(_reason(ask, answer))
            return values_of(answer)

        try:
            watch(read, arguments, self._should_stop)
        except Interrupted:
            return 0
        except _Refused as refusal:
            _complain("watch", ask, str(refusal))
            return 1
        return 0


@contextmanager
def connected(arguments: argparse.Namespace, should_stop: Callable[[], bool]) -> Iterator[Session]:
    """Join the graph, and speak with the rack while the block lasts.

    Raises:
        UsageError: there is no such rack, several have the name, or it cannot be operated.
    """
    domain = prepare_ros(arguments)
    from automax_ros.ros.clients import rack_client as operating

    ros = ros_arguments(arguments)
    try:
        with operating.RackClient(space_of(arguments.rack, ros), ros, should_stop) as client:
            yield Session(client, should_stop)
    except operating.NotOperable as fault:
        raise UsageError(f"{fault.message} (ROS domain {domain})", fault.hint) from fault


def _ok(answer: Any) -> bool:
    """Return whether the rack did what was asked: the readings that cannot be refused do not say."""
    return bool(getattr(answer, "ok", getattr(answer, "success", True)))


def _reason(ask: ServiceCall, answer: Any) -> str:
    return ask.reword(getattr(answer, "reason", getattr(answer, "message", "")))


def _complain(what: str, ask: ServiceCall, reason: str) -> None:
    print(f"automax ctl: {printable(' '.join((what, ask.of)).strip())}: refused: {printable(reason)}", file=sys.stderr)


def _print(action: Action, what: str, answers: Answers) -> None:
    for ask, answer in answers:
        for text in getattr(answer, "findings", ()):
            print(ask.reword(text), file=sys.stderr)
        if not _ok(answer):
            _complain(what, ask, _reason(ask, answer))
        elif action.read is None:
            told = action.told(ask, answer) or "done"
            print(printable(f"{what} {ask.of}: {told}" if ask.of else f"{what}: {told}"))
        else:
            for line in action.lines(action.read(answer)):
                print(printable(line))


def _print_json(action: Action, what: str, answers: Answers) -> None:
    found = []
    for ask, answer in answers:
        ok = _ok(answer)
        entry: dict[str, Any] = {"what": what, "of": ask.of, "ok": ok, "reason": "" if ok else _reason(ask, answer)}
        if ok and action.read is None:
            told = [shown for name in _NOW if (shown := getattr(answer, name, "")) != ""]
            entry |= {"now": told[0]} if told else {}
            entry |= {"already": True} if action.told(ask, answer).startswith(ALREADY) else {}
            entry |= {"lost": text} if (text := getattr(answer, "lost", "")) else {}
        if getattr(answer, "findings", ()):
            entry["findings"] = [ask.reword(text) for text in answer.findings]
        if action.read is not None and ok:
            entry["answer"] = action.read(answer)
        found.append(entry)
    print(json.dumps(found, indent=2))
