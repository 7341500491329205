"""The totals of a replay, over the whole recording or a part of it; those of parts are added up."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

from automax_ros.replay.scans.report import Difference, FirstScan, TaskReport

MOST_NOTES = 200
"""Most notes about one task that are kept; a report shows the first of them."""
_NOTES_SHOWN = 20


@dataclass(frozen=True)
class TaskTotals:
    """One task: scans and states compared, scans that differ, scans that could not be executed, notes, each once."""

    name: str
    source: str
    edited: bool
    compared: int
    different: int
    states: int
    left_out: int
    notes: tuple[str, ...]

    def since(self, base: TaskTotals) -> TaskTotals:
        """Return the totals since ``base``."""
        notes = tuple(note for note in self.notes if note not in base.notes)
        return self._add(base, -1, notes)

    def and_then(self, other: TaskTotals) -> TaskTotals:
        """Return the sum of these totals and later ones."""
        notes = tuple(dict.fromkeys((*self.notes, *other.notes)))[:MOST_NOTES]
        return self._add(other, 1, notes)

    def report(self) -> TaskReport:
        """Return the task's part of the report."""
        notes = list(self.notes)
        if self.left_out:
            scans, them = (f"{self.left_out} scans", "them") if self.left_out > 1 else ("1 scan", "it")
            left = f"{scans} could not be executed again: the state before {them} is not recorded"
            notes = list(dict.fromkeys([*notes, left])) if len(notes) < MOST_NOTES else notes
        if len(notes) > _NOTES_SHOWN:
            notes = [*notes[:_NOTES_SHOWN], f"and {len(notes) - _NOTES_SHOWN} notes more"]
        return TaskReport(self.name, self.source, self.edited, self.compared, self.different, self.states, tuple(notes))

    def _add(self, other: TaskTotals, sign: int, notes: tuple[str, ...]) -> TaskTotals:
        return replace(
            self,
            compared=self.compared + sign * other.compared,
            different=self.different + sign * other.different,
            states=self.states + sign * other.states,
            left_out=self.left_out + sign * other.left_out,
            notes=notes,
        )


@dataclass(frozen=True)
class Totals:
    """The totals of all tasks by name, and the differences.

    ``first_stamp`` is that of the first message, ``last_stamp`` that of the last scan; None before there is one.
    """

    first_stamp: int | None
    last_stamp: int | None
    tasks: Mapping[str, TaskTotals]
    first: FirstScan | None = None
    differences: tuple[Difference, ...] = ()
    more: int = 0

    @property
    def clean(self) -> bool:
        """Whether nothing differs."""
        return self.first is None and not self.differences and not self.more

    @property
    def full(self) -> bool:
        """Whether a task has the most notes that are kept: some may have been dropped."""
        return any(len(task.notes) >= MOST_NOTES for task in self.tasks.values())

    def since(self, base: Totals) -> Totals:
        """Return the totals since ``base``, in which nothing differs."""
        return replace(self, tasks={name: task.since(base.tasks[name]) for name, task in self.tasks.items()})

    def forgetting_notes(self) -> Totals:
        """Return these counts without the notes."""
        return replace(self, tasks={name: replace(task, notes=()) for name, task in self.tasks.items()})

    def and_then(self, other: Totals) -> Totals:
        """Return the sum of these totals, in which nothing differs, and later ones."""
        return replace(
            other,
            first_stamp=self.first_stamp if self.first_stamp is not None else other.first_stamp,
            last_stamp=other.last_stamp if other.last_stamp is not None else self.last_stamp,
            tasks={name: task.and_then(other.tasks[name]) for name, task in self.tasks.items()},
        )


def added_up(parts: Iterable[Totals]) -> Totals:
    """Return the sum of the totals of parts, at least one, in their order."""
    first, *others = parts
    for part in others:
        first = first.and_then(part)
    return first
