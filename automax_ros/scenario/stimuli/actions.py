"""Operations of an operator as actions of stimuli: each calls the rack's operation of that name."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from automax_ros.core.diagnostics import Diagnostic, SourceText
from automax_ros.core.problems import Severity
from automax_ros.core.types import Value
from automax_ros.rack.base.stop_cause import OperationRefused
from automax_ros.rack.rack import Rack
from automax_ros.rack.tasks.installation import RackError
from automax_ros.scenario.stimuli.wave_player import WavePlayer


@dataclass(frozen=True)
class OnTask:
    """An operation on one task."""

    of: str
    operation: Callable[[str], None]

    def do(self, _: WavePlayer) -> None:
        """Execute it."""
        self.operation(self.of)


@dataclass(frozen=True)
class OnRack:
    """An operation on the whole rack."""

    operation: Callable[[], None]
    of: str = ""

    def do(self, _: WavePlayer) -> None:
        """Execute it."""
        self.operation()


@dataclass(frozen=True)
class OnValue:
    """A value for a variable: a force, a tunable."""

    of: str
    value: Value
    operation: Callable[[str, Any], None]

    def do(self, _: WavePlayer) -> None:
        """Set it."""
        self.operation(self.of, self.value)


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


@dataclass(frozen=True)
class Control:
    """Moves a control of the module or plant ``of``, such as a test switch."""

    of: str
    control: str
    value: str
    move: Callable[[str, str, str], None]

    def do(self, _: WavePlayer) -> None:
        """Move it."""
        self.move(self.of, self.control, self.value)


def _first_error(error: RackError) -> str:
    for source, diagnostics in error.findings:
        found: Diagnostic | None = next((item for item in diagnostics if item.severity is Severity.ERROR), None)
        if found is not None:
            return f": {source.name}:{found.span.line}: {found.code}: {found.message}"
    return ""
