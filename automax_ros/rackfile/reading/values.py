"""Values in a rack file, each checked in its place: text, numbers, TRUE and FALSE, sections with known keys.

A ``Key`` is declared once: its JSON schema and the reading of its value, with limits, problem code and texts.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Generic, TypeGuard, TypeVar

from automax_ros.core import json_schema
from automax_ros.core.diagnostics import Diagnostic, Note, Span, in_order
from automax_ros.core.problems import PROBLEMS, Severity
from automax_ros.core.text import did_you_mean, quoted
from automax_ros.core.types import DataType
from automax_ros.core.values import is_number, number, value_of, whole_number
from automax_ros.core.yaml_text import Flaw, Node, Scalar, YamlMapping, YamlSequence

MAX_FINDINGS = 200
"""Most errors, and most warnings, that one file reports (decision: more are not read; hostile files have millions)."""
_YAML_CODES = {Flaw.SYNTAX: "AMX6003", Flaw.EXTRA: "AMX6004", Flaw.SIZE: "AMX6005"}
_OCTAL = re.compile(r"[-+]?0+[0-9]")
"""Leading zeros make YAML read another number."""
_N = TypeVar("_N", int, float)
_T = TypeVar("_T")
_T_co = TypeVar("_T_co", covariant=True)
Entry = tuple[Scalar, Node]


class ProblemList:
    """The diagnostics of one file so far: at most ``most_errors`` errors and ``MAX_FINDINGS`` warnings."""

    def __init__(self, most_errors: int = MAX_FINDINGS) -> None:
        self._items: dict[Severity, list[Diagnostic]] = {Severity.ERROR: [], Severity.WARNING: []}
        self._most = {Severity.ERROR: most_errors, Severity.WARNING: MAX_FINDINGS}
        self._refused: set[Span] = set()
        self._lower_case = False

    def add(self, code: str, message: str, span: Span, hint: str | None = None, notes: tuple[Note, ...] = ()) -> None:
        """Report a problem, unless the YAML at this very place was already refused."""
        if span in self._refused:
            return
        severity = PROBLEMS[code].severity
        items = self._items[severity]
        if len(items) < self._most[severity]:
            items.append(Diagnostic(code, message, span, hint=hint, notes=notes))

    def refuse(self, code: str, message: str, span: Span, hint: str | None = None) -> None:
        """Report that the text at a place is refused; later problems of that place are not reported."""
        self.add(code, message, span, hint)
        self._refused.add(span)

    def yaml_flaw(self, flaw: Flaw, message: str, span: Span, hint: str | None) -> None:
        """Report a flaw from ``read_yaml``: AMX6003 syntax, AMX6004 parts of YAML that are not read, AMX6005 size."""
        report = self.refuse if flaw is Flaw.EXTRA else self.add
        report(_YAML_CODES[flaw], message, span, hint)

    def upper_case(self, text: str, span: Span) -> str:
        """Return a name of the rack in upper case; warn at the first that was not (semantics, BASIC)."""
        upper = text.upper() if text.isascii() else text
        if upper != text and not self._lower_case:
            self._lower_case = True
            message = f"name {quoted(text)} is read as {quoted(upper)}, and so are all others in this file"
            self.add("AMX6411", message, span, "the rack's names are in upper case")
        return upper

    @property
    def errors(self) -> int:
        """Number of errors so far, at most ``most_errors``."""
        return len(self._items[Severity.ERROR])

    def in_order(self) -> list[Diagnostic]:
        """Return the diagnostics sorted by place."""
        return in_order(self._items[Severity.ERROR] + self._items[Severity.WARNING])


def kind_of(node: Node) -> str:
    """Return the kind of a node in words, for messages that expected another."""
    if isinstance(node, YamlMapping):
        return "keys and values"
    if isinstance(node, YamlSequence):
        return "a list"
    if node.is_null:
        return "nothing"
    return quoted(node.text) if node.plain else f"the text {quoted(node.text)}"


def wrong_kind(node: Node, what: str, wanted: str, findings: ProblemList, hint: str | None = None) -> None:
    """Report that ``what`` is not of the required kind."""
    findings.add("AMX6008", f"{what} must be {wanted}, not {kind_of(node)}", node.span, hint)


def text_value(node: Node, what: str, findings: ProblemList, *, limit: int) -> str | None:
    """Return a text of one line with at most ``limit`` characters; quotes are optional."""
    if not isinstance(node, Scalar) or node.is_null:
        wrong_kind(node, what, "text", findings)
        return None
    if not is_clean(node.text):
        findings.add("AMX6010", f"{what} has characters that cannot be printed, or more than one line", node.span)
        return None
    if len(node.text) > limit:
        message = f"{what} has {len(node.text)} characters; it may have at most {limit}"
        findings.add("AMX6010", message, node.span)
        return None
    return node.text


def is_clean(text: str) -> bool:
    """Return whether a text has only printable characters and tabs: nothing that ends a line or breaks an encoding."""
    return all(char.isprintable() or char == "\t" for char in text)


def boolean_value(node: Node, what: str, findings: ProblemList) -> bool | None:
    """Return true or false."""
    value = value_of(node.text, DataType.BOOLEAN) if is_plain_word(node) else None
    if not isinstance(value, bool):
        wrong_kind(node, what, "true or false", findings)
        return None
    return value


def integer_value(node: Node, what: str, findings: ProblemList, *, low: int, high: int, code: str) -> int | None:
    """Return a whole number from ``low`` to ``high``; ``code`` is the problem of one outside this range."""
    return _number(node, what, findings, "a whole number", whole_number, low, high, code)


def number_value(node: Node, what: str, findings: ProblemList, *, low: float, high: float, code: str) -> float | None:
    """Return a number from ``low`` to ``high``; ``code`` is the problem of one outside this range."""
    return _number(node, what, findings, "a number", number, low, high, code)


def is_plain_word(node: Node) -> TypeGuard[Scalar]:
    """Return whether a node is a value without quotes, and without the leading zeros that YAML reads as octal."""
    return isinstance(node, Scalar) and node.plain and not _OCTAL.match(node.text)


def _number(
    node: Node,
    what: str,
    findings: ProblemList,
    word: str,
    read: Callable[[str], _N],
    low: float,
    high: float,
    code: str,
) -> _N | None:
    try:
        if not is_plain_word(node):
            raise ValueError
        value = read(node.text)
    except ValueError:
        wrong_kind(node, what, word, findings, number_hint(node))
        return None
    if not low <= value <= high:
        message = f"{what} is {quoted(node.text, marks='')}; it must be {low:g} to {high:g}"
        findings.add(code, message, node.span)
        return None
    return value


def number_hint(node: Node) -> str | None:
    """Return a hint for a value that looks like a number but is not read as one."""
    if not isinstance(node, Scalar) or len(node.text) > 60:
        return None
    if not node.plain and is_number(node.text):
        return f"write {node.text} without quotes"
    digits = node.text.lstrip("+-")
    if node.plain and digits.startswith("0") and digits.isdecimal() and digits.strip("0"):
        return f"write {digits.lstrip('0')} without leading zeros"
    return None


def entries_of(node: Node, what: str, findings: ProblemList) -> tuple[Entry, ...] | None:
    """Return keys and values, () for a key without a value; None (reported) for anything else."""
    if isinstance(node, YamlMapping):
        return node.entries
    if isinstance(node, Scalar) and node.is_null:
        return ()
    wrong_kind(node, what, "keys and values", findings)
    return None


@dataclass(frozen=True)
class Key(Generic[_T_co]):
    """A key of a section: its schema, and ``read``, which returns its value, or None after it reported a problem.

    ``read`` is called with the node, its name in messages and the list of problems.
    """

    name: str
    schema: json_schema.Schema
    read: Callable[[Node, str, ProblemList], _T_co | None]


def number_key(name: str, text: str, low: float, high: float, code: str, default: float | None = None) -> Key[float]:
    """Return the key of a number; ``default`` is shown by the schema only."""
    limits: dict[str, Any] = {"low": low, "high": high, "code": code}
    schema = json_schema.number(text, low, high, default)
    return Key(name, schema, lambda node, what, findings: number_value(node, what, findings, **limits))


def whole_key(name: str, text: str, low: int, high: int, code: str, default: int | None = None) -> Key[int]:
    """Return the key of a whole number; ``default`` is shown by the schema only."""
    limits: dict[str, Any] = {"low": low, "high": high, "code": code}
    schema = json_schema.whole(text, low, high, default)
    return Key(name, schema, lambda node, what, findings: integer_value(node, what, findings, **limits))


def flag_key(name: str, text: str, *, usual: bool = False) -> Key[bool]:
    """Return the key of true or false; ``usual`` is shown by the schema only."""
    return Key(name, json_schema.flag(text, usual), boolean_value)


def text_key(name: str, schema: json_schema.Schema, limit: int = 100) -> Key[str]:
    """Return the key of a text of one line, at most ``limit`` characters, unless the schema has a smaller limit."""
    most = min(limit, schema.get("maxLength", limit))
    return Key(name, schema, lambda node, what, findings: text_value(node, what, findings, limit=most))


def choice_key(
    name: str,
    text: str,
    known: Mapping[str, _T],
    wrong: tuple[str, str],
    hint: Callable[[str], str | None] | None = None,
    default: str | None = None,
) -> Key[_T]:
    """Return the key of one of some words, each with its value.

    ``wrong`` are code and message for any other word, in which ``{what}`` and ``{given}`` are replaced; ``hint`` makes
    the remedy from the word.
    """

    def read(node: Node, what: str, findings: ProblemList) -> _T | None:
        word = text_value(node, what, findings, limit=100)
        if word is not None and word not in known:
            message = wrong[1].format(what=what, given=quoted(word))
            findings.add(wrong[0], message, node.span, hint(word) if hint is not None else None)
        return None if word is None else known.get(word)

    return Key(name, json_schema.words(text, known, default), read)


def schemas(*keys: Key[Any]) -> dict[str, json_schema.Schema]:
    """Return the schemas of keys by their names."""
    return {key.name: key.schema for key in keys}


class Section:
    """A mapping whose keys have fixed names.

    Reports AMX6006 for a repeated key and AMX6007 for an unknown key. ``owner`` names the section in messages about its
    values, ``findings`` is the list of problems, ``well_formed`` whether the node has keys and values.
    """

    def __init__(
        self,
        node: Node,
        what: str,
        known: Collection[str],
        findings: ProblemList,
        hints: Mapping[str, str] | None = None,
        owner: str | None = None,
    ) -> None:
        """Sort the entries of a node; ``what`` names the section in messages, ``known`` are its keys.

        ``hints`` have, for unknown keys that users may try, the right ones. ``owner`` is ``what`` if not given, "" if
        messages about values name the key alone.
        """
        self.owner, self.findings = what if owner is None else owner, findings
        self._values: dict[str, Entry] = {}
        entries = entries_of(node, what, findings)
        self.well_formed = entries is not None
        for key, value in entries or ():
            if key.text not in known:
                hint = (hints or {}).get(key.text) or did_you_mean(key.text, known)
                hint = hint or f"{what} has the keys {', '.join(known)}"
                findings.add("AMX6007", f"{what} has no key {quoted(key.text)}", key.span, hint)
            elif key.text in self._values:
                report_twice(key, f"key {quoted(key.text)} of {what}", self._values[key.text][0].span, findings)
            else:
                self._values[key.text] = (key, value)

    def __contains__(self, key: str) -> bool:
        return key in self._values

    def get(self, key: str) -> Node | None:
        """Return the value of a key, None if the file does not have it."""
        entry = self._values.get(key)
        return entry[1] if entry else None

    def read(self, key: Key[_T], owner: str | None = None) -> _T | None:
        """Return the value of a key, None if the file does not have it or a problem was reported."""
        node, owner = self.get(key.name), self.owner if owner is None else owner
        what = f"{key.name} of {owner}" if owner else key.name
        return None if node is None else key.read(node, what, self.findings)

    def read_all(self, keys: Iterable[Key[_T]]) -> dict[str, _T]:
        """Return the values of those keys that the file has, without those that have problems."""
        found = {key.name: self.read(key) for key in keys}
        return {name: value for name, value in found.items() if value is not None}

    def key_span(self, key: str) -> Span:
        """Return the place of a key that the section has."""
        return self._values[key][0].span

    def require(self, keys: Iterable[str], what: str, span: Span) -> bool:
        """Report AMX6009 if keys are missing from what is well formed; return whether all are there."""
        missing = [key for key in keys if key not in self._values]
        if missing and self.well_formed:
            word = "key" if len(missing) == 1 else "keys"
            names = ", ".join(quoted(key) for key in missing)
            self.findings.add("AMX6009", f"{what} lacks the {word} {names}", span)
        return not missing


def report_twice(key: Scalar, what: str, first: Span, findings: ProblemList, code: str = "AMX6006") -> None:
    """Report that something is defined a second time."""
    notes = (Note("first defined here", first),)
    findings.add(code, f"{what} is already defined in line {first.line}", key.span, notes=notes)
