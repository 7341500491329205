"""What a lifecycle manager may ask of a rack that another program holds as a library (``RackNodes``)."""

from __future__ import annotations

from typing import Protocol

from automax_ros.nodes.managed import ACTIVATE, DEACTIVATE, Pending, TransitionRefused
from automax_ros.nodes.managed_module import NOT_OPERATED
from automax_ros.rack.rack import Rack
from automax_ros.rack.standing import OperationRefused


class Held(Protocol):
    """A rack with its nodes."""

    rack: Rack

    @property
    def has_begun(self) -> bool:
        """Whether the program has started it."""
        ...

    def activate(self) -> Pending | None:
        """Put all tasks that rest into RUN."""
        ...

    def deactivate(self) -> None:
        """STOP ALL."""
        ...


class HeldRack:
    """RUN and STOP ALL of a started rack; its program alone starts, closes and exchanges it (decision)."""

    def __init__(self, held: Held) -> None:
        self._held = held

    def refusal(self, transition: str) -> str | None:
        """Return why a transition is refused."""
        if not self._held.rack.config.operator:
            return NOT_OPERATED
        if transition not in (ACTIVATE, DEACTIVATE) or not self._held.has_begun:
            return "the program that holds this rack starts and closes it"
        return None

    def activate(self) -> Pending | None:
        """Put all tasks that rest into RUN."""
        try:
            return self._held.activate()
        except OperationRefused as refused:
            raise TransitionRefused(str(refused)) from refused

    def deactivate(self) -> None:
        """STOP ALL."""
        try:
            self._held.deactivate()
        except OperationRefused as refused:
            raise TransitionRefused(str(refused)) from refused

    def configure(self) -> None:
        """Nothing is left to configure."""

    def cleanup(self) -> None:
        """Nothing is left."""

    def shutdown(self) -> None:
        """Nothing ends."""

    def fail(self) -> None:
        """STOP ALL, so that no output stays on."""
        if self._held.rack.operations.powered:
            self._held.deactivate()
