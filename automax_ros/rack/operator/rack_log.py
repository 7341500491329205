"""One time line of what a rack tells: errors of its tasks, operations, remarks."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from typing import Any

from automax_ros.core.problems import PROBLEMS
from automax_ros.core.ticks import NS_PER_S
from automax_ros.rack.base.observers import Operation

MOST_ENTRIES = 5000
"""Most entries that are kept (decision)."""
SAME_NS = NS_PER_S
"""An error that a task logs again at the same line within this rack time is listed once (decision)."""


class RackLog:
    """The last entries, as data for JSON; one thread adds them, another may read them. Times are rack time, ns."""

    def __init__(self) -> None:
        self._entries: deque[Mapping[str, Any]] = deque(maxlen=MOST_ENTRIES)
        self._last: dict[tuple[str, int, int], int] = {}
        self._count = 0

    def after(self, number: int) -> list[Mapping[str, Any]]:
        """Return the entries with a greater number ``n``, which counts from 1, oldest first."""
        return [entry for entry in self._entries.copy() if entry["n"] > number] if self._count > number else []

    def error(self, at_ns: int, task: str, line: int, code: int, scan: int) -> None:
        """Add a run-time error of a scan."""
        last_ns = self._last.get((task, line, code))
        if last_ns is not None and last_ns <= at_ns < last_ns + SAME_NS:
            return
        self._last[task, line, code] = at_ns
        name = f"AMX{code:04d}"
        text = problem.title if (problem := PROBLEMS.get(name)) else "unknown problem"
        self._add("error", at_ns, task, "", text, ok=False, code=name, line=line, scan=scan)

    def operation(self, operation: Operation) -> None:
        """Add an operation, or one that was refused."""
        text = ": ".join(filter(None, (operation.detail, operation.reason)))
        self._add("operation", operation.at_ns, operation.task, operation.what, text, ok=operation.ok)

    def note(self, at_ns: int, text: str) -> None:
        """Add a remark."""
        self._add("note", at_ns, "", "", text, ok=True)

    def _add(self, kind: str, at_ns: int, task: str, what: str, text: str, *, ok: bool, **more: object) -> None:
        self._count += 1
        entry = {"n": self._count, "t": at_ns, "kind": kind, "task": task, "what": what, "text": text, "ok": ok}
        self._entries.append({**entry, "code": "", "line": 0, "scan": 0, **more})
