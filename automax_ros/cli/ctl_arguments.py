"""The actions of `automax ctl` as arguments: of its command line, and of each line of its prompt."""

from __future__ import annotations

import argparse
from collections.abc import Callable

from automax_ros.cli.ctl_actions import ACTIONS
from automax_ros.cli.window import seconds_above_0

DEFAULT_TIMEOUT_S = "5"


class ActionParser(argparse.ArgumentParser):
    """The parser of one action; what stands below its help is made when it is asked for."""

    more: Callable[[], str] = str

    def format_help(self) -> str:
        """Return the help with what stands below it."""
        below = self.more()
        return super().format_help() + (f"\n{below}\n" if below else "")


def add_actions(parser: argparse.ArgumentParser, *, required: bool = True) -> argparse._SubParsersAction[ActionParser]:
    """Add all actions with their arguments."""
    actions = parser.add_subparsers(
        title="actions", metavar="ACTION", dest="action", required=required, parser_class=ActionParser
    )
    for name, action in ACTIONS.items():
        own = actions.add_parser(name, help=action.help, description=action.help)
        own.more = action.more
        action.add_arguments(own)
        add_common(own)
    return actions


def add_common(parser: argparse.ArgumentParser) -> None:
    """Add what all actions take."""
    parser.add_argument("--json", action="store_true", help="print the answers for programs to read")
    parser.add_argument(
        "--timeout",
        type=seconds_above_0,
        metavar="S",
        default=DEFAULT_TIMEOUT_S,
        help=f"seconds to look for the rack, and to wait for each answer (default: {DEFAULT_TIMEOUT_S})",
    )
