"""Tokens, which the lexer passes to the parser, each with its place and, where it is wrong, its fault."""

from __future__ import annotations

import enum
from typing import NamedTuple

from automax_ros.core.diagnostics import Span


class TokenKind(enum.Enum):
    """The kinds of tokens; the values are their names in messages."""

    WORD = "word"
    NAME = "name with type character"
    INTEGER = "integer constant"
    REAL = "real constant"
    STRING = "string constant"
    OPERATOR = "operator"
    MARK = "punctuation mark"
    SEPARATOR = "\\"
    REMARK = "remark"
    CONTINUE = "&"
    ERROR = "error"
    END = "end of line"

    @property
    def ends_segment(self) -> bool:
        """Whether the line ends here, or the part of it before the next statement."""
        return self in (TokenKind.END, TokenKind.SEPARATOR)

    @property
    def ends_statement(self) -> bool:
        """Whether a statement can end before such a token."""
        return self in (TokenKind.END, TokenKind.SEPARATOR, TokenKind.REMARK)


class SourceFault(NamedTuple):
    """A problem of a token, which the parser reports when it reads the token."""

    code: str
    message: str
    hint: str | None = None


class Token(NamedTuple):
    """A token. ``text`` is in upper case and without blanks, ``value`` the value of a constant or the text of a remark.

    ``offset`` counts the characters of the logical line before it. A ``fault`` on an ERROR token ends its statement;
    on any other kind it is reported and the token is used as usual.
    """

    kind: TokenKind
    text: str
    line: int
    column: int
    end_column: int
    offset: int = 0
    value: int | float | str | None = None
    fault: SourceFault | None = None

    @property
    def span(self) -> Span:
        """Its place."""
        return Span(self.line, self.column, self.end_column)

    @property
    def is_name(self) -> bool:
        """A word, or a name with a type character."""
        return self.kind is TokenKind.WORD or self.kind is TokenKind.NAME


STATEMENT_WORDS = frozenset(
    {"LET", "IF", "ELSE", "END_IF", "FOR", "NEXT", "GOTO", "GOSUB", "RETURN", "ON", "READ", "DATA", "RESTORE", "PRINT"}
    | {"STOP", "EVENT", "CALL", "END", "REM", "LOCAL", "COMMON", "GLOBAL", "IOWRITE", "CLR_ERRLOG"}
)
"""Words that begin a statement of a control-block task."""

BASIC_TASK_WORDS = {
    "WAIT": "it suspends the task until an event",
    "DELAY": "it suspends the task for a time",
    "START": "SCAN_LOOP sets the period of a control-block task",
    "INPUT": "it waits for a message or for an operator",
    "GET": "it waits for a character",
    "PUT": "it can wait for the port",
    "OPEN": "it can wait for a port or a channel",
    "CLOSE": "ports are opened and closed by BASIC tasks",
}
"""Statements that belong to BASIC tasks only, each with the reason (3.2, decision: the section has no list).

They may name variables, as SET may: old control-block tasks use them so (decision).
"""

OPERATOR_WORDS = frozenset({"AND", "OR", "XOR", "NOT"})
BOOLEAN_WORDS = {"TRUE": True, "ON": True, "FALSE": False, "OFF": False}
RESERVED_WORDS = STATEMENT_WORDS | OPERATOR_WORDS | BOOLEAN_WORDS.keys() | {"THEN", "TO", "STEP"}
"""Words that cannot be the name of a REAL variable; with a type character they can (decision)."""
