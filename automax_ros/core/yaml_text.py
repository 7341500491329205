"""Reads and writes YAML safely: mappings, lists and single values with their places.

A text is read event by event with PyYAML's parser, never constructed: no tag makes an object, no alias multiplies,
nesting and size are bounded, and a key such as ``NO`` or a model such as ``57E413`` stays a text. Rack files are read
this way for their places, which PyYAML does not give with its data, descriptions of recordings for the bounds. A tree
that is written as text again is read by ``read_yaml`` as the same tree apart from places; remarks are lost.
"""

from __future__ import annotations

import enum
import re
from bisect import bisect_right
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, TypeAlias

import yaml

from automax_ros.core.diagnostics import Span
from automax_ros.core.text import quoted
from automax_ros.core.user_error import UserError

MAX_DEPTH = 16
"""Deepest nesting (decision: a rack file needs 6, the description of a recording 7)."""
MAX_NODES = 100_000
"""Most keys and values of a rack file (decision: fewer variables than 16-bit ids can tell apart)."""
_Loader: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
"""libyaml parses a megabyte in 0.7 s, PyYAML without it in 12 s."""
_TOO_DEEP = "maximum nesting depth"
"""The error of newer versions of libyaml for a text that is nested too deep for them."""
_WHOLE = re.compile(r"-?(0|[1-9][0-9]{0,17})")
_LINE_END = re.compile(r"\r\n|\r|\n")
_TRUTH = {"true": True, "false": False}
_WORDS = frozenset(("true", "false", "yes", "no", "on", "off", "null", "y", "n"))
_PLAIN = " _./()+-"
"""What may stand next to letters and digits in a text without quotes."""


Node: TypeAlias = "Scalar | YamlSequence | YamlMapping"
_Dumper: Any = getattr(yaml, "CSafeDumper", yaml.SafeDumper)
_WIDTH = 1 << 20
"""No value is broken over lines."""


class Flaw(enum.Enum):
    """Kinds of errors in a text."""

    SYNTAX = "it is not YAML"
    EXTRA = "a part of YAML that is not read"
    SIZE = "nested too deep, or too many values"


Report = Callable[[Flaw, str, Span, str | None], None]
"""Called with an error: its kind, a message, the place, and a hint or None."""


class YamlFault(UserError):
    """A text cannot be read as data; ``flaw`` is the kind of fault."""

    def __init__(self, flaw: Flaw, message: str, hint: str | None = None) -> None:
        super().__init__(message, hint)
        self.flaw = flaw


@dataclass(frozen=True)
class Scalar:
    """A single value. ``plain`` is FALSE if it is in quotes or in a block of text."""

    text: str
    plain: bool
    span: Span

    @property
    def is_null(self) -> bool:
        """Whether no value was given."""
        return self.plain and self.text in ("", "~", "null", "Null", "NULL")


@dataclass(frozen=True)
class YamlSequence:
    """A list."""

    items: tuple[Node, ...]
    span: Span


@dataclass(frozen=True)
class YamlMapping:
    """Keys and values in the order of the file; a key may occur twice."""

    entries: tuple[tuple[Scalar, Node], ...]
    span: Span


class _TooMuch(Exception):
    """The text is nested too deep or has too many values; reading cannot continue."""


def read_yaml(
    text: str, report: Report, what: str = "a rack file", depth: int = MAX_DEPTH, nodes: int = MAX_NODES
) -> Node | None:
    """Return the tree of a text, None if it could not be read to its end; ``what`` names the kind of text in messages.

    An alias is reported and read as null; anchors and tags are reported and ignored.
    """
    return _Reader(text, report, what, depth, nodes).read()


def read_data(text: str, *, typed: bool = False, depth: int = MAX_DEPTH, nodes: int = MAX_NODES) -> Any:
    """Return a text's data as dicts, lists and texts; of a repeated key the last counts.

    ``typed``: whole numbers, true and false without quotes become numbers and booleans.

    Raises:
        YamlFault: it is not YAML, has aliases, anchors or tags, or is too large.
    """
    root = read_yaml(text, raise_flaw, "such a file", depth, nodes)
    return _data(root, typed) if root is not None else None


def raise_flaw(flaw: Flaw, message: str, span: Span, hint: str | None) -> None:
    """Raise a flaw as YamlFault, as the ``report`` of a reader."""
    raise YamlFault(flaw, f"line {span.line}: {message}", hint)


def _data(node: Node, typed: bool) -> Any:
    if isinstance(node, YamlSequence):
        return [_data(item, typed) for item in node.items]
    if isinstance(node, YamlMapping):
        return {key.text: _data(value, typed) for key, value in node.entries}
    if typed and node.plain:
        return int(node.text) if _WHOLE.fullmatch(node.text) else _TRUTH.get(node.text, node.text)
    return node.text


class _Places:
    """Converts PyYAML's marks to spans: PyYAML also ends lines at characters that editors do not count."""

    def __init__(self, text: str) -> None:
        self._length = len(text)
        self._starts = [0, *(end.end() for end in _LINE_END.finditer(text))]

    def span(self, start: int, end: int) -> Span:
        start = min(start, self._length)
        line = bisect_right(self._starts, start)
        begin = self._starts[line - 1]
        if line == len(self._starts) or end < self._starts[line]:
            last_column = min(end, self._length) - begin + 1
        else:
            last_column = self._starts[line] - begin
        column = start - begin + 1
        return Span(line, column, last_column if last_column > column else column + 1)


class _Reader:
    def __init__(self, text: str, report: Report, what: str, depth: int, nodes: int) -> None:
        self._text = text
        self._places = _Places(text)
        self._report = report
        self._what = what
        self._depth = depth
        self._most_nodes = nodes
        self._nodes = 0

    def read(self) -> Node | None:
        strange = yaml.reader.Reader.NON_PRINTABLE.search(self._text)
        if strange is not None:
            span = self._places.span(strange.start(), strange.end())
            self._report(Flaw.SYNTAX, f"character U+{ord(strange[0]):04X} is not allowed", span, None)
            return None
        try:
            return self._document(iter(yaml.parse(self._text, Loader=_Loader)))
        except _TooMuch:
            return None
        except yaml.MarkedYAMLError as error:
            self._syntax_error(error)
        except (yaml.YAMLError, ValueError, OverflowError):
            self._report(Flaw.SYNTAX, "a value that YAML cannot read", Span(1, 1, 2), None)
        return None

    def _syntax_error(self, error: yaml.MarkedYAMLError) -> None:
        mark = error.problem_mark or error.context_mark
        span = self._places.span(mark.index, mark.index + 1) if mark else Span(1, 1, 2)
        if _TOO_DEEP in (error.problem or ""):  # its scanner reads ahead
            self._report(Flaw.SIZE, f"nested deeper than {self._depth} levels", span, None)
            return
        message = quoted(error.problem or "not YAML", marks="", limit=120)
        context = f"{quoted(error.context, marks='', limit=80)}: " if error.context else ""
        self._report(Flaw.SYNTAX, f"{context}{message}", span, self._hint(mark.index if mark else 0))

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
                    self._refuse("a second document", event, "remove what follows the second '---'")
                    return root
                root = self._node(next(events), events, 1)
        return root if root is not None else Scalar("", True, Span(1, 1, 2))

    def _node(self, event: yaml.Event, events: Iterator[yaml.Event], depth: int) -> Node:
        self._nodes += 1
        if depth > self._depth:
            self._too_much(f"nested deeper than {self._depth} levels", event)
        if self._nodes > self._most_nodes:
            self._too_much(f"more than {self._most_nodes} keys and values", event)
        self._refuse_extras(event)
        if isinstance(event, yaml.SequenceStartEvent):
            return self._sequence(event, events, depth)
        if isinstance(event, yaml.MappingStartEvent):
            return self._mapping(event, events, depth)
        if isinstance(event, yaml.ScalarEvent):
            return Scalar(event.value, not event.style, self._span(event))
        return Scalar("", True, self._span(event))

    def _refuse_extras(self, event: yaml.Event) -> None:
        """Report an alias, which is read as null, and anchors and tags, which are ignored."""
        anchor, tag = getattr(event, "anchor", None), getattr(event, "tag", None)
        if isinstance(event, yaml.AliasEvent):
            self._refuse(f"the alias {quoted(f'*{anchor}')}", event, "write the value again")
            return
        if anchor is not None:
            self._refuse(f"the anchor {quoted(f'&{anchor}')}", event, "remove it")
        if tag is not None:
            self._refuse(f"the tag {quoted(tag)}", event, "remove it")

    def _sequence(self, start: yaml.Event, events: Iterator[yaml.Event], depth: int) -> YamlSequence:
        items: list[Node] = []
        for event in events:
            if isinstance(event, yaml.SequenceEndEvent):
                break
            items.append(self._node(event, events, depth + 1))
        return YamlSequence(tuple(items), self._span(start))

    def _mapping(self, start: yaml.Event, events: Iterator[yaml.Event], depth: int) -> YamlMapping:
        entries: list[tuple[Scalar, Node]] = []
        for event in events:
            if isinstance(event, yaml.MappingEndEvent):
                break
            key = self._node(event, events, depth + 1)
            value = self._node(next(events), events, depth + 1)
            if not isinstance(key, Scalar):
                self._report(Flaw.EXTRA, "a key must be a single word", key.span, None)
            elif key.plain and key.text == "<<":
                self._report(Flaw.EXTRA, "the merge key '<<' is not read", key.span, "write the values again")
            else:
                entries.append((key, value))
        return YamlMapping(tuple(entries), self._span(start))

    def _refuse(self, what: str, event: yaml.Event, hint: str) -> None:
        self._report(Flaw.EXTRA, f"{what} is not allowed in {self._what}", self._span(event), hint)

    def _too_much(self, message: str, event: yaml.Event) -> None:
        self._report(Flaw.SIZE, message, self._span(event), None)
        raise _TooMuch

    def _span(self, event: yaml.Event) -> Span:
        start, end = event.start_mark, event.end_mark
        return self._places.span(start.index, end.index) if start and end else Span(1, 1, 2)


def flow_text(text: str) -> str:
    """Return a printable text of one line as a value in a flow mapping, in quotes where it may be read otherwise."""
    plain = text[:1].isalpha() and text == text.strip() and all(char.isalnum() or char in _PLAIN for char in text)
    return text if plain and text.lower() not in _WORDS else "'" + text.replace("'", "''") + "'"


def yaml_of(root: Node) -> str:
    """Return a tree as YAML."""
    events = [yaml.StreamStartEvent(), yaml.DocumentStartEvent(explicit=False), *_events(root)]
    events += [yaml.DocumentEndEvent(explicit=False), yaml.StreamEndEvent()]
    text: str = yaml.emit(events, Dumper=_Dumper, width=_WIDTH, allow_unicode=True)
    return text


def _events(node: Node) -> Iterator[yaml.Event]:
    if isinstance(node, Scalar):
        yield _scalar(node)
    elif isinstance(node, YamlSequence):
        yield yaml.SequenceStartEvent(None, None, True, flow_style=True)
        for item in node.items:
            yield from _events(item)
        yield yaml.SequenceEndEvent()
    else:
        assert isinstance(node, YamlMapping)
        yield yaml.MappingStartEvent(None, None, True, flow_style=not node.entries)
        for key, value in node.entries:
            yield _scalar(key)
            yield from _events(value)
        yield yaml.MappingEndEvent()


def _scalar(scalar: Scalar) -> yaml.Event:
    if scalar.is_null:
        return yaml.ScalarEvent(None, None, (True, False), "null")
    return yaml.ScalarEvent(
        None, None, (scalar.plain, not scalar.plain), scalar.text, style=None if scalar.plain else '"'
    )
