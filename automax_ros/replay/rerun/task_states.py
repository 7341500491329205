"""What recorded states of tasks say of the outside: tunables that were set, and the sources of reloads."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from pathlib import Path

from automax_ros.core.diagnostics import SourceText
from automax_ros.core.ticks import seconds_text
from automax_ros.core.types import DataType, Value
from automax_ros.messages.types.messages import TaskState
from automax_ros.messages.types.rack_files import RackFile
from automax_ros.rackfile.model.value_names import tunables_of
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.replay.rerun.events import Tuned
from automax_ros.replay.scans.state import places_of, wrong_state
from automax_ros.replay.scans.stored_rack import StoredRack


class RecordedStates:
    """Follows the states of the tasks of one recording."""

    def __init__(self, bag: Path, rack: StoredRack) -> None:
        self._bag = bag
        self._sources = _sources_by_hash(rack)
        self._kinds = {
            program.name: {name: symbol.type for name, symbol in tunables_of(program).items()}
            for program in rack.programs()
        }
        self._values: dict[str, dict[str, Value]] = {}
        self._replaced: set[str] = set()

    def replaced(self, tasks: Iterable[str]) -> None:
        """Take note that the next states of tasks have other tunables which nobody has set."""
        self._replaced.update(tasks)

    def tuned(self, state: TaskState) -> Iterator[Tuned]:
        """Yield the tunables that were set since the state of the task before.

        Raises:
            BagError: the state's lists are inconsistent, or a tunable cannot have its number (AMX6813).
        """
        name, values = state.task, self._tunables(state)
        known = {} if name in self._replaced else self._values.get(name, {})
        self._replaced.discard(name)
        self._values[name] = values
        for tunable, value in values.items():
            if known.get(tunable, value) != value:
                yield Tuned(name, tunable, value)

    def _tunables(self, state: TaskState) -> dict[str, Value]:
        kinds = self._kinds.get(state.task, {})
        places = places_of(self._bag, state, tuple(kinds))
        return {name: self._typed(state, name, kinds[name], state.value[place]) for name, place in places.items()}

    def _typed(self, state: TaskState, name: str, kind: DataType, value: float) -> Value:
        if not math.isfinite(value) or (kind is not DataType.REAL and not value.is_integer()):
            raise wrong_state(self._bag, state, f"tunable {name} cannot be {value!r}")
        return value if kind is DataType.REAL else int(value)

    def source(self, state: TaskState, at_ns: int) -> SourceText:
        """Return the source with which the task of a state was reloaded, at a time of the run (ns).

        Raises:
            BagError: it is not in the recording (AMX6835).
        """
        source = self._sources.get((state.task, state.source_hash))
        if source is None:
            raise self.lacks_source(state.task, at_ns)
        return source

    def lacks_source(self, task: str, at_ns: int) -> BagError:
        """Return the error for a reload whose source is not in the recording."""
        what = f"lacks the source with which task {task} was reloaded at {seconds_text(at_ns)} s"
        return BagError("AMX6835", self._bag, what, "end before it with --to")


def _sources_by_hash(rack: StoredRack) -> dict[tuple[str, str], SourceText]:
    texts = {name: (source, *rack.later.get(name, ())) for name, source in rack.sources.items()}
    return {(name, RackFile(name, text.text).sha256): text for name, sources in texts.items() for text in sources}
