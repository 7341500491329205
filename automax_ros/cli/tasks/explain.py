"""Say what a problem code means, with an example and the cure; without a code list them all.

CODE is a code such as AMX4001 or just its number, or a code that the hardware shows, such as 14 or E0.
"""

from __future__ import annotations

import argparse
import sys

from automax_ros.cli.output.screen import painted, wants_colour
from automax_ros.cli.visible import write_control
from automax_ros.core.problems import PROBLEMS, Problem
from automax_ros.core.problems.pages import CODE, page_text, problems_called
from automax_ros.core.text import quoted
from automax_ros.core.user_error import UsageError

_NEAR = 3
"""Number of codes suggested for an unknown one."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``automax explain``."""
    parser.add_argument("code", nargs="?", metavar="CODE", help="such as AMX4001, 4001, or the hardware's E0")


def run(arguments: argparse.Namespace) -> int:
    """Print a page, or the list of all codes."""
    found = list(PROBLEMS.values()) if arguments.code is None else _problems(arguments.code)
    if len(found) == 1:
        colour = wants_colour(sys.stdout)
        write_control(sys.stdout, page_text(found[0], lambda text: painted(text, "1") if colour else text))
    else:
        sys.stdout.write("".join(f"{_line(problem)}\n" for problem in found))
    return 0


def _problems(text: str) -> list[Problem]:
    found = problems_called(text)
    if not found:
        asked = text.strip().upper()
        match = CODE.fullmatch(asked)
        raise UsageError(f"no problem code {quoted(text)}", _near(asked, int(match[1]) if match else None))
    return found


def _near(asked: str, number: int | None) -> str:
    if number is not None:
        nearest = sorted(PROBLEMS.values(), key=lambda item: (abs(item.number - number), item.number))[:_NEAR]
    else:
        nearest = [item for item in PROBLEMS.values() if len(asked) > 1 and asked in item.title.upper()][:_NEAR]
    if not nearest:
        return "`automax explain` lists them all"
    return "; ".join(f"{item.code} is: {item.title}" for item in sorted(nearest, key=lambda item: item.number))


def _line(problem: Problem) -> str:
    hardware = f" (code {problem.hardware} on the rack)" if problem.hardware else ""
    return f"{problem.code}  {problem.severity.value:7}  {problem.title}{hardware}"
