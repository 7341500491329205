"""Say what a problem code means, with an example and the cure; without a code list them all.

CODE is a code such as AMX4001 or just its number, or a code that the hardware shows, such as 14 or E0.
"""

from __future__ import annotations

import argparse
import re
import sys
from importlib import resources

from automax_ros.cli.output.screen import painted, wants_colour
from automax_ros.cli.visible import write_control
from automax_ros.core.problems import PROBLEMS, Problem
from automax_ros.core.text import quoted
from automax_ros.core.user_error import UsageError

_CODE = re.compile(r"(?:AMX)?([0-9]{4})")
_NEAR = 3
"""Number of codes suggested for an unknown one."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``automax explain``."""
    parser.add_argument("code", nargs="?", metavar="CODE", help="such as AMX4001, 4001, or the hardware's E0")


def run(arguments: argparse.Namespace) -> int:
    """Print a page, or the list of all codes."""
    found = list(PROBLEMS.values()) if arguments.code is None else _problems(arguments.code)
    if len(found) == 1:
        write_control(sys.stdout, _page(found[0], colour=wants_colour(sys.stdout)))
    else:
        sys.stdout.write("".join(f"{_line(problem)}\n" for problem in found))
    return 0


def _problems(text: str) -> list[Problem]:
    asked = text.strip().upper()
    match = _CODE.fullmatch(asked)
    problem = PROBLEMS.get(f"AMX{match[1]}") if match else None
    if problem is not None:
        return [problem]
    hardware = [item for item in PROBLEMS.values() if item.hardware and item.hardware.upper() == asked]
    if hardware:
        return hardware
    raise UsageError(f"no problem code {quoted(text)}", _near(asked, int(match[1]) if match else None))


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


def _page(problem: Problem, *, colour: bool) -> str:
    text = (
        resources.files("automax_ros.core").joinpath("pages").joinpath(f"{problem.code}.md").read_text(encoding="utf-8")
    )
    lines: list[str] = []
    fenced = False
    for line in text.splitlines():
        if line.startswith("```"):
            fenced = not fenced
        elif fenced:
            lines.append(f"    {line}".rstrip())
        elif line.startswith("#"):
            heading = line.lstrip("#").strip()
            heading += f" ({problem.severity.value})" if not lines else ""
            lines.append(painted(heading, "1") if colour else heading)
        else:
            lines.append(line)
    return "\n".join(lines) + "\n"
