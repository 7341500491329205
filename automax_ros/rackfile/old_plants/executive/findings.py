"""Findings in the files of an old rack: a file and, in tables, the number of a record take the place of a line."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass, field

from automax_ros.core.problems import PROBLEMS, Severity
from automax_ros.core.text import printable, visible

MOST_FINDINGS = 1000
"""Most findings that are kept (decision: a bound on untrusted files)."""
_NAMED = 5


@dataclass(frozen=True)
class Finding:
    """A finding; ``record`` counts from 1, None if it concerns the whole file."""

    code: str
    message: str
    file: str
    record: int | None = None
    hint: str | None = None

    @property
    def severity(self) -> Severity:
        """ERROR or WARNING, from the table of problems."""
        return PROBLEMS[self.code].severity

    @property
    def place(self) -> str:
        """The file, with the record: ``$CARD.DBF record 3``."""
        return printable(self.file) + ("" if self.record is None else f" record {self.record}")

    def __str__(self) -> str:
        hint = f"\n  hint: {self.hint}" if self.hint else ""
        return visible(f"{self.place}: {self.severity.value}[{self.code}]: {self.message}{hint}")


@dataclass
class Findings:
    """Findings in the order in which they were made, at most ``MOST_FINDINGS``; ``left_out`` counts the others.

    ``errors`` counts those that are errors, left out or not.
    """

    items: list[Finding] = field(default_factory=list)
    left_out: int = 0
    errors: int = 0

    def add(self, code: str, message: str, file: str, record: int | None = None, hint: str | None = None) -> None:
        """Add a finding."""
        self._take(Finding(code, message, file, record, hint))

    def extend(self, others: Findings) -> None:
        """Add the findings of others after these."""
        for item in others.items:
            self._take(item)
        self.left_out += others.left_out
        self.errors += others.errors - sum(item.severity is Severity.ERROR for item in others.items)

    def _take(self, item: Finding) -> None:
        self.errors += item.severity is Severity.ERROR
        if len(self.items) < MOST_FINDINGS:
            self.items.append(item)
        else:
            self.left_out += 1

    @property
    def has_errors(self) -> bool:
        """Whether any of the findings is an error."""
        return self.errors > 0

    def lost_of(self, file: str) -> bool:
        """Return whether something of a file is lost (AMX6789)."""
        return any(item.code == "AMX6789" and item.file == file for item in self.items)


@dataclass
class Unplaced:
    """Records that do not come to their place in the rack file: those of a file with one reason are told together."""

    records: dict[tuple[str, str, str], list[int]] = field(default_factory=lambda: defaultdict(list))

    def add(self, file: str, reason: str, record: int, *, lost: bool = False) -> None:
        """Add a record; ``lost``: not even a plain common is left of it, which is an error (AMX6789, else AMX6795)."""
        self.records["AMX6789" if lost else "AMX6795", file, reason].append(record)

    def tell(self, findings: Findings) -> None:
        """Tell all, in the order of the first record of each reason."""
        for (code, file, reason), numbers in self.records.items():
            findings.add(code, f"{records_text(numbers)}: {reason}", file, numbers[0])


def records_text(numbers: Iterable[int]) -> str:
    """Return record numbers for a message: ``record 3``, ``records 3, 5 and 2 more``."""
    found = list(numbers)
    named = ", ".join(map(str, found[:_NAMED]))
    more = f" and {len(found) - _NAMED} more" if len(found) > _NAMED else ""
    return f"record{'' if len(found) == 1 else 's'} {named}{more}"
