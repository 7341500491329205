"""Modules that count how their interrupts keep their time. A file of its own: compiled code has no such protocols."""

from __future__ import annotations

from typing import Protocol, runtime_checkable

from automax_ros.rack.modules.drive import InterruptTiming


@runtime_checkable
class Timed(Protocol):
    """A module that counts how its interrupts keep their time."""

    @property
    def timing(self) -> InterruptTiming: ...  # noqa: D102
