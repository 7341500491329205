"""What a person can mend, as exceptions that say what is wrong, where, and what to do."""

from __future__ import annotations

from automax_ros.core.text import printable


class UserError(Exception):
    """Something that the person who uses the emulator can mend.

    ``message`` is the sentence alone, ``hint`` what to do about it, ``code`` the problem's code (AMXnnnn, "" where it
    has none) and ``place`` the file, with its line where it has lines. ``str()`` gives all of it, as it is printed.
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
