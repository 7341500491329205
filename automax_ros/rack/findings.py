"""Collects what is wrong with a rack file."""

from __future__ import annotations

from automax_ros.core.diagnostics import Diagnostic, Note, Span, in_order
from automax_ros.core.problems import PROBLEMS, Severity
from automax_ros.core.text import quoted
from automax_ros.core.yaml_text import Flaw

MAX_FINDINGS = 200
"""Most errors, and most warnings, that one file reports (decision: nobody reads more; hostile files have millions)."""
_YAML_CODES = {Flaw.SYNTAX: "AMX6003", Flaw.EXTRA: "AMX6004", Flaw.SIZE: "AMX6005"}


class Findings:
    """The diagnostics of one file so far."""

    def __init__(self) -> None:
        """Begin with none."""
        self._items: dict[Severity, list[Diagnostic]] = {Severity.ERROR: [], Severity.WARNING: []}
        self._refused: set[Span] = set()
        self._lower_case = False

    def add(self, code: str, message: str, span: Span, hint: str | None = None, notes: tuple[Note, ...] = ()) -> None:
        """Report a problem, unless the YAML at this very place was already refused as such."""
        if span in self._refused:
            return
        items = self._items[PROBLEMS[code].severity]
        if len(items) < MAX_FINDINGS:
            items.append(Diagnostic(code, message, span, hint=hint, notes=notes))

    def refuse(self, code: str, message: str, span: Span, hint: str | None = None) -> None:
        """Report that the text at a place cannot be taken for what it is; later problems of that place are not new."""
        self.add(code, message, span, hint)
        self._refused.add(span)

    def yaml_flaw(self, flaw: Flaw, message: str, span: Span, hint: str | None) -> None:
        """Report what ``read_yaml`` finds: AMX6003 syntax, AMX6004 parts of YAML that are not read, AMX6005 size."""
        report = self.refuse if flaw is Flaw.EXTRA else self.add
        report(_YAML_CODES[flaw], message, span, hint)

    def upper_case(self, text: str, span: Span) -> str:
        """Return a name of the rack in upper case; the first that was not gets a warning (semantics, BASIC)."""
        upper = text.upper() if text.isascii() else text
        if upper != text and not self._lower_case:
            self._lower_case = True
            message = f"name {quoted(text)} is read as {quoted(upper)}, and so are all others in this file"
            self.add("AMX6411", message, span, "the rack's names are in upper case")
        return upper

    @property
    def errors(self) -> int:
        """Number of errors so far, at most MAX_FINDINGS."""
        return len(self._items[Severity.ERROR])

    def in_order(self) -> list[Diagnostic]:
        """Return the diagnostics sorted by place."""
        return in_order(self._items[Severity.ERROR] + self._items[Severity.WARNING])
