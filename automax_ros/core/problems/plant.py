"""Problems of execution times, and of the files of an old plant (6770 to 6799)."""

from __future__ import annotations

from automax_ros.core.problems.problem import Problem, Severity

PROBLEMS: tuple[Problem, ...] = (
    # `automax load`
    Problem("AMX6770", "tasks take more than all of a module's time", Severity.WARNING, hardware="14"),
    Problem("AMX6771", "tasks of a UDC fit in no TICKS", hardware="14"),
    Problem("AMX6773", "PC3000 that is not alone"),
    Problem("AMX6774", "current minor loop that takes more than half of a sixth of a line cycle", Severity.WARNING),
    Problem("AMX6788", "AC_LINE_FREQ above the frequency of the plant's line", Severity.WARNING),
    Problem("AMX6772", "Executive older than the tables of execution times", Severity.WARNING),
    # `automax import`: configuration tasks
    Problem("AMX6780", "statement that no configuration task has"),
    Problem("AMX6781", "malformed definition of a configuration task"),
    Problem("AMX6782", "key of a definition"),
    Problem("AMX6783", "value of a definition"),
    Problem("AMX6784", "name that the configuration defines twice"),
    Problem("AMX6785", "definition that cannot be an I/O point"),
    Problem("AMX6786", "definition on a module that the emulator does not have", Severity.WARNING),
    Problem("AMX6787", "task that the rack file leaves out", Severity.WARNING),
)
