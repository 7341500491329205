"""A scan in steps of modeled time that has not ended yet: its data, and what is needed to execute it again.

It works on a copy of its task's state, which is that of the last complete scan until it ends, in snapshots too; a scan
that is abandoned changes only what it has written to memory (decision). It notes what it reads, so that another rack
can execute its first part again and continue.
"""

from __future__ import annotations

from collections.abc import Generator, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from automax_ros.compile.base.scan_io import StateValues
from automax_ros.core.kinds import WriteKind
from automax_ros.core.types import Latched, Value
from automax_ros.runtime.memory.memory import CommonMemory
from automax_ros.runtime.memory.views import LatchPlan
from automax_ros.runtime.scan.error_log import ErrorLog
from automax_ros.runtime.scan.scan_record import ScanRecord
from automax_ros.runtime.scan.task_io import Call, ScanMemory

Progress = Mapping[str, Any]
"""The progress of a scan, in numbers, texts, lists and mappings."""


class ReplayableReads:
    """Memory as a scan in progress uses it: ``noted`` are all values that it has read since it began.

    From ``replay`` to ``end_replay`` it returns the values that an earlier scan read, and writes nothing.
    """

    def __init__(self, memory: ScanMemory) -> None:
        self._memory = memory
        self._accesses: Mapping[int, Call] = memory.accesses if isinstance(memory, CommonMemory) else {}
        self.latched: Sequence[int] = ()
        self._replayed: Iterator[Any] | None = None
        self.noted: list[Any] = []
        self.latched_ns = 0

    @property
    def now_ns(self) -> int:
        """The time of the next access."""
        return self._memory.now_ns if self._replayed is None else self.latched_ns

    def begin(self) -> None:
        """Begin a scan, which has not read or latched yet: nothing of the scan before is in its progress."""
        self.noted = []
        self.latched_ns = 0

    def replay(self, noted: Sequence[Any], latched_ns: int) -> None:
        """Return from now on the values read by a scan that latched at an instant, instead of those in memory."""
        self._replayed, self.latched_ns = iter(noted), latched_ns

    def end_replay(self) -> None:
        """Use memory from now on."""
        self._replayed = None

    def latch(self, plan: LatchPlan) -> Latched:
        """Return copies of the planned views."""
        if self._replayed is None:
            self.latched_ns = self._memory.now_ns
            values = self._memory.latch(plan)
            self._note_access(self.latched)
        else:
            values = tuple(next(self._replayed))
        self.noted.append(values)
        return values

    def read_now(self, view: int, element: int = 0) -> Value:
        """Return an actual value."""
        if self._replayed is None:
            value: Value = self._memory.read_now(view, element)
            self._note_access((view,))
        else:
            value = next(self._replayed)
        self.noted.append(value)
        return value

    def is_forced(self, view: int) -> bool:
        """Return whether a force holds a simple view."""
        forced: bool = self._memory.is_forced(view) if self._replayed is None else next(self._replayed)
        self.noted.append(forced)
        return forced

    def outcome_of(self, call: Call) -> Any:
        """Return the result of a call outside the task, or its result when the scan was executed first."""
        outcome = call() if self._replayed is None else next(self._replayed)
        self.noted.append(outcome)
        return outcome

    def commit(self, changes: Sequence[tuple[int, Value]], writer: int) -> None:
        """Write the values that the scan's blocks changed."""
        if self._replayed is None:
            self._memory.commit(changes, writer)
            self._note_access([view for view, _ in changes] if self._accesses else ())

    def write_now(
        self, view: int, value: Value, writer: int, element: int = 0, kind: WriteKind = WriteKind.BASIC
    ) -> None:
        """Write an actual value."""
        if self._replayed is None:
            self._memory.write_now(view, value, writer, element, kind)
            self._note_access((view,))

    def _note_access(self, views: Sequence[int]) -> None:
        if self._accesses:
            for view in views:
                watcher = self._accesses.get(view)
                if watcher is not None:
                    watcher()


@dataclass(eq=False)
class ScanInProgress:
    """A scan that has begun: ``steps`` counts those that it has yielded.

    ``log`` is the error log before it, ``own_errors`` are the errors that it has logged itself; None if there are none.
    """

    began_ns: int
    skipped: int
    state: StateValues
    log: ErrorLog | None
    memory: ReplayableReads
    steps: int = 0
    own_errors: ErrorLog | None = None

    @property
    def progress(self) -> Progress:
        """The data with which ``Task.resume_scan`` continues the scan from here."""
        return {
            "began_ns": self.began_ns,
            "latched_ns": self.memory.latched_ns,
            "skipped": self.skipped,
            "steps": self.steps,
            "heard": list(self.memory.noted),
        }


Begun = tuple[ScanInProgress, ScanRecord | None, Generator[int, None, bool]]
"""A scan that has begun: its data, its record if one is kept, and the compiled form that executes it."""
