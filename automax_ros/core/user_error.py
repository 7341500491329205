"""Errors that the user can correct, as exceptions with the error, its place and its remedy."""

from __future__ import annotations

from automax_ros.core.text import printable


class UserError(Exception):
    """An error that the user of the emulator can correct.

    ``message`` is the sentence alone, ``hint`` the remedy, ``code`` the problem's code (AMXnnnn, "" if it has none) and
    ``place`` the file, with its line if it has lines. ``str()`` gives all of it, as it is printed.
    """

    def __init__(self, message: str, hint: str | None = None, *, code: str = "", place: str = "") -> None:
        super().__init__(message)
        self.message = message
        self.hint = hint
        self.code = code
        self.place = place

    def __str__(self) -> str:
        head = f"{printable(self.place)}: " if self.place else ""
        head += f"error[{self.code}]: " if self.code and self.place else ""
        return f"{head}{self.message}\n  hint: {self.hint}" if self.hint else f"{head}{self.message}"


class UsageError(UserError):
    """The command cannot do what was asked: wrong arguments, or an unreadable file; exit code 2."""
