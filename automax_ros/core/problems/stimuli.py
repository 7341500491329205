"""Problems of stimuli files (67xx)."""

from __future__ import annotations

from automax_ros.core.problems.problem import Problem, Severity

PROBLEMS: tuple[Problem, ...] = (
    Problem("AMX6730", "stimuli file cannot be read"),
    Problem("AMX6731", "not an entry of a stimuli file"),
    Problem("AMX6732", "unknown verb in a stimuli file"),
    Problem("AMX6733", "verb that a task alone does not have"),
    Problem("AMX6734", "time in a stimuli file"),
    Problem("AMX6735", "name in a stimuli file"),
    Problem("AMX6736", "value in a stimuli file"),
    Problem("AMX6737", "variable that a verb cannot be used on"),
    Problem("AMX6738", "frequency or amplitude in a stimuli file"),
    Problem("AMX6739", "unknown task in a stimuli file"),
    Problem("AMX6740", "source to reload"),
    Problem("AMX6741", "tunable in a stimuli file"),
    Problem("AMX6742", "module or plant without such a control"),
    Problem("AMX6743", "too many entries in a stimuli file"),
    Problem("AMX6744", "stimuli file without entries", Severity.WARNING),
)
