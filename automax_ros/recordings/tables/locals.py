"""Locals and block states of tasks as columns: names such as ``SPEED.RATIO%``, from the recorded TaskStates."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from pathlib import Path

from automax_ros.core.text import near_or_listed
from automax_ros.core.types import DataType, type_of_name
from automax_ros.messages.types.messages import TaskState
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.recordings.read.common_log import Watched

NOT_COMMON = -1
"""``Watched.variable`` of a column that is not a common variable."""
_NAME = re.compile(r"(?P<task>[A-Z][A-Z0-9_]{0,63})\.(?P<field>[^()\[\]]{1,80}?) ?(?:[(\[](?P<index>\d{1,9})[)\]])?")
_HINT = "write TASK.NAME, such as SPEED.RATIO%, or TASK.NAME(3) for an element"


def is_local(name: str) -> bool:
    """Whether a requested name is that of a task's local: names of commons have no period."""
    return "." in name


class WatchedLocals:
    """The watched locals. Their names determine their types, the first TaskState their places.

    Raises:
        BagError: a name is not that of a local, or that of a text.
    """

    def __init__(self, bag: Path) -> None:
        self._bag = bag
        self._columns: dict[str, Watched] = {}
        self._asked: dict[str, list[tuple[int, str, int]]] = {}
        self._places: dict[str, tuple[str, list[tuple[int, int]]]] = {}

    def __bool__(self) -> bool:
        return bool(self._asked)

    def add(self, column: int, asked: str) -> Watched:
        """Watch a local, in the column of this index unless it has one already; return its description."""
        match = _NAME.fullmatch(" ".join(asked.upper().split()))
        if match is None:
            raise BagError("AMX6821", self._bag, f"{asked[:80]!r} is not a name of a local", _HINT)
        task, field, index = match["task"], match["field"], int(match["index"] or 0)
        kind = type_of_name(field)
        if kind is DataType.STRING:
            raise BagError("AMX6828", self._bag, f"{task}.{field} holds texts, and states are numbers", "leave it out")
        label = f"{task}.{field}({index})" if match["index"] else f"{task}.{field}"
        if label not in self._columns:
            self._columns[label] = Watched(label, NOT_COMMON, column, kind)
            self._asked.setdefault(task, []).append((column, field, index))
        return self._columns[label]

    def values(self, state: TaskState) -> Iterator[tuple[int, float]]:
        """Yield column and value of each watched local in a state.

        Raises:
            BagError: the task has no such local, or the state is inconsistent.
        """
        asked = self._asked.get(state.task)
        if asked is None:
            return
        known = self._places.get(state.task)
        if known is None or known[0] != state.layout_hash:
            known = self._places[state.task] = (state.layout_hash, self._found(state, asked))
        for column, place in known[1]:
            if place >= len(state.value):
                raise BagError("AMX6813", self._bag, f"a state of {state.task} lacks values")
            yield column, state.value[place]

    def require_all(self) -> None:
        """Check that the recording contained states of all requested tasks.

        Raises:
            BagError: it contained none of a task.
        """
        missing = [task for task in self._asked if task not in self._places]
        if missing:
            hint = f"it holds those of {', '.join(list(self._places)[:8])}" if self._places else ""
            raise BagError("AMX6827", self._bag, f"holds no states of a task {missing[0][:40]!r}", hint)

    def _found(self, state: TaskState, asked: Sequence[tuple[int, str, int]]) -> list[tuple[int, int]]:
        """Return the column and the place in a state's values of each requested field."""
        fields: dict[str, tuple[int, int]] = {}
        place = 0
        for name, size in zip(state.field, state.size, strict=False):
            fields[name.upper()] = place, size
            place += size
        found = []
        for column, field, index in asked:
            if field not in fields:
                text = f"task {state.task} has no local {field[:80]!r}"
                raise BagError("AMX6821", self._bag, text, near_or_listed(field, fields, f"{state.task}."))
            start, size = fields[field]
            if index >= size:
                text = f"element {index} of {state.task}.{field[:80]} is out of range"
                raise BagError("AMX6821", self._bag, text, f"the largest is {size - 1}")
            found.append((column, start + index))
        return found
