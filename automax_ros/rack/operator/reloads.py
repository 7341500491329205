"""Reloads of tasks by an operator in three parts, of which the long one runs while the rack scans."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NoReturn

from automax_ros.compile.base.layout import Role
from automax_ros.core.diagnostics import SourceText, render
from automax_ros.core.types import Value
from automax_ros.core.values import source_text
from automax_ros.rack.base.stop_cause import OperationRefused
from automax_ros.rack.operator.readings import MAX_NAME
from automax_ros.rack.rack import Rack
from automax_ros.rack.tasks.installation import PreparedReload, RackError
from automax_ros.rackfile.reading.files import MAX_BYTES

_MOST_FINDINGS = 100


class ReloadRefused(OperationRefused):
    """A source was refused; ``findings`` are those of its check, each as a text of several lines."""

    def __init__(self, reason: str, findings: Sequence[str]) -> None:
        super().__init__(reason)
        self.findings = tuple(findings)


class Reloads:
    """Replaces sources of one rack's tasks by texts. Everything but ``prepare`` must be called between two scans.

    Raises:
        OperationRefused: all methods, if the rack refuses; observers receive the refusal.
    """

    def __init__(self, rack: Rack) -> None:
        self._rack, self._reports = rack, rack.operations.reports

    def admit(self, task: str, source: str) -> tuple[str, SourceText]:
        """Return the task of a reload and its new source: first part of a reload, short.

        Findings name the task, such as ``SPEED.BLK:1:1``: the text is not the rack's file (decision).
        """
        if len(task) > MAX_NAME:
            self._reports.refuse("reload", f"a text of {len(task)} characters: at most {MAX_NAME} are read")
        name = task.strip().upper()
        if len(source) > MAX_BYTES:
            reason = f"a source of {len(source)} characters: at most {MAX_BYTES} are read"
            self._reports.refuse("reload", reason, name)
        self._rack.operations.admit_reload(name)
        return name, SourceText(f"{name}{Path(self._rack.sources[name].name).suffix}", source)

    def prepare(self, name: str, source: SourceText) -> PreparedReload:
        """Check and compile a source: second part of a reload, long; on any thread, while the rack scans."""
        return self._rack.operations.installation.prepare(name, source)

    def is_current(self, prepared: PreparedReload) -> bool:
        """Return whether a source was prepared for the tasks as they are now; else it must be prepared again."""
        return self._rack.operations.installation.is_current(prepared)

    def install(self, prepared: PreparedReload, *, keep_state: bool = False) -> str:
        """Install the prepared source of a task: last part of a reload, short.

        Returns in words which tuned values the task has lost, "" if none: an installation takes them from the source.

        Raises:
            ReloadRefused: the source has errors; the old one continues.
        """
        before = self._tunables(prepared.task)
        try:
            self._rack.operations.install(prepared, keep_state=keep_state)
        except RackError as error:
            found = [render(item, where) for where, items in error.findings for item in items]
            raise ReloadRefused(str(error), found[:_MOST_FINDINGS]) from error
        now = self._tunables(prepared.task)
        return ", ".join(
            f"{name} was tuned to {source_text(held)} and is "
            + (f"{source_text(now[name][0])} again" if name in now else "not there any more")
            for name, (held, initial) in before.items()
            if held != initial and (name not in now or now[name][0] != held)
        )

    def refuse(self, task: str, reason: str) -> NoReturn:
        """Refuse a reload for a reason of the caller's."""
        self._reports.refuse("reload", reason, task.strip().upper()[:MAX_NAME])

    def _tunables(self, name: str) -> dict[str, tuple[Value, Value]]:
        """Return the tunables of a task with their values, and those of its source."""
        task = self._rack.task(name)
        fields = [item for item in task.layout.fields if item.role is Role.TUNABLE]
        values = [(item, task.value(item.name)) for item in fields]
        return {item.name: (value, item.initial) for item, value in values if not isinstance(value, list)}
