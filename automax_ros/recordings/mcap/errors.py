"""What can go wrong with a recording, as errors that say where and what to do."""

from __future__ import annotations

from automax_ros.core.faults import UserError
from automax_ros.core.text import printable


class BagError(UserError):
    """A recording cannot be read, understood or exported.

    ``code`` is AMX68nn, ``place`` names the file or folder, ``hint`` is "" where there is nothing to do.
    """

    hint: str

    def __init__(self, code: str, place: object, message: str, hint: str | None = None) -> None:
        super().__init__(printable(message), printable(hint or ""), code=code, place=printable(str(place)))


class RecordingError(BagError):
    """A recording cannot be started or written."""
