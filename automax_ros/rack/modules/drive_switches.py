"""The switches on the front of a 57C406 (52.1.6): a test switch A, centre, B, and a fault reset switch.

Both are momentary: they go back when they are let go. A person holds the test switch where it was moved to until it is
moved to the centre; the fault reset switch is pressed for half a second, or as long as ``false`` says (decision). They
only tell: what they do is the application's business.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from automax_ros.drive.cml.signals import RESET_SWITCH, SWITCH_A, SWITCH_B
from automax_ros.rack.modules.running import ModuleState
from automax_ros.running.scheduler import EventClass, EventKey, ScheduledEvent, Scheduler

PRESSED_NS = 500_000_000
"""How long the fault reset switch is pressed, ns (decision)."""
TEST_SWITCH, FAULT_RESET_SWITCH = "test_switch", "fault_reset_switch"
CONTROLS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {TEST_SWITCH: ("A", "B", "centre"), FAULT_RESET_SWITCH: ("true", "false")}
)
"""The switches with their positions, as stimuli files and commands write them."""
_TEST_BITS = {"A": SWITCH_A, "B": SWITCH_B, "centre": 0}


class FrontSwitches:
    """The switches of one module."""

    def __init__(self, scheduler: Scheduler, slot: int) -> None:
        """Begin with nobody at them."""
        self._scheduler = scheduler
        self._key = EventKey(EventClass.IO, slot, "switch")
        self._test = "centre"
        self._release: ScheduledEvent | None = None

    def status(self) -> int:
        """Return the bits of ``Measured.status`` that they set."""
        return _TEST_BITS[self._test] | (RESET_SWITCH if self._release is not None else 0)

    def move(self, switch: str, position: str) -> None:
        """Move a switch to one of its positions in ``CONTROLS``."""
        if switch == TEST_SWITCH:
            self._test = position
        else:
            self._let_go(0)
            if position == "true":
                self._press(self._scheduler.now_ns + PRESSED_NS)

    def state(self) -> dict[str, object]:
        """Return how they stand, and when the fault reset switch is let go, ns."""
        until_ns = None if self._release is None else self._scheduler.due_ns(self._release)
        return {"test": self._test, "pressed_until_ns": until_ns}

    def load(self, state: ModuleState) -> None:
        """Take over a state."""
        self._let_go(0)
        self._test = state["test"]
        if state["pressed_until_ns"] is not None:
            self._press(state["pressed_until_ns"])

    def _press(self, until_ns: int) -> None:
        self._release = self._scheduler.at(until_ns, self._key, self._let_go)

    def _let_go(self, _: int) -> None:
        if self._release is not None:
            self._release.cancel()
            self._release = None
