"""Reads the configuration task (.CNF) of a rack, as in Executives up to 2.1, line by line.

The manual of its language (J-3649) is not at hand. IODEF is as the ControlNet manual prints it (DSMBCN-UM001B p. 43):
``nnnnn IODEF name [SLOT=s, REGISTER=r, BIT=b]``, where ``&`` continues in the next line. The others are assumed to have
the same form (decision): MEMDEF and NVMEMDEF a list of variables as in COMMON; NETDEF the keys of IODEF and DROP;
RIODEF, GBLDEF, RNETDEF, ABDEF and MODDEF a name and any keys; TASK the keys TYPE, SLOT, PRIORITY and CRITICAL.
Everything else is reported.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass, field
from typing import NamedTuple

from automax_ros.core.diagnostics import Diagnostic, Note, SourceText, Span, in_order
from automax_ros.core.text import did_you_mean, quoted
from automax_ros.core.types import DataType
from automax_ros.language.text.lexer import LineReader, LogicalLine
from automax_ros.language.text.reporter import Reporter, TooManyProblemsError
from automax_ros.language.text.tokens import Token, TokenKind
from automax_ros.rackfile.model.config import MAX_SLOT, IoPoint
from automax_ros.rackfile.model.module import MAX_PRIORITY, MIN_PRIORITY
from automax_ros.rackfile.reading.names import (
    DeclarationFault,
    VariableName,
    check_task_name,
    is_reserved,
    variable_name,
)

TASK_TYPES = {"BAS": "BAS", "BLK": "BLK", "PC": "PC", "BASIC": "BAS", "CONTROL": "BLK"}
"""Words of TYPE, each with the suffix of the task's file."""
MAX_DROP, MAX_DROP_REGISTER = 55, 63
"""Highest drop of a network, and highest register of a drop (57C570 manual p. 18-4)."""
MAX_REGISTER = 65535
"""Highest register of a module on the bus (decision: a bound; 64K registers is the largest module)."""
_MAX_BIT = 15
_MOST_DIAGNOSTICS = 1000
"""Most problems of definitions that are shown (decision: a bound on untrusted texts)."""
_PROCESSOR_SLOTS = range(5)
"""Slots where a Processor can be (J2-3106-1 p. F-4)."""


@dataclass(frozen=True)
class DefinedCommon:
    """A variable that the configuration defines; ``keyword`` is the statement's word.

    ``point`` is its place by IODEF, or by NETDEF with the ``drop`` of the register.
    """

    declared: VariableName
    keyword: str
    line: int
    point: IoPoint | None = None
    non_volatile: bool = False
    drop: int | None = None


@dataclass(frozen=True)
class DefinedTask:
    """A task that the configuration names: type BAS, BLK or PC, slot of its Processor, priority."""

    name: str
    type: str
    slot: int
    priority: int
    critical: bool
    line: int


@dataclass
class Configuration:
    """The definitions of a configuration task, in the order of its lines, and the problems in it."""

    source: SourceText
    commons: list[DefinedCommon] = field(default_factory=list)
    tasks: list[DefinedTask] = field(default_factory=list)
    diagnostics: list[Diagnostic] = field(default_factory=list)


def read_configuration(source: SourceText) -> Configuration:
    """Return the definitions of a configuration task; never raises, whatever the text."""
    reader = _Reader(source)
    reader.read()
    found = reader.found
    found.diagnostics = in_order([*reader.reporter.diagnostics, *found.diagnostics])
    return found


class _Fault(Exception):
    def __init__(self, code: str, message: str, span: Span, hint: str | None = None, first: Span | None = None) -> None:
        super().__init__(message)
        notes = () if first is None else (Note("first defined here", first),)
        self.diagnostic = Diagnostic(code, message, span, hint=hint, notes=notes)


class _Given(NamedTuple):
    key: Token
    value: Token | None


class _Tokens:
    def __init__(self, tokens: list[Token]) -> None:
        self._tokens = tokens
        self._place = 0

    @property
    def next(self) -> Token:
        return self._tokens[self._place]

    @property
    def at_end(self) -> bool:
        return self.next.kind in (TokenKind.END, TokenKind.REMARK)

    def take(self) -> Token:
        token = self.next
        if token.fault is not None:
            raise _Fault(token.fault.code, token.fault.message, token.span, token.fault.hint)
        if token.kind is not TokenKind.END:
            self._place += 1
        return token

    def take_mark(self, *marks: str) -> bool:
        found = self.next.text in marks and self.next.kind in (TokenKind.MARK, TokenKind.OPERATOR)
        self._place += found
        return found

    def require(self, mark: str, after: str) -> None:
        if not self.take_mark(mark):
            raise _Fault("AMX6781", f"`{mark}` is missing after {after}", self.next.span)


class _Reader:
    def __init__(self, source: SourceText) -> None:
        self.found = Configuration(source)
        self.reporter = Reporter()
        self._source = source
        self._names: dict[str, Span] = {}

    def read(self) -> None:
        try:
            for line in LineReader(self._source, self.reporter):
                if not line.faulty:
                    self._line(line)
        except TooManyProblemsError:
            return

    def _line(self, line: LogicalLine) -> None:
        tokens = _Tokens(line.tokens)
        if tokens.at_end:
            return
        try:
            word = tokens.take()
            read = _STATEMENTS.get(word.text)
            if read is None:
                hint = did_you_mean(word.text, _STATEMENTS) or f"the emulator reads {', '.join(_STATEMENTS)}"
                message = f"{quoted(word.text)} is not a statement of a configuration task that can be read"
                raise _Fault("AMX6780", message, word.span, hint)
            read(self, word, tokens)
            if not tokens.at_end:
                raise _Fault("AMX6781", f"{quoted(tokens.next.text)} is too much in this statement", tokens.next.span)
        except _Fault as fault:
            self._report(fault.diagnostic)

    def _report(self, diagnostic: Diagnostic) -> None:
        if len(self.found.diagnostics) < _MOST_DIAGNOSTICS:
            self.found.diagnostics.append(diagnostic)
        elif len(self.found.diagnostics) == _MOST_DIAGNOSTICS:
            message = f"more than {_MOST_DIAGNOSTICS} problems: no more are shown"
            self.found.diagnostics.append(Diagnostic("AMX0002", message, diagnostic.span))

    # Statements

    def _end(self, word: Token, tokens: _Tokens) -> None:
        """Accept END, as in other programs; no source says whether a configuration task has one (decision)."""

    def _io(self, word: Token, tokens: _Tokens) -> None:
        declared, span = self._variable(tokens)
        keys = self._keys(tokens, ("SLOT", "REGISTER", "BIT"))
        self._add(declared, span, word, point=self._point(declared, span, word, keys, MAX_REGISTER))

    def _point(self, declared: VariableName, span: Span, word: Token, keys: dict[str, _Given], highest: int) -> IoPoint:
        if declared.dimensions or declared.type in (DataType.REAL, DataType.STRING):
            kind = "an array" if declared.dimensions else declared.type.word
            message = f"{declared.name} cannot be an I/O point: it is {kind}"
            raise _Fault("AMX6785", message, span, "an I/O point is a simple BOOLEAN, INTEGER or DOUBLE INTEGER")
        is_bit = declared.type is DataType.BOOLEAN
        if not is_bit and "BIT" in keys:
            raise _Fault("AMX6785", f"{declared.name} has a bit but is not BOOLEAN", keys["BIT"].key.span)
        for key in ("SLOT", "REGISTER", "BIT") if is_bit else ("SLOT", "REGISTER"):
            if key not in keys:
                raise _Fault("AMX6782", f"{word.text} {declared.name} lacks {key}", span)
        return IoPoint(
            _number(keys["SLOT"], 0, MAX_SLOT),
            _number(keys["REGISTER"], 0, highest),
            _number(keys["BIT"], 0, _MAX_BIT) if is_bit else None,
        )

    def _network(self, word: Token, tokens: _Tokens) -> None:
        declared, span = self._variable(tokens)
        keys = {} if tokens.at_end else self._keys(tokens, None)
        if not {"SLOT", "DROP"} <= keys.keys():
            self._report_elsewhere(declared, span, word, "the statement lacks SLOT or DROP of its 57C404")
            return
        point = self._point(declared, span, word, keys, MAX_DROP_REGISTER)
        self._add(declared, span, word, point=point, drop=_number(keys["DROP"], 0, MAX_DROP))

    def _memory(self, word: Token, tokens: _Tokens) -> None:
        while True:
            declared, span = self._variable(tokens)
            self._add(declared, span, word, non_volatile=word.text == "NVMEMDEF")
            if not tokens.take_mark(","):
                return

    def _elsewhere(self, word: Token, tokens: _Tokens) -> None:
        """Read a definition on a network or in a remote rack, whose keys have no meaning here."""
        declared, span = self._variable(tokens)
        if not tokens.at_end:
            self._keys(tokens, None)
        self._report_elsewhere(declared, span, word, _WHY_ELSEWHERE.get(word.text, "no module of the emulator has it"))

    def _report_elsewhere(self, declared: VariableName, span: Span, word: Token, why: str) -> None:
        self._add(declared, span, word)
        message = f"{declared.name} is defined by {word.text}: {why}"
        hint = "it becomes a plain common; write `ros: in` if something outside of the rack supplies it"
        self._report(Diagnostic("AMX6786", message, span, hint=hint))

    def _task(self, word: Token, tokens: _Tokens) -> None:
        name = tokens.take()
        try:
            check_task_name(name.text)
        except DeclarationFault as fault:
            raise _Fault(fault.code, f"{quoted(name.text)}: {fault.message}", name.span, fault.hint) from fault
        keys = self._keys(tokens, ("TYPE", "SLOT", "PRIORITY", "CRITICAL"))
        for key in ("SLOT", "PRIORITY"):
            if key not in keys:
                raise _Fault("AMX6782", f"{word.text} {name.text} lacks {key}", name.span)
        self._take_name(f"task {name.text}", name.span)
        task = DefinedTask(
            name=name.text,
            type=TASK_TYPES[_one_of(keys["TYPE"], TASK_TYPES)] if "TYPE" in keys else "BLK",
            slot=_number(keys["SLOT"], _PROCESSOR_SLOTS[0], _PROCESSOR_SLOTS[-1]),
            priority=_number(keys["PRIORITY"], MIN_PRIORITY, MAX_PRIORITY),
            critical="CRITICAL" in keys and _flag(keys["CRITICAL"]),
            line=name.line,
        )
        self.found.tasks.append(task)

    # Parts of statements

    def _variable(self, tokens: _Tokens) -> tuple[VariableName, Span]:
        """Read a variable with its length and subscripts, as COMMON writes them; a bracket with keys is left."""
        first = tokens.take()
        if not first.is_name:
            raise _Fault("AMX6781", f"a variable's name is missing before {quoted(first.text)}", first.span)
        text = first.text
        if tokens.take_mark(":"):
            text += f":{tokens.take().text}"
        if tokens.take_mark("("):
            text += "("
            while not tokens.take_mark(")"):
                if tokens.at_end:
                    raise _Fault("AMX6781", f"`)` is missing after {first.text}", tokens.next.span)
                text += tokens.take().text
            text += ")"
        try:
            return variable_name(text), first.span
        except DeclarationFault as fault:
            raise _Fault(fault.code, f"{quoted(text)}: {fault.message}", first.span, fault.hint) from fault

    def _keys(self, tokens: _Tokens, known: tuple[str, ...] | None) -> dict[str, _Given]:
        tokens.require("[", "the name")
        keys: dict[str, _Given] = {}
        while True:
            key = tokens.take()
            if known is not None and key.text not in known:
                hint = did_you_mean(key.text, known) or f"there are {', '.join(known)}"
                raise _Fault("AMX6782", f"{quoted(key.text)} is not a key of this statement", key.span, hint)
            if key.text in keys:
                raise _Fault("AMX6782", f"{key.text} is given twice", key.span, first=keys[key.text].key.span)
            keys[key.text] = _Given(key, tokens.take() if tokens.take_mark("=") else None)
            if not tokens.take_mark(","):
                break
        tokens.require("]", "the last key")
        return keys

    def _add(
        self,
        declared: VariableName,
        span: Span,
        word: Token,
        point: IoPoint | None = None,
        non_volatile: bool = False,
        drop: int | None = None,
    ) -> None:
        self._take_name(declared.name, span)
        if is_reserved(declared.name):
            message = f"{declared.name} is a word of the language and cannot name a variable: it is left out"
            hint = "give it another name, here and in the tasks, and import again"
            self._report(Diagnostic("AMX6401", message, span, hint=hint))
            return
        self.found.commons.append(DefinedCommon(declared, word.text, span.line, point, non_volatile, drop))

    def _take_name(self, name: str, span: Span) -> None:
        if name in self._names:
            raise _Fault("AMX6784", f"{name} is already defined", span, first=self._names[name])
        self._names[name] = span


def _number(given: _Given, low: int, high: int) -> int:
    value = given.value
    if value is None or value.kind is not TokenKind.INTEGER or not isinstance(value.value, int):
        hint = f"write {given.key.text}= and a number from {low} to {high}"
        raise _Fault("AMX6783", f"{given.key.text} must be a whole number", (value or given.key).span, hint)
    if not low <= value.value <= high:
        hint = f"correct the number; or is it another key than {given.key.text}?"
        raise _Fault("AMX6783", f"{given.key.text} is {value.text}; it must be {low} to {high}", value.span, hint)
    return value.value


def _one_of(given: _Given, words: Collection[str]) -> str:
    if given.value is None or given.value.text not in words:
        near = did_you_mean(given.value.text, words) if given.value is not None else None
        hint = near or f"for example {given.key.text}={next(iter(words))}"
        raise _Fault("AMX6783", f"{given.key.text} must be {', '.join(words)}", (given.value or given.key).span, hint)
    return given.value.text


def _flag(given: _Given) -> bool:
    return given.value is None or _one_of(given, ("TRUE", "FALSE")) == "TRUE"


_WHY_ELSEWHERE = {"GBLDEF": "where it stands is in the network's .NET file, whose form is not known"}
_Read = Callable[[_Reader, Token, _Tokens], None]
_STATEMENTS: dict[str, _Read] = {
    "IODEF": _Reader._io,
    "MEMDEF": _Reader._memory,
    "NVMEMDEF": _Reader._memory,
    "NETDEF": _Reader._network,
    **dict.fromkeys(("RIODEF", "GBLDEF", "RNETDEF", "ABDEF", "MODDEF"), _Reader._elsewhere),
    "TASK": _Reader._task,
    "END": _Reader._end,
}
"""The statements of a configuration task (J2-3045 p. 5-36), apart from remarks."""
