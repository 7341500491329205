"""Collects the problems of one text."""

from __future__ import annotations

from automax_ros.core.diagnostics import Diagnostic, Note, Span
from automax_ros.language.text.tokens import SourceFault, Token

DIAGNOSTIC_LIMIT = 200
"""Most problems reported of one source; one more says that there are others (decision: more are not read)."""


class TooManyProblemsError(Exception):
    """Ends the parse of a text that has more than DIAGNOSTIC_LIMIT problems."""


class SyntaxFaultError(Exception):
    """Ends the parse of one statement; has the fault and its place."""

    def __init__(self, fault: SourceFault, span: Span, notes: tuple[Note, ...] = ()) -> None:
        super().__init__(fault.message)
        self.fault = fault
        self.span = span
        self.notes = notes


class Reporter:
    """The list of diagnostics; ``statement`` is the BASIC line number in force."""

    def __init__(self) -> None:
        self.diagnostics: list[Diagnostic] = []
        self.statement: int | None = None

    def report(self, fault: SourceFault, span: Span, notes: tuple[Note, ...] = ()) -> None:
        """Add a problem; raises TooManyProblemsError at the limit."""
        if len(self.diagnostics) >= DIAGNOSTIC_LIMIT:
            message = f"more than {DIAGNOSTIC_LIMIT} problems: the rest of the text is not checked"
            self.diagnostics.append(Diagnostic("AMX0002", message, span, self.statement))
            raise TooManyProblemsError
        self.diagnostics.append(Diagnostic(fault.code, fault.message, span, self.statement, fault.hint, notes))

    def report_token(self, token: Token) -> None:
        """Add the fault of a token, if any."""
        if token.fault is not None:
            self.report(token.fault, token.span)
