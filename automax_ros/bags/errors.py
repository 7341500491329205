"""What can go wrong with a recording, as errors that say where and what to do."""

from __future__ import annotations

from automax_ros.core.text import printable


class BagError(Exception):
    """A recording cannot be read, understood or exported.

    ``code`` is the problem's code (AMX68nn), ``place`` names the file or folder, ``hint`` says what to do.
    """

    def __init__(self, code: str, place: object, message: str, hint: str | None = None) -> None:
        super().__init__(code, place, message, hint)
        self.code = code
        self.place = printable(str(place))
        self.message = printable(message)
        self.hint = printable(hint or "")

    def __str__(self) -> str:
        text = f"{self.place}: error[{self.code}]: {self.message}"
        return f"{text}\n  hint: {self.hint}" if self.hint else text


class RecordingError(BagError):
    """A recording cannot be started or written."""
