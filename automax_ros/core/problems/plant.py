"""Problems of execution times, and of the files of an old plant (6770 to 6799)."""

from __future__ import annotations

from automax_ros.core.problems.problem import Problem, Severity

PROBLEMS: tuple[Problem, ...] = (
    # `automax load`
    Problem("AMX6770", "tasks take more than all of a module's time", Severity.WARNING, hardware="14"),
    Problem("AMX6771", "tasks of a UDC fit in no TICKS", hardware="14"),
    Problem("AMX6773", "PC3000 that is not alone"),
    Problem("AMX6772", "Executive older than the tables of execution times", Severity.WARNING),
)
