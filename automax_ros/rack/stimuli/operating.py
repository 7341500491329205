"""What an operator does, as actions of stimuli: each calls the rack's operation of that name."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from automax_ros.core.diagnostics import Diagnostic, SourceText
from automax_ros.core.problems import Severity
from automax_ros.core.types import Value
from automax_ros.rack.installation import RackError
from automax_ros.rack.modules.kind import Operable
from automax_ros.rack.operations import OperationRefused
from automax_ros.rack.rack import Rack
from automax_ros.rack.stimuli.stage import Stage


@dataclass(frozen=True)
class OnTask:
    """An operation on one task."""

    of: str
    operation: Callable[[str], None]

    def do(self, _: Stage) -> None:
        """Do it."""
        self.operation(self.of)


@dataclass(frozen=True)
class OnRack:
    """An operation on the whole rack."""

    operation: Callable[[], None]
    of: str = ""

    def do(self, _: Stage) -> None:
        """Do it."""
        self.operation()


@dataclass(frozen=True)
class Force:
    """Holds a common at a value."""

    of: str
    value: Value
    rack: Rack

    def do(self, _: Stage) -> None:
        """Force it."""
        try:
            self.rack.force(self.of, self.value)
        except ValueError as error:
            raise OperationRefused(str(error)) from error


@dataclass(frozen=True)
class Tune:
    """Sets a tunable of a task."""

    task: str
    name: str
    value: Value
    rack: Rack

    @property
    def of(self) -> str:
        """The task and the tunable."""
        return f"{self.task}.{self.name}"

    def do(self, _: Stage) -> None:
        """Tune it, if the task still has it: a reload may have changed the task."""
        try:
            self.rack.tune(self.rack.task(self.task), self.name, self.value)
        except KeyError as error:
            raise OperationRefused(f"task {self.task} has no tunable {self.name}") from error
        except ValueError as error:
            raise OperationRefused(str(error)) from error


@dataclass(frozen=True)
class Reload:
    """Replaces the source of a task."""

    of: str
    source: SourceText
    keep_state: bool
    rack: Rack

    def do(self, _: Stage) -> None:
        """Install it; one that has errors leaves the old one running."""
        try:
            self.rack.operations.reload(self.of, self.source)
        except RackError as error:
            raise OperationRefused(f"{error}{_first_error(error)}") from error


@dataclass(frozen=True)
class Power:
    """Switches the power off and, after a time, on again."""

    off_ns: int
    battery: bool
    rack: Rack
    of: str = ""

    def do(self, stage: Stage) -> None:
        """Switch it off now."""
        self.rack.operations.power_off()
        stage.later(self.off_ns, self._on)

    def _on(self) -> None:
        self.rack.operations.power_on(battery=self.battery)


@dataclass(frozen=True)
class Control:
    """Moves a control of a module, such as a test switch."""

    of: str
    module: Operable
    verb: str
    value: str

    def do(self, _: Stage) -> None:
        """Move it."""
        self.module.operate(self.verb, self.value)


def _first_error(error: RackError) -> str:
    for source, diagnostics in error.findings:
        found: Diagnostic | None = next((item for item in diagnostics if item.severity is Severity.ERROR), None)
        if found is not None:
            return f": {source.name}:{found.span.line}: {found.code}: {found.message}"
    return ""
