"""A task's error log: the first, the second and the last entry (J2-3106-1 p. 13-4)."""

from __future__ import annotations

from dataclasses import dataclass

from automax_ros.compile.base.layout import Layout, Role, StateField
from automax_ros.compile.compiler import CompiledTask
from automax_ros.core.problems import PROBLEMS
from automax_ros.core.types import DataType
from automax_ros.drive.current_loop.minor_loop import NUMBERS

LOG_FIELD = "ERROR LOG"
"""The log's name in a snapshot."""
LOG_NUMBERS = 10
"""How many numbers ``ErrorLog.flatten`` returns."""
_LOG = StateField(LOG_FIELD, DataType.DOUBLE, Role.LOG, 0, LOG_NUMBERS, is_array=True)


@dataclass(frozen=True)
class LogEntry:
    """One logged run-time error: BASIC line, number of the problem (7001 is AMX7001), number of the scan."""

    line: int
    code: int
    scan: int

    @property
    def problem(self) -> str:
        """The problem's code, such as AMX7001."""
        return f"AMX{self.code:04d}"

    @property
    def hardware(self) -> str | None:
        """The hardware's code, where one is known."""
        problem = PROBLEMS.get(self.problem)
        return problem.hardware or None if problem else None

    def describe(self) -> str:
        """Return the entry as text for people."""
        problem = PROBLEMS.get(self.problem)
        title = problem.title if problem else "unknown problem"
        hardware = f" (code {self.hardware} on the rack)" if self.hardware else ""
        return f"scan {self.scan}, line {self.line}: {self.problem} {title}{hardware}"


@dataclass
class ErrorLog:
    """The log: errors between the second and the last are counted, not kept."""

    first: LogEntry | None = None
    second: LogEntry | None = None
    last: LogEntry | None = None
    count: int = 0

    def add(self, entry: LogEntry) -> None:
        """Log an error."""
        self.count += 1
        if self.first is None:
            self.first = entry
        elif self.second is None:
            self.second = entry
        self.last = entry

    def clear(self) -> None:
        """Empty the log (CLR_ERRLOG, or the operator)."""
        self.first, self.second, self.last, self.count = None, None, None, 0

    @property
    def entries(self) -> list[LogEntry]:
        """The kept entries, oldest first; each once."""
        kept = [entry for entry in (self.first, self.second) if entry is not None]
        if self.last is not None and self.count > len(kept):
            kept.append(self.last)
        return kept

    def copy(self) -> ErrorLog:
        """Return an independent log with the same entries."""
        return ErrorLog(self.first, self.second, self.last, self.count)

    def flatten(self) -> list[int]:
        """Return the log as numbers for a snapshot: count, then line, code and scan of first, second and last."""
        numbers = [self.count]
        for entry in (self.first, self.second, self.last):
            numbers += [entry.line, entry.code, entry.scan] if entry else [0, 0, 0]
        return numbers

    def restore(self, numbers: list[int]) -> None:
        """Restore the log from ``flatten``'s numbers; ValueError if they are not ten."""
        if len(numbers) != LOG_NUMBERS:
            raise ValueError(f"an error log is {LOG_NUMBERS} numbers, not {len(numbers)}")
        self.count = numbers[0]
        triples = [numbers[start : start + 3] for start in (1, 4, 7)]
        entries = [LogEntry(*triple) if triple[1] else None for triple in triples]
        self.first, self.second, self.last = entries


def snapshot_layout(compiled: CompiledTask) -> Layout:
    """Return the layout of a task's snapshots: the state, the numbers of its minor loop, the error log."""
    cml = compiled.program.cml
    if cml is None:
        return Layout((*compiled.layout.fields, _LOG))
    loop = StateField(cml.block.name, DataType.REAL, Role.BLOCK, 0.0, NUMBERS, is_array=True)
    return Layout((*compiled.layout.fields, loop, _LOG))
