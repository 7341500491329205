"""What the panel shows: a rack in this process, a rack elsewhere, or a recording, with one interface.

Everything that a source returns is data for JSON: dicts with text keys, lists, texts, booleans, integers, and floats
(infinite ones and NaN as text). Texts are foreign: the page shows them as text, never as markup. docs/panel.md lists
the keys.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from automax_ros.core.types import Value
from automax_ros.core.user_error import UserError

Facts = Mapping[str, Any]
"""An object of JSON."""

MOST_NAMES = 1000
"""Most names that a browser watches at once (decision: a bound on what strangers send)."""


class RequestRefused(UserError):
    """A request of the page cannot be met: it says why, and what to do."""


@dataclass(frozen=True)
class Asked:
    """What one browser watches: names as ``automax ctl get`` takes them, and the time in a recording.

    ``at_ns`` is in ns since the start of the run; None is the present, or the end of a recording.
    """

    names: tuple[str, ...]
    at_ns: int | None = None


@dataclass(frozen=True)
class Frame:
    """The values of one ``Asked`` in its order; None where a value is not known. ``time_ns`` is their rack time."""

    time_ns: int
    values: tuple[Value | None, ...]


class Source(Protocol):
    """One source of the panel. All methods are called by one thread, never two at a time; they may take a while."""

    @property
    def is_over(self) -> bool:
        """Whether the rack has gone or its run has ended; values no longer change."""
        ...

    def hello(self) -> Facts:
        """Return what does not change while the panel is open: rack, names, tasks, plants, span."""

    def unknown(self, names: Sequence[str]) -> list[str]:
        """Return those of the names that mean nothing here."""

    def frames(self, asked: Sequence[Asked]) -> list[Frame]:
        """Return the values for each browser; a live rack is read once for all of them, under its lock."""

    def status(self, at_ns: int | None) -> Facts:
        """Return how the rack stands: slots, tasks, forces, drives, what stopped it. ``at_ns`` as in ``Asked``."""

    def log(self, after: int) -> list[Facts]:
        """Return errors and operations whose number ``n`` is greater than ``after``, oldest first."""

    def answer(self, what: str, fields: Facts) -> Facts:
        """Answer ``diagram``, ``scan``, ``history``, ``seek`` or ``explain``.

        Raises:
            RequestRefused: it cannot be answered; the message says why.
        """

    def describe(self, verb: str, fields: Facts) -> str:
        """Return in one sentence what an operation would do, with the values that it would replace.

        Raises:
            RequestRefused: the rack could not do it: no such name, not a value of its type.
        """

    def operate(self, verb: str, fields: Facts) -> Facts:
        """Operate the rack, as its own operator does; return ``ok``, ``reason`` and what is true afterwards.

        Raises:
            RequestRefused: the rack does not answer.
        """

    def close(self) -> None:
        """Release files, threads and the ROS node."""
