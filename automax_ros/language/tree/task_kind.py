"""The kinds of tasks, and the only place that derives them from a file's name (J-3675 p. 3-1)."""

from __future__ import annotations

import enum
from pathlib import PurePath


class TaskKind(enum.Enum):
    """A kind of task that the emulator runs; the value is the suffix of its source files."""

    CONTROL_BLOCK = ".BLK"
    BASIC = ".BAS"


LADDER_SUFFIX = ".PC"
"""The suffix of ladder tasks, which are not run."""
_REFUSED = {
    LADDER_SUFFIX: "a ladder task (.PC) is not run: write it as a control-block task (.BLK) or a BASIC task (.BAS)",
    ".CNF": "a configuration task (.CNF) is not run: the rack's YAML file stands in its place",
    ".INC": "an include file (.INC) is not a task: write its statements into the task",
}
TASK_SUFFIXES = tuple(kind.value for kind in TaskKind)


class NotATask(ValueError):
    """A file is not the source of a task that can run; the text says why."""


def kind_of_file(name: str | PurePath) -> TaskKind:
    """Return the kind of task of a file, by its suffix in either case.

    Raises:
        NotATask: the file is not a task, or of a kind that is not run.
    """
    suffix = PurePath(name).suffix.upper()
    if suffix in TASK_SUFFIXES:
        return TaskKind(suffix)
    raise NotATask(_REFUSED.get(suffix, "a task's source is a .BLK or .BAS file"))


def kind_of_source(name: str) -> TaskKind:
    """Return the kind of task of a text, by its name; any name but a BASIC task's means control blocks."""
    return TaskKind.BASIC if PurePath(name).suffix.upper() == TaskKind.BASIC.value else TaskKind.CONTROL_BLOCK


def is_task_file(name: str | PurePath) -> bool:
    """Return whether a file has the name of a task that can run."""
    return PurePath(name).suffix.upper() in TASK_SUFFIXES
