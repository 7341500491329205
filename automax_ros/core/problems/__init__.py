"""The table of problems: every code that a check, a rack or a running task can report.

Codes are ours, ``AMXnnnn``, in bands: 0 lexing and syntax, 2 types, 4 meaning of declarations, statements and blocks, 6
files, racks and bags, 7 run time. If the hardware's own code is known it is given too. Each code has a page in
``core/pages``, which ``automax explain`` prints.
"""

from __future__ import annotations

from automax_ros.core.problems import language, racks
from automax_ros.core.problems.problem import Problem, Severity

__all__ = ["PROBLEMS", "Problem", "Severity"]


def _table() -> dict[str, Problem]:
    table: dict[str, Problem] = {}
    for band in (language, racks):
        for problem in band.PROBLEMS:
            if problem.code in table:
                raise ValueError(f"problem code {problem.code} is defined twice")
            table[problem.code] = problem
    return dict(sorted(table.items()))


PROBLEMS: dict[str, Problem] = _table()
"""Every problem by its code, in ascending order."""
