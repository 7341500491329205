"""A row of the table of problems."""

from __future__ import annotations

import enum
from dataclasses import dataclass


class Severity(enum.Enum):
    """Whether a problem stops a source from running."""

    ERROR = "error"
    WARNING = "warning"


@dataclass(frozen=True)
class Problem:
    """One kind of problem.

    ``title`` is a short phrase in lower case; ``hardware`` is the code the real rack shows, if it is known.
    """

    code: str
    title: str
    severity: Severity = Severity.ERROR
    hardware: str | None = None

    @property
    def number(self) -> int:
        """The number in the code: 7001 of AMX7001."""
        return int(self.code.removeprefix("AMX"))
