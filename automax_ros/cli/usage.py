"""What is wrong with how the command was used."""

from __future__ import annotations


class UsageError(Exception):
    """The command cannot do what it was told: wrong arguments, or an unreadable file; exit code 2."""

    def __init__(self, message: str, hint: str | None = None) -> None:
        super().__init__(message)
        self.hint = hint

    def __str__(self) -> str:
        text = str(self.args[0])
        return f"{text}\n  hint: {self.hint}" if self.hint else text
