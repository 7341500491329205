"""Recorded states as columns: locals and block states of tasks, signals of plants, of their rolls and of webs.

Names of locals have a period, such as ``SPEED.RATIO%``, those of signals a slash, such as ``UNWIND/current_a`` or
``W1/tension_n``, and those of commons neither.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Sequence
from pathlib import Path

from automax_ros.core.text import near_or_listed
from automax_ros.core.types import DataType, type_of_name
from automax_ros.drive.web.signals import END_KINDS, WEB_KINDS
from automax_ros.messages.types.messages import NAMES, PlantState, RollState, TaskState, WebState
from automax_ros.rackfile.model.plant_signals import ALL_KINDS, ALL_UNITS, SIGNAL_KINDS
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.recordings.read.common_log import Watched

_NOT_COMMON = -1
"""``Watched.variable`` of a column that is not a common variable."""
_LOCAL = re.compile(r"(?P<task>[A-Z][A-Z0-9_]{0,63})\.(?P<field>[^()\[\]]{1,80}?) ?(?:[(\[](?P<index>\d{1,9})[)\]])?")
_SIGNAL = re.compile(r"(?P<plant>[A-Z][A-Z0-9_]{0,63})/(?P<signal>[A-Z_]{1,40})")
_LOCAL_HINT = "write TASK.NAME, such as SPEED.RATIO%, or TASK.NAME(3) for an element"
_SIGNAL_HINT = "write PLANT/SIGNAL or WEB/SIGNAL, such as UNWIND/current_a or W1/tension_n"
State = TaskState | PlantState | RollState | WebState
"""A message that has states."""
_KIND_OF = {
    **dict.fromkeys(SIGNAL_KINDS, PlantState),
    **dict.fromkeys(END_KINDS, RollState),
    **dict.fromkeys(WEB_KINDS, WebState),
}


def states_for(names: Collection[str]) -> set[str]:
    """Return the types of the states that hold what these names ask for; none for commons."""
    found: set[str] = set()
    for name in names:
        _, slash, signal = "".join(name.split()).partition("/")
        if slash:
            found.add(NAMES[_KIND_OF.get(signal.lower(), PlantState)])
        elif "." in name:
            found.add(NAMES[TaskState])
    return found


class WatchedStates:
    """The watched locals and signals. Their names determine their types, TaskStates the places of locals."""

    def __init__(self, bag: Path) -> None:
        self._bag = bag
        self._columns: dict[str, Watched] = {}
        self._locals: dict[str, list[tuple[int, str, int]]] = {}
        self._signals: dict[tuple[type, str], list[tuple[int, str]]] = {}
        self._places: dict[str, tuple[str, list[tuple[int, int]]]] = {}
        self._seen: set[tuple[type, str]] = set()

    def add(self, column: int, asked: str) -> Watched:
        """Watch a local or signal, in the column of this index unless it has one already; return its description.

        Raises:
            BagError: the name is not that of a local or signal, or is that of a text.
        """
        return self._signal(column, asked) if "/" in asked else self._local(column, asked)

    def _local(self, column: int, asked: str) -> Watched:
        match = _LOCAL.fullmatch(" ".join(asked.upper().split()))
        if match is None:
            raise BagError("AMX6821", self._bag, f"{asked[:80]!r} is not a name of a local", _LOCAL_HINT)
        task, field, index = match["task"], match["field"], int(match["index"] or 0)
        kind = type_of_name(field)
        if kind is DataType.STRING:
            raise BagError("AMX6828", self._bag, f"{task}.{field} holds texts, and states are numbers", "leave it out")
        label = f"{task}.{field}({index})" if match["index"] else f"{task}.{field}"
        if label not in self._columns:
            self._columns[label] = Watched(label, _NOT_COMMON, column, kind)
            self._locals.setdefault(task, []).append((column, field, index))
        return self._columns[label]

    def _signal(self, column: int, asked: str) -> Watched:
        match = _SIGNAL.fullmatch("".join(asked.upper().split()))
        if match is None:
            raise BagError("AMX6821", self._bag, f"{asked[:80]!r} is not a name of a plant's signal", _SIGNAL_HINT)
        plant, signal = match["plant"], match["signal"].lower()
        if signal not in ALL_KINDS:
            text = f"a plant or web has no signal {signal!r}"
            raise BagError("AMX6821", self._bag, text, near_or_listed(signal, ALL_KINDS, f"{plant}/"))
        label = f"{plant}/{signal}"
        if label not in self._columns:
            self._columns[label] = Watched(label, _NOT_COMMON, column, ALL_KINDS[signal], ALL_UNITS.get(signal, ""))
            self._signals.setdefault((_KIND_OF[signal], plant), []).append((column, signal))
        return self._columns[label]

    def values(self, state: State) -> Iterator[tuple[int, float]]:
        """Yield column and value of what is watched in a state.

        Raises:
            BagError: the task has no such local, or the state is inconsistent.
        """
        if not isinstance(state, TaskState):
            owner = type(state), state.web if isinstance(state, WebState) else state.plant
            self._seen.add(owner)
            for column, signal in self._signals.get(owner, ()):
                yield column, getattr(state, signal)
        elif state.task in self._locals:
            known = self._places.get(state.task)
            if known is None or known[0] != state.layout_hash:
                known = self._places[state.task] = (
                    state.layout_hash,
                    self._find_places(state, self._locals[state.task]),
                )
            for column, place in known[1]:
                if place >= len(state.value):
                    raise BagError("AMX6813", self._bag, f"a state of {state.task} lacks values")
                yield column, state.value[place]

    def require_all(self) -> None:
        """Check that the recording contained states of all requested tasks, plants and webs.

        Raises:
            BagError: it contained none of one.
        """
        self._require("AMX6827", "task", self._locals, list(self._places))
        for kind, what in ((PlantState, "plant"), (RollState, "roll or roller of plant"), (WebState, "web")):
            asked, seen = ([name for own, name in names if own is kind] for names in (self._signals, self._seen))
            self._require("AMX6850", what, asked, sorted(seen))

    def _require(self, code: str, kind: str, asked: Collection[str], seen: Sequence[str]) -> None:
        missing = [name for name in asked if name not in seen]
        if missing:
            hint = f"it holds those of {', '.join(seen[:8])}" if seen else ""
            raise BagError(code, self._bag, f"holds no states of a {kind} {missing[0][:40]!r}", hint)

    def _find_places(self, state: TaskState, asked: Sequence[tuple[int, str, int]]) -> list[tuple[int, int]]:
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
