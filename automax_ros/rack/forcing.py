"""The forces of a rack: which variables may be held, how many, and which are (J2-3106-1 p. 18-10).

A force holds a simple common of any type but STRING against every write, until it is released; it survives STOP ALL and
power. A task's own variables cannot be forced (decision: a compiled scan keeps them to itself).
"""

from __future__ import annotations

from dataclasses import dataclass

from automax_ros.core.types import DataType, Value
from automax_ros.rack.config import RackConfig
from automax_ros.rack.executive import most_forces, version_text
from automax_ros.rack.names import PREDEFINED
from automax_ros.running.memory import FORCING, CommonMemory
from automax_ros.running.views import MemoryValueError


@dataclass(frozen=True)
class Force:
    """A line of the force table: a common and the value at which it is held."""

    name: str
    value: Value


class Forcing:
    """Forces the commons of one rack, within what its Executive allows."""

    def __init__(self, config: RackConfig, memory: CommonMemory) -> None:
        """Take a rack's common memory."""
        self._config, self._memory = config, memory
        self.most = most_forces(config.executive)

    def table(self) -> list[Force]:
        """Return what is forced, in the order of the rack file."""
        memory = self._memory
        held = sorted(memory.forced)
        return [Force(memory.specs[view].name, memory.read_now(view, element)) for view, element in held]

    def force(self, name: str, value: Value, writer: int) -> None:
        """Hold a common at a value; one that is held already gets the new value.

        Raises:
            KeyError: the rack has no such variable.
            MemoryValueError: the value does not fit, the variable cannot be forced, or as many are forced as may be.
        """
        view = self._memory.view(name)
        reason = self._why_not(view)
        if reason is not None:
            raise MemoryValueError(f"{name} cannot be forced: {reason}")
        self._memory.force(view, value, writer=writer)

    def release(self, name: str, writer: int) -> None:
        """End a force; the value stays until the next write.

        Raises:
            KeyError: the rack has no such variable.
        """
        self._memory.release(self._memory.view(name), writer=writer)

    def _why_not(self, view: int) -> str | None:
        memory = self._memory
        spec = memory.specs[view]
        if spec.is_array or spec.type is DataType.STRING:
            return "it is an array" if spec.is_array else "it is a string"
        if spec.name == FORCING:
            return "it shows whether anything is forced"
        if spec.name in PREDEFINED:
            return "the rack itself writes it"
        others = memory.registers.others(view)
        if others:
            return f"{memory.specs[others[0]].name} is part of the same register"
        if len(memory.forced) >= self.most and not memory.is_forced(view):
            version = version_text(self._config.executive)
            return f"{self.most} variables are forced, the most with executive {version}: release one first"
        return None
