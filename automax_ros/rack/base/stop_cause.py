"""How a rack stands after what was done to it: powered, stopped by what, which tasks ran."""

from __future__ import annotations

from dataclasses import dataclass

STOP_ALL = "STOP ALL"
"""How the line of a stop begins."""


KEEP_STATE = "keep_state"
"""The ``detail`` of a reload that carries values over."""


class OperationRefused(Exception):
    """An operation cannot be carried out now; the text says why and what to do."""


@dataclass(frozen=True)
class StopCause:
    """What stopped all tasks: ``code`` is the hardware's, None where none is known, ``task`` who caused it, or ""."""

    time_ns: int
    reason: str
    code: str | None = None
    task: str = ""

    @property
    def title(self) -> str:
        """What stands on a status line: STOP ALL, with the hardware's code where one is known."""
        return STOP_ALL if self.code is None else f"{STOP_ALL} (code {self.code})"

    @property
    def is_fault(self) -> bool:
        """Whether a fault stopped the rack: it has a code or a task, a command has neither."""
        return self.code is not None or bool(self.task)


@dataclass(frozen=True)
class PowerReturn:
    """When the power comes back by itself (ns), and whether the battery was good meanwhile."""

    at_ns: int
    battery: bool = True


@dataclass(frozen=True)
class OperationsState:
    """How a rack stands: all that its operations leave, apart from what tasks and memory hold.

    ``ran_at_power_off`` are the tasks that AUTO RUN starts again, ``deleted`` those that were taken out.
    """

    powered: bool = True
    battery_good: bool = True
    stopped: StopCause | None = None
    ran_at_power_off: frozenset[str] = frozenset()
    deleted: frozenset[str] = frozenset()
    power_return: PowerReturn | None = None
