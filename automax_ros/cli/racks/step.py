"""Step a rack in simulated time: a tick, a scan, a BASIC line at a time, with breakpoints.

Commands are typed with line editing, history and completion (Tab), or come from a script through standard input, one
per line; `help` lists them. A script goes on after a command that fails, and the exit code is 1 then. Ctrl-C halts a
rack that goes on; Ctrl-D or `quit` leaves.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import replace
from pathlib import Path

from automax_ros.cli.options.rack import add_outside_argument, add_set_argument, config_of, print_refused, settings_of
from automax_ros.cli.options.stimuli import StimuliRefused, stimulation
from automax_ros.cli.racks.step_session import Session, completions, execute, place_text
from automax_ros.cli.shell.prompt import Interrupt, edit_lines, typed_lines
from automax_ros.core.text import printable
from automax_ros.core.user_error import UserError
from automax_ros.rack.base.stop_cause import OperationRefused
from automax_ros.rack.tasks.installation import RackError
from automax_ros.rackfile.model.config import Timing
from automax_ros.scenario.stepper import Stepper

PROMPT = "step> "


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``automax step``."""
    parser.add_argument("config", type=Path, metavar="CONFIG", help="the rack's YAML file")
    add_set_argument(parser)
    parser.add_argument("--stimuli", type=Path, metavar="FILE", help="play this stimuli file, by rack time")
    parser.add_argument(
        "--ideal",
        action="store_true",
        help="let scans take no time, so that they can be held at lines, whatever CONFIG says",
    )
    add_outside_argument(parser)


def run(arguments: argparse.Namespace) -> int:
    """Step the rack; 0 unless it has errors or a command failed."""
    config = config_of(arguments.config, allow_outside=arguments.allow_outside)
    if config is None:
        return 1
    if arguments.ideal:
        config = replace(config, execution=Timing.IDEAL)
    settings = settings_of(config, arguments.settings)
    interrupt = Interrupt()
    try:
        stepper = Stepper(config, interrupted=interrupt.taken)
        happening = stimulation(stepper.rack, arguments.stimuli, allow_outside=arguments.allow_outside)
    except RackError as error:
        return print_refused("step", error)
    except StimuliRefused:
        return 1
    stepper.start(settings, happening.begin)
    session = Session(stepper, _print_line)
    with interrupt.watching():
        failed = _obey_all(session, interrupt)
    return 1 if failed or happening.refused else 0


def _obey_all(session: Session, interrupt: Interrupt) -> bool:
    """Carry out commands until their end; return whether one of a script failed."""
    interactive = sys.stdin.isatty()
    if interactive:
        edit_lines(lambda text: completions(session, text))
        _print_line("help lists the commands, quit leaves")
    _print_line(place_text(session.stepper.rack, *session.stepper.place))
    failed = False
    for line in typed_lines(PROMPT, interrupt) if interactive else sys.stdin:
        failed |= not _execute_line(session, line)
        if session.over:
            break
    return failed and not interactive


def _execute_line(session: Session, line: str) -> bool:
    try:
        execute(session, line)
    except UserError as fault:
        sys.stdout.flush()
        print(f"automax step: {fault}", file=sys.stderr)
        return False
    except OperationRefused as refused:
        sys.stdout.flush()
        print(f"automax step: refused: {refused}", file=sys.stderr)
        return False
    return True


def _print_line(line: str) -> None:
    print(printable(line), flush=True)
