"""Replays a recording block by block: uniform scans by columns, the rest message by message, in the recorded order."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping

import numpy as np

from automax_ros.core.kinds import WriterKind
from automax_ros.recordings.read.blocks import MessageBlock
from automax_ros.recordings.read.reader import BagMessage
from automax_ros.replay.columns.apart import ApartStretches
from automax_ros.replay.columns.entries import ValueRules
from automax_ros.replay.columns.forms import ColumnForms
from automax_ros.replay.columns.library import ColumnLibrary
from automax_ros.replay.columns.scans import SCAN, WRITE, ScanColumns, WriteColumns, scans_by_task, write_columns
from automax_ros.replay.columns.stretch import TaskStretches
from automax_ros.replay.scans.commons import RecordedCommons
from automax_ros.replay.scans.task import TaskReplay

FEWEST_MESSAGES = 64
"""Between two messages that must be processed separately, fewer than this are processed one by one, too (decision)."""
FEWEST_WRITES = 8
"""Fewer writes than this are applied one by one (decision)."""


class BlockReplay:
    """Replays blocks of one recording; ``take`` processes one message and returns whether more are of interest.

    In each stretch the last scan of every task is executed separately, so that the state kept of it is complete.
    """

    def __init__(
        self,
        tasks: Mapping[str, TaskReplay],
        names: Collection[str],
        commons: RecordedCommons,
        take: Callable[[BagMessage], bool],
        types: Collection[str],
        span: tuple[int, int | None],
        forms: ColumnForms,
        library: ColumnLibrary,
    ) -> None:
        """Prepare for scans of the tasks of these names; only the given ``tasks`` are executed, in these ``forms``.

        ``span``: scans are counted from its first stamp on, and are of interest up to its second one.
        """
        self._tasks, self._names, self._commons, self._take = tasks, sorted(names), commons, take
        self._begin, self._end = span
        self._rules = ValueRules(commons.rack)
        self._stretches = {
            name: TaskStretches(task, commons, self._rules, forms, library) for name, task in tasks.items()
        }
        numbers = {writer.name: writer.id for writer in commons.facts.table.writers if writer.kind == WriterKind.TASK}
        self._apart = {
            name: ApartStretches(task, self._stretches[name], commons, library, numbers.get(name, -1))
            for name, task in tasks.items()
        }
        self._library = library
        self.types = (SCAN, WRITE, *sorted({*types} - {SCAN, WRITE}))
        """The types of messages to read, in the order in which a block numbers them."""

    def take(self, block: MessageBlock) -> bool:
        """Process a block; return whether more messages are of interest.

        Raises:
            BagError: as the given ``take`` does for each of its messages.
        """
        part = _BlockPart(block, self._names, self._commons.facts.table.run_id, self._rules, self._library)
        begin = 0
        for place in part.by_themselves(self._end):
            if not self._process_between(part, begin, place) or not self._take(block.message(place)):
                return False
            begin = place + 1
        return self._process_between(part, begin, len(block))

    def _process_between(self, part: _BlockPart, begin: int, end: int) -> bool:
        """Process the messages between two that must be processed separately."""
        if end - begin < FEWEST_MESSAGES:
            return self._one_by_one(part, range(begin, end))
        left = part.strays_between(begin, end)
        apart: dict[int, str] = {}
        until = dict.fromkeys(self._tasks, begin)
        for name, task in self._tasks.items():
            scans = part.scans_between(name, begin, end)
            if scans is None:
                continue
            rest = scans.places[self._replay_columns(name, scans) :].tolist()
            if task.edited:
                apart.update(dict.fromkeys(rest, name))
                until[name] = self._replay_apart(part, name, begin, end) if rest[0] == scans.places[0] else begin
            left += rest
        position = begin
        for place in sorted(left):
            name = apart.get(place, "")
            if name and place < until[name]:
                continue
            if not self._writes(part, position, place) or not self._take(part.block.message(place)):
                return False
            position = place + 1
            if name:
                until[name] = self._replay_apart(part, name, position, end)
        return self._writes(part, position, end)

    def _replay_columns(self, name: str, scans: ScanColumns) -> int:
        """Replay scans of a task by columns up to the first odd one, and never the last; return how many."""
        alike, counted = self._alike(scans)
        return self._stretches[name].take(scans.part(0, alike), counted=counted)

    def _replay_apart(self, part: _BlockPart, name: str, begin: int, end: int) -> int:
        """Replay by columns what an edited task does from ``begin`` on; return the place of the next scan to replay.

        Common memory is that of ``begin``.
        """
        apart = self._apart[name]
        scans = part.scans_between(name, begin, end) if apart.is_due else None
        if scans is None:
            return begin
        alike, counted = self._alike(scans)
        taken = apart.take(scans.part(0, alike), part.writes.between(begin, end), counted=counted)
        return int(scans.places[taken])

    def _alike(self, scans: ScanColumns) -> tuple[int, bool]:
        """Return how many scans, without the last one, are all counted or all not counted, and none odd; and which."""
        counted = scans.stamps >= self._begin
        alike = (counted == counted[0]) & ~scans.odd
        alike[-1] = False
        return int(np.argmin(alike)), bool(counted[0])

    def _writes(self, part: _BlockPart, begin: int, end: int) -> bool:
        """Apply the writes between two places."""
        return all(self._write_run(part, run) for run in part.writes.between(begin, end).runs())

    def _write_run(self, part: _BlockPart, run: WriteColumns) -> bool:
        """Apply writes that are all good or all not good."""
        if len(run.places) >= FEWEST_WRITES and run.good[0] and not self._looks_at_writes(part, run):
            entries = run.entries
            if self._commons.take_many(run.sequences, entries.views, entries.elements, entries.values):
                return True
        return self._one_by_one(part, run.places.tolist())

    def _looks_at_writes(self, part: _BlockPart, run: WriteColumns) -> bool:
        """Return whether a task needs each write: those of others matter, or scans follow their writes in the log."""
        return any(
            (task.memory.is_apart and self._apart[name].concern(run)) or (task.edited and part.is_modeled(name))
            for name, task in self._tasks.items()
        )

    def _one_by_one(self, part: _BlockPart, places: Collection[int]) -> bool:
        return all(self._take(part.block.message(place)) for place in places)


class _BlockPart:
    """A block with its scans and writes as columns."""

    def __init__(
        self, block: MessageBlock, names: Collection[str], run_id: int, rules: ValueRules, library: ColumnLibrary
    ) -> None:
        self.block = block
        scans, writes = (np.flatnonzero(block.kinds == kind) for kind in (0, 1))
        self._scans, self._strays = scans_by_task(library, block, scans, tuple(names), rules)
        self.writes, self._forcing = write_columns(library, block, writes, run_id, rules)
        self._modeled = {name: bool(scans.durations.any()) for name, scans in self._scans.items()}

    def by_themselves(self, end: int | None) -> list[int]:
        """Return the places of messages to process separately, ascending; all after the first scan beyond ``end``."""
        found = [np.flatnonzero(self.block.kinds > 1), self._forcing]
        if end is not None:
            beyond = [scans.places[scans.stamps > end] for scans in self._scans.values()]
            first = min((int(places[0]) for places in beyond if len(places)), default=len(self.block))
            found.append(np.arange(first, len(self.block)))
        places: list[int] = np.unique(np.concatenate(found)).tolist()
        return places

    def strays_between(self, begin: int, end: int) -> list[int]:
        """Return the places of the scans of no known task."""
        first, last = np.searchsorted(self._strays, (begin, end)).tolist()
        places: list[int] = self._strays[first:last].tolist()
        return places

    def scans_between(self, name: str, begin: int, end: int) -> ScanColumns | None:
        """Return the scans of a task between two places, None if there are none."""
        scans = self._scans.get(name)
        if scans is None:
            return None
        first, last = np.searchsorted(scans.places, (begin, end)).tolist()
        return scans.part(first, last) if last > first else None

    def is_modeled(self, name: str) -> bool:
        """Return whether scans of a task took time; TRUE without scans, for they may in the next block."""
        return self._modeled.get(name, True)
