"""Operate a rack that runs, from any process of its ROS 2 domain.

RACK is the rack's name or namespace, or its YAML file or folder. The rack must say `operator: true`; what is asked
happens between two scans and is recorded. `shell`, or no action on a terminal, is a prompt that stays connected; it
takes the same actions, from a pipe too. Exit code 0: done; 1: the rack refused something; 2: wrong usage, or no such
rack.
"""

from __future__ import annotations

import argparse
import sys

from automax_ros.cli.operate.actions import ACTIONS, DEFAULT_TIMEOUT_S, add_actions, add_common
from automax_ros.cli.operate.session import connected
from automax_ros.cli.options.ros import add_ros_arguments
from automax_ros.cli.options.values import seconds_above_0
from automax_ros.cli.output.signals import stop_signals

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

        return run_shell(arguments)
    with stop_signals() as stop, connected(arguments, lambda: stop.requested) as session:
        from automax_ros.ros.clients.rack_client import Interrupted

        try:
            return session.do(ACTIONS[arguments.action], arguments)
        except Interrupted:
            return stop.code
