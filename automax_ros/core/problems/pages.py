"""The pages of problems as text: what ``automax explain`` prints, and the panel shows."""

from __future__ import annotations

import re
from collections.abc import Callable
from importlib import resources

from automax_ros.core.problems import PROBLEMS, Problem

CODE = re.compile(r"(?:AMX)?([0-9]{4})")
"""A problem's code, or just its number."""


def problems_called(text: str) -> list[Problem]:
    """Return the problem with a code such as AMX4001 or 4001, or those with a hardware's code such as E0, in any case.

    An empty list if there is no such code.
    """
    asked = text.strip().upper()
    match = CODE.fullmatch(asked)
    problem = PROBLEMS.get(f"AMX{match[1]}") if match else None
    if problem is not None:
        return [problem]
    return [item for item in PROBLEMS.values() if item.hardware and item.hardware.upper() == asked]


def page_text(problem: Problem, heading: Callable[[str], str] = str) -> str:
    """Return the page of a problem as plain text, examples indented; ``heading`` makes a heading of a line."""
    page = resources.files("automax_ros.core").joinpath("pages").joinpath(f"{problem.code}.md")
    lines: list[str] = []
    fenced = False
    for line in page.read_text(encoding="utf-8").splitlines():
        if line.startswith("```"):
            fenced = not fenced
        elif fenced:
            lines.append(f"    {line}".rstrip())
        elif line.startswith("#"):
            severity = f" ({problem.severity.value})" if not lines else ""
            lines.append(heading(line.lstrip("#").strip() + severity))
        else:
            lines.append(line)
    return "\n".join(lines) + "\n"
