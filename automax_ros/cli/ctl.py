"""Operate a rack that runs, from any process of its ROS 2 domain.

RACK is the rack's name or namespace, or its YAML file or folder. The rack must say `operator: true`; what is asked
happens between two scans and is recorded. `shell`, or no action on a terminal, is a prompt that stays connected; it
takes the same actions, from a pipe too. Exit code 0: done; 1: the rack refused something; 2: wrong usage, or no such
rack.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from automax_ros.cli.ctl_actions import ACTIONS
from automax_ros.cli.ctl_session import Session
from automax_ros.cli.rack_space import space_of
from automax_ros.cli.ros import add_ros_arguments, prepare_ros, ros_arguments
from automax_ros.cli.signals import stop_signals
from automax_ros.cli.usage import UsageError
from automax_ros.cli.window import seconds_above_0

DEFAULT_TIMEOUT_S = "5"
SHELL = "shell"


class ActionParser(argparse.ArgumentParser):
    """The parser of one action; what stands below its help is made when it is asked for."""

    more: Callable[[], str] = str

    def format_help(self) -> str:
        """Return the help with what stands below it."""
        below = self.more()
        return super().format_help() + (f"\n{below}\n" if below else "")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``automax ctl`` and of its actions."""
    parser.add_argument("rack", metavar="RACK", help="the rack's name or namespace, or its YAML file or folder")
    add_ros_arguments(parser)
    actions = add_actions(parser, required=not sys.stdin.isatty())
    shell = actions.add_parser(SHELL, help="a prompt that stays connected; commands from a pipe, too")
    _add_common(shell)
    parser.set_defaults(action=SHELL, json=False)
    parser.set_defaults(timeout=seconds_above_0(DEFAULT_TIMEOUT_S))


def add_actions(parser: argparse.ArgumentParser, *, required: bool = True) -> argparse._SubParsersAction[ActionParser]:
    """Add all actions with their arguments."""
    actions = parser.add_subparsers(
        title="actions", metavar="ACTION", dest="action", required=required, parser_class=ActionParser
    )
    for name, action in ACTIONS.items():
        own = actions.add_parser(name, help=action.help, description=action.help)
        own.more = action.more
        action.add_arguments(own)
        _add_common(own)
    return actions


def _add_common(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--json", action="store_true", help="print the answers for programs to read")
    parser.add_argument(
        "--timeout",
        type=seconds_above_0,
        metavar="S",
        default=DEFAULT_TIMEOUT_S,
        help=f"seconds to look for the rack, and to wait for each answer (default: {DEFAULT_TIMEOUT_S})",
    )


def run(arguments: argparse.Namespace) -> int:
    """Ask the rack; 1 where it refused something, 2 where it could not be asked."""
    if arguments.action == SHELL:
        from automax_ros.cli.ctl_shell import run_shell

        return run_shell(arguments)
    with stop_signals() as stop, connected(arguments, lambda: stop.requested) as session:
        from automax_ros.nodes.operating import Interrupted

        try:
            return session.do(ACTIONS[arguments.action], arguments)
        except Interrupted:
            return stop.code


@contextmanager
def connected(arguments: argparse.Namespace, should_stop: Callable[[], bool]) -> Iterator[Session]:
    """Join the graph, and speak with the rack while the block lasts.

    Raises:
        UsageError: there is no such rack, several have the name, or it cannot be operated.
    """
    domain = prepare_ros(arguments)
    from automax_ros.nodes import operating

    ros = ros_arguments(arguments)
    try:
        with operating.RackClient(space_of(arguments.rack, ros), ros, should_stop) as client:
            yield Session(client, should_stop)
    except operating.NotOperable as fault:
        raise UsageError(f"{fault.message} (ROS domain {domain})", fault.hint) from fault
