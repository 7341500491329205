"""Operations of an operator as actions of stimuli: each calls the rack's operation of that name."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from automax_ros.core.diagnostics import Diagnostic, SourceText
from automax_ros.core.problems import Severity
from automax_ros.rack.base.stop_cause import OperationRefused
from automax_ros.rack.rack import Rack
from automax_ros.rack.tasks.installation import RackError
from automax_ros.scenario.stimuli.wave_player import WavePlayer


@dataclass(frozen=True)
class Operate:
    """One operation on the task, variable, module or plant ``of``, "" for the whole rack."""

    of: str
    operation: Callable[[], object]

    def do(self, _: WavePlayer) -> None:
        """Execute it."""
        self.operation()


@dataclass(frozen=True)
class Reload:
    """Replaces the source of a task."""

    of: str
    source: SourceText
    keep_state: bool
    rack: Rack

    def do(self, _: WavePlayer) -> None:
        """Install it; if it has errors the old one continues."""
        try:
            self.rack.operations.reload(self.of, self.source, keep_state=self.keep_state)
        except RackError as error:
            raise OperationRefused(f"{error}{_first_error(error)}") from error


def _first_error(error: RackError) -> str:
    for source, diagnostics in error.findings:
        found: Diagnostic | None = next((item for item in diagnostics if item.severity is Severity.ERROR), None)
        if found is not None:
            return f": {source.name}:{found.span.line}: {found.code}: {found.message}"
    return ""
