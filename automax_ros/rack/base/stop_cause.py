"""Operating state of a rack: power, the cause of a stop, the tasks that ran."""

from __future__ import annotations

from dataclasses import dataclass

STOP_ALL = "STOP ALL"
"""Start of the text for a stop."""


KEEP_STATE = "keep_state"
"""The ``detail`` of a reload that carries values over."""
WITHOUT_BATTERY = "without battery"
"""The ``detail`` of a power-up after which non-volatile memory is lost too."""


class OperationRefused(Exception):
    """An operation cannot be carried out now; the text says why and what to do."""


@dataclass(frozen=True)
class StopCause:
    """Cause of a STOP ALL: ``code`` is the hardware's or None, ``task`` the one that caused it or ""."""

    time_ns: int
    reason: str
    code: str | None = None
    task: str = ""

    @property
    def title(self) -> str:
        """Text for a status line: STOP ALL, with the hardware's code if one is known."""
        return STOP_ALL if self.code is None else f"{STOP_ALL} (code {self.code})"

    @property
    def is_fault(self) -> bool:
        """Whether a fault stopped the rack: a fault has a code or a task, a command neither."""
        return self.code is not None or bool(self.task)


@dataclass(frozen=True)
class PowerReturn:
    """When the power returns automatically (ns), and whether the battery is good until then."""

    at_ns: int
    battery: bool = True


@dataclass(frozen=True)
class OperationsState:
    """What operations leave in a rack; AUTO RUN starts the tasks ``ran_at_power_off`` again."""

    powered: bool = True
    battery_good: bool = True
    stopped: StopCause | None = None
    ran_at_power_off: frozenset[str] = frozenset()
    deleted: frozenset[str] = frozenset()
    power_return: PowerReturn | None = None
