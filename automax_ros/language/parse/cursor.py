"""Steps through the tokens of one logical line; the only place where syntax errors are raised."""

from __future__ import annotations

from collections.abc import Callable
from typing import NoReturn, TypeVar

from automax_ros.core.diagnostics import Note, Span
from automax_ros.core.text import did_you_mean, printable
from automax_ros.core.types import NAME_LIMIT, bare_name
from automax_ros.language.text.reporter import Reporter, SyntaxFaultError
from automax_ros.language.text.tokens import RESERVED_WORDS, SourceFault, Token, TokenKind

_Item = TypeVar("_Item")


class Cursor:
    """A place in a list of tokens that ends with an END token."""

    def __init__(self, tokens: list[Token], reporter: Reporter, long_names: set[str]) -> None:
        self.tokens = tokens
        self.position = 0
        self.reporter = reporter
        self._long_names = long_names

    @property
    def current(self) -> Token:
        """The token to be read next."""
        return self.tokens[self.position]

    @property
    def following(self) -> Token:
        """The token after the current one."""
        return self.tokens[min(self.position + 1, len(self.tokens) - 1)]

    @property
    def previous(self) -> Token:
        """The token read last."""
        return self.tokens[max(self.position - 1, 0)]

    def advance(self) -> Token:
        """Read a token; the END token stays the current one."""
        token = self.tokens[self.position]
        if token.kind is not TokenKind.END:
            self.position += 1
        return token

    def at(self, *texts: str) -> bool:
        """Return whether the current token is one of these words or marks."""
        return self.tokens[self.position].text in texts

    def accept(self, text: str) -> bool:
        """Read the word or mark if it is the current token."""
        if self.tokens[self.position].text == text:
            self.position += 1
            return True
        return False

    def separated(self, read: Callable[[], _Item]) -> tuple[_Item, ...]:
        """Read one item or more with commas between them."""
        items = [read()]
        while self.accept(","):
            items.append(read())
        return tuple(items)

    def at_end(self) -> bool:
        """Return whether a statement can end here."""
        return self.tokens[self.position].kind.ends_statement

    def at_line_end(self) -> bool:
        """Return whether the logical line ends here."""
        return self.tokens[self.position].kind is TokenKind.END

    def at_separator(self) -> bool:
        """Return whether the current token separates two statements."""
        return self.tokens[self.position].kind is TokenKind.SEPARATOR

    def fail(self, code: str, message: str, hint: str | None = None, notes: tuple[Note, ...] = ()) -> NoReturn:
        """Raise a syntax error at the current token; a token with a fault raises that fault."""
        token = self.current
        if token.kind is TokenKind.ERROR and token.fault is not None:
            raise SyntaxFaultError(token.fault, token.span)
        raise SyntaxFaultError(SourceFault(code, message, hint), self.here(), notes)

    def here(self) -> Span:
        """The span of the current token; at the end of a line the place after the last character."""
        return self.current.span

    def found(self) -> str:
        """The current token, for a message."""
        token = self.current
        if token.kind is TokenKind.END:
            return "the end of the line"
        if token.kind is TokenKind.REMARK:
            return "a remark"
        text = printable(token.text)
        return f"`{text}`" if len(text) <= 40 else f"`{text[:40]}...`"

    def expect(self, text: str, code: str, message: str, hint: str | None = None) -> Token:
        """Read the word or mark, or raise a syntax error; a misspelt word gets a suggestion."""
        if self.current.text != text:
            if hint is None and text.isalpha() and self.current.kind is TokenKind.WORD:
                hint = did_you_mean(self.current.text, (text,))
            self.fail(code, message, hint)
        return self.advance()

    def expect_end(self) -> None:
        """Raise a syntax error unless the statement ends here."""
        if self.at_end():
            return
        token = self.current
        if token.text == ":":
            self.fail("AMX0037", "`:` does not separate statements", "statements on one line are separated by `\\`")
        if token.text in (")", "]"):
            self.fail("AMX0043", f"`{token.text}` closes nothing")
        hint = None
        if token.text == ";":
            hint = "statements on one line are separated by `\\`, a remark begins with `!`"
        elif token.text == "REM":
            hint = "put `\\` before REM"
        elif token.is_name and self.previous.is_name and self.previous.text not in RESERVED_WORDS:
            hint = "names have no blanks; statements on one line are separated by `\\`"
        self.fail("AMX0036", f"{self.found()} is not expected here", hint)

    def check_name(self, token: Token) -> str:
        """Return a variable's name; one that is too long is reported once."""
        name = token.text
        if len(bare_name(name)) > NAME_LIMIT and name not in self._long_names:
            self._long_names.add(name)
            message = f"a name has at most {NAME_LIMIT} characters, here {len(bare_name(name))}"
            self.reporter.report(SourceFault("AMX0028", message, "shorten it everywhere in the rack"), token.span)
        return name

    def skip_statement(self) -> None:
        """Move to the end of a statement that could not be read."""
        while self.current.kind is not TokenKind.END and self.current.kind is not TokenKind.SEPARATOR:
            self.position += 1

    def skip_line(self) -> None:
        """Move to the end of the logical line."""
        self.position = len(self.tokens) - 1
