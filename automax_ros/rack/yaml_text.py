"""YAML as rack files use it: mappings, lists and single values with their places, and nothing that can do harm.

The file is read event by event with PyYAML's parser, never constructed: no tag makes an object, no alias multiplies,
nesting and size are bounded, and a key such as ``NO`` or a model such as ``57E413`` stays the text that it is.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TypeAlias

import yaml

from automax_ros.core.diagnostics import SourceText, Span
from automax_ros.core.text import quoted
from automax_ros.rack.findings import Findings

MAX_DEPTH = 16
"""Deepest nesting of a YAML file (decision: a rack file needs 6)."""
MAX_NODES = 100_000
"""Most keys and values of a YAML file (decision: reading them takes seconds; 16-bit ids tell more variables apart)."""


@dataclass(frozen=True)
class Scalar:
    """A single value. ``plain`` is FALSE where it stands in quotes or in a block of text."""

    text: str
    plain: bool
    span: Span

    @property
    def is_null(self) -> bool:
        """Whether nothing was given."""
        return self.plain and self.text in ("", "~", "null", "Null", "NULL")


@dataclass(frozen=True)
class Sequence:
    """A list."""

    items: tuple[Node, ...]
    span: Span


@dataclass(frozen=True)
class Mapping:
    """Keys and values in the order of the file; a key may be there twice."""

    entries: tuple[tuple[Scalar, Node], ...]
    span: Span


Node: TypeAlias = "Scalar | Sequence | Mapping"


class _TooMuch(Exception):
    """The file is nested too deep or has too many values; reading cannot go on."""


def read_yaml(source: SourceText, findings: Findings) -> Node | None:
    """Return the tree of a text, None if it could not be read to its end.

    Reports AMX6003 syntax, AMX6004 a part of YAML that rack files do not use, AMX6005 too deep or too many values.
    """
    return _Reader(source, findings).read()


class _Places:
    """Turns PyYAML's marks into spans: PyYAML also ends lines at characters that editors do not count."""

    def __init__(self, text: str) -> None:
        self._length = len(text)
        self._starts = [0]
        for index, char in enumerate(text):
            if char == "\n" or (char == "\r" and text[index + 1 : index + 2] != "\n"):
                self._starts.append(index + 1)

    def position(self, index: int) -> tuple[int, int]:
        """Return line and column (from 1) of the character at an index (from 0)."""
        index = min(max(index, 0), self._length)
        line = bisect_right(self._starts, index)
        return line, index - self._starts[line - 1] + 1

    def span(self, start: int, end: int) -> Span:
        """Return the span between two indices, cut off at the end of its first line."""
        line, column = self.position(start)
        last_line, last_column = self.position(end)
        if last_line != line:
            last_column = self._starts[line] - self._starts[line - 1]
        return Span(line, column, max(last_column, column + 1))


class _Reader:
    def __init__(self, source: SourceText, findings: Findings) -> None:
        self._text = source.text
        self._places = _Places(source.text)
        self._findings = findings
        self._nodes = 0

    def read(self) -> Node | None:
        try:
            return self._document(iter(yaml.parse(self._text, Loader=yaml.SafeLoader)))
        except _TooMuch:
            return None
        except yaml.MarkedYAMLError as error:
            self._syntax_error(error)
        except yaml.reader.ReaderError as error:
            span = self._places.span(error.position, error.position + 1)
            self._findings.add("AMX6003", f"character U+{ord(self._text[error.position]):04X} is not allowed", span)
        except (ValueError, OverflowError):
            self._findings.add("AMX6003", "a value that YAML cannot read", Span(1, 1, 2))
        return None

    def _syntax_error(self, error: yaml.MarkedYAMLError) -> None:
        mark = error.problem_mark or error.context_mark
        span = self._places.span(mark.index, mark.index + 1) if mark else Span(1, 1, 2)
        message = quoted(error.problem or "not YAML", marks="", limit=120)
        context = f"{quoted(error.context, marks='', limit=80)}: " if error.context else ""
        self._findings.add("AMX6003", f"{context}{message}", span, hint=self._hint(mark.index if mark else 0))

    def _hint(self, index: int) -> str | None:
        char = self._text[index : index + 1]
        if char == "\t":
            return "indent with blanks, not tabs"
        if char in ("%", "@", "`"):
            return f"a value that begins with {char} needs quotes"
        return "check the indentation, and that every key ends in a colon and a blank"

    def _document(self, events: Iterator[yaml.Event]) -> Node | None:
        root: Node | None = None
        for event in events:
            if isinstance(event, yaml.DocumentStartEvent):
                if root is not None:
                    self._refuse("a second document", event, "a file describes one rack; remove what follows '---'")
                    return root
                root = self._node(next(events), events, 1)
        return root if root is not None else Scalar("", True, Span(1, 1, 2))

    def _node(self, event: yaml.Event, events: Iterator[yaml.Event], depth: int) -> Node:
        self._nodes += 1
        if depth > MAX_DEPTH:
            self._too_much(f"nested deeper than {MAX_DEPTH} levels", event)
        if self._nodes > MAX_NODES:
            self._too_much(f"more than {MAX_NODES} keys and values", event)
        self._refuse_extras(event)
        if isinstance(event, yaml.SequenceStartEvent):
            return self._sequence(event, events, depth)
        if isinstance(event, yaml.MappingStartEvent):
            return self._mapping(event, events, depth)
        if isinstance(event, yaml.ScalarEvent):
            return Scalar(event.value, event.style is None, self._span(event))
        return Scalar("", True, self._span(event))

    def _refuse_extras(self, event: yaml.Event) -> None:
        """Report an alias, which is read as nothing, and anchors and tags, which are read as if they were not there."""
        anchor, tag = getattr(event, "anchor", None), getattr(event, "tag", None)
        if isinstance(event, yaml.AliasEvent):
            self._refuse(f"the alias {quoted(f'*{anchor}')}", event, "write the value again")
            return
        if anchor is not None:
            self._refuse(f"the anchor {quoted(f'&{anchor}')}", event, "rack files have no anchors: remove it")
        if tag is not None:
            self._refuse(f"the tag {quoted(tag)}", event, "rack files have no tags: remove it")

    def _sequence(self, start: yaml.Event, events: Iterator[yaml.Event], depth: int) -> Sequence:
        items: list[Node] = []
        for event in events:
            if isinstance(event, yaml.SequenceEndEvent):
                break
            items.append(self._node(event, events, depth + 1))
        return Sequence(tuple(items), self._span(start))

    def _mapping(self, start: yaml.Event, events: Iterator[yaml.Event], depth: int) -> Mapping:
        entries: list[tuple[Scalar, Node]] = []
        for event in events:
            if isinstance(event, yaml.MappingEndEvent):
                break
            key = self._node(event, events, depth + 1)
            value = self._node(next(events), events, depth + 1)
            if not isinstance(key, Scalar):
                self._findings.refuse("AMX6004", "a key must be a single word", key.span)
            elif key.plain and key.text == "<<":
                self._findings.refuse("AMX6004", "rack files have no merge key", key.span, "write the values again")
            else:
                entries.append((key, value))
        return Mapping(tuple(entries), self._span(start))

    def _refuse(self, what: str, event: yaml.Event, hint: str) -> None:
        self._findings.refuse("AMX6004", f"{what} is not allowed in a rack file", self._span(event), hint)

    def _too_much(self, message: str, event: yaml.Event) -> None:
        self._findings.add("AMX6005", message, self._span(event))
        raise _TooMuch

    def _span(self, event: yaml.Event) -> Span:
        start, end = event.start_mark, event.end_mark
        return self._places.span(start.index, end.index) if start and end else Span(1, 1, 2)
