"""Signals of stimuli: single values by name, of a rack or of a lone task."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Protocol

from automax_ros.core.names import PREDEFINED, NameFault
from automax_ros.core.types import DataType, Value
from automax_ros.rack.rack import Rack
from automax_ros.rackfile.model.config import CommonElement
from automax_ros.rackfile.model.writers import OPERATOR_WRITER
from automax_ros.rackfile.reading.scale import Scale
from automax_ros.runtime.tasks.standalone_task import StandaloneTask


@dataclass(frozen=True)
class Signal:
    """A simple variable or an element of an array, with functions that read and write it.

    ``label`` is its full name; ``length`` is the most characters of a STRING; ``low`` and ``high`` are the limits of a
    number. ``set`` and ``write`` accept a value of its type within them. ``set`` acts as an operator: it raises
    OperationRefused if that is not possible now. ``write`` acts as an instrument: on a forced signal it does nothing.
    ``scale`` says what its counts mean, None where nothing does; ``unit`` what its number is in, "" where nothing does.
    """

    label: str
    type: DataType
    length: int
    low: float
    high: float
    read: Callable[[], Value]
    set: Callable[[Value], None]
    write: Callable[[Value], None]
    scale: Scale | None = None
    unit: str = ""


class Signals(Protocol):
    """Finds signals by name. ``word`` is their owner in messages: ``rack`` or ``task``."""

    @property
    def word(self) -> str: ...  # noqa: D102

    def find(self, name: str) -> Signal:
        """Return the signal with a name such as ``REF%`` or ``TABLE%(3)``.

        Raises:
            NameFault: there is no such simple variable or element, or stimuli may not write it.
        """
        ...


@dataclass(frozen=True)
class RackSignals:
    """The commons of a rack: plain ones, points of modules, elements of arrays."""

    rack: Rack
    word = "rack"

    def find(self, name: str) -> Signal:
        """Return a common, or an element of one; variables that the rack itself writes are refused (2.4.6)."""
        meant = self.rack.config.common(name)
        if meant.name in PREDEFINED:
            raise NameFault(f"{meant.name} cannot be written: the rack itself writes it", "leave it out")
        variable = meant.variable
        view = self.rack.memory.view(variable.name)
        return Signal(
            meant.label,
            variable.type,
            variable.length,
            *variable.type.range,
            partial(self.rack.memory.read_now, view, meant.index),
            partial(self.rack.adjust.write, meant),
            partial(self._write, meant, view),
            variable.scale,
            variable.unit,
        )

    def _write(self, meant: CommonElement, view: int, value: Value) -> None:
        """Write a sample; without power the rack ignores all but inputs, which are the process's (decision)."""
        if not self.rack.operations.powered and not self.rack.config.is_input(meant.variable):
            return
        self.rack.write_view(view, [(meant.index, value)], OPERATOR_WRITER)


@dataclass(frozen=True)
class LoneSignals:
    """The variables of a task without a rack: commons, locals, and tunables within their limits."""

    lone: StandaloneTask
    word = "task"

    def find(self, name: str) -> Signal:
        """Return a variable of the task, or an element of one."""
        found = self.lone.variable(name)
        symbol = found.symbol
        low, high = symbol.type.range
        if symbol.tuning is not None:
            low, high = float(symbol.tuning.low), float(symbol.tuning.high)
        return Signal(found.label, symbol.type, symbol.length, low, high, found.read, found.write, found.write)
