"""The new rack file while it is made: what its reader refuses becomes a plain common, then a comment.

So the rules of rack files have one home: the importer asks the reader.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from automax_ros.core.diagnostics import Diagnostic, SourceText
from automax_ros.core.problems import Severity
from automax_ros.core.user_error import UserError
from automax_ros.core.yaml_text import MAX_NODES
from automax_ros.rackfile.loader import load_stored
from automax_ros.rackfile.old_plants.draft import commented
from automax_ros.rackfile.old_plants.executive.findings import Findings
from automax_ros.rackfile.reading.files import MAX_BYTES

_MOST_ROUNDS = 60
"""Most readings of the rack file until nothing is refused any more (decision: a bound on untrusted files)."""
_SIZE, _TOO_MANY_TASKS = "AMX6005", "AMX6303"
_WHOLE, _PLAIN, _COMMENT = range(3)
_NEVER_PLAIN = {ord(char): None for char in "\r\n"}


@dataclass
class Entry:
    """A thing of the old rack and its line: ``whole`` as it should be, ``plain`` without what may be refused.

    ``note`` is the comment of the whole line, ``detail`` what the plain line and the comment keep of the record.
    ``fixed``: it stays as it is, and the check of the rack says what is wrong with it.
    """

    whole: str
    file: str
    record: int
    plain: str = ""
    note: str = ""
    detail: str = ""
    fixed: bool = False
    level: int = _WHOLE
    reason: str = ""

    def lessen(self, reason: str) -> bool:
        """Go on to the next form; FALSE if there is none."""
        if self.fixed or self.level == _COMMENT:
            return False
        self.level = _PLAIN if self.level == _WHOLE and self.plain else _COMMENT
        self.reason = reason
        return True

    @property
    def name(self) -> str:
        """What the entry is called where it is told of."""
        return self.whole.partition(":")[0]

    @property
    def is_comment(self) -> bool:
        """Whether only a comment is left."""
        return self.level == _COMMENT

    def text(self, indent: int) -> str:
        """Return the line."""
        pad = " " * indent
        told = "; ".join(part for part in (self.detail, self.reason) if part).translate(_NEVER_PLAIN)
        origin = f"{self.file} record {self.record}: {told}" if told else f"{self.file} record {self.record}"
        if self.level == _WHOLE:
            return commented(pad + self.whole, self.note) if self.note else pad + self.whole
        return commented(pad + (self.plain if self.level == _PLAIN else f"# {self.whole}"), origin)


@dataclass
class ModuleEntry(Entry):
    """A module with its tasks; ``keys`` are lines of its own, ``comments`` what follows them as comments.

    ``whole`` is the slot with its module on one line. ``takes_tasks``: it is a module that runs tasks.
    """

    slot: int = 0
    model: str = ""
    keys: list[str] = field(default_factory=list)
    tasks: list[Entry] = field(default_factory=list)
    comments: list[str] = field(default_factory=list)
    takes_tasks: bool = False

    @property
    def name(self) -> str:
        """The slot."""
        return f"slot {self.slot}"

    def leave_out_tasks(self, findings: Findings) -> None:
        """Make comments of the tasks of a module that runs none or is a comment itself, and tell them (AMX6789)."""
        if self.takes_tasks and not self.is_comment:
            return
        if self.is_comment:
            why = f"the module of slot {self.slot}, where it stands, is left out: {self.reason}"
        else:
            why = f"it stands in slot {self.slot}, and a {self.model} runs no tasks"
        for task in self.tasks:
            if task.lessen(why):
                hint = f"a Processor or a UDC runs it: --module {self.slot}=NUMBER says which module is there"
                findings.add("AMX6789", f"task {task.name} is lost: {why}", task.file, task.record, hint)

    def lines(self) -> Iterator[tuple[str, Entry | None]]:
        """Yield the lines, each with what it stands for."""
        if self.is_comment or not self.takes_tasks:
            yield self.text(2), self
            yield from ((task.text(4), task) for task in self.tasks)
        else:
            yield f"  {self.slot}:", self
            module = f"    module: {self.model}"
            yield commented(module, self.note) if self.note else module, self
            yield from ((f"    {key}", None) for key in self.keys)
            yield "    tasks:" if any(not task.is_comment for task in self.tasks) else "    tasks: {}", None
            yield from ((task.text(6), task) for task in self.tasks)
        yield from ((f"    # {comment}", None) for comment in self.comments)


@dataclass
class Document:
    """The parts of a rack file, in their order."""

    head: list[str]
    modules: list[ModuleEntry] = field(default_factory=list)
    elsewhere: list[str] = field(default_factory=list)
    commons: list[Entry] = field(default_factory=list)
    tail: list[str] = field(default_factory=list)

    def lines(self) -> Iterator[tuple[str, Entry | None]]:
        """Yield all lines, each with the thing that it stands for, None for those that stand for none."""
        yield from ((line, None) for line in self.head)
        there = any(not module.is_comment for module in self.modules)
        yield "slots:" if there else "slots: {}", None
        for module in self.modules:
            yield from module.lines()
        yield from ((f"  # {line}", None) for line in self.elsewhere)
        yield "common:" if any(not entry.is_comment for entry in self.commons) else "common: {}", None
        yield from ((entry.text(2), entry) for entry in self.commons)
        yield from ((f"# {line}", None) for line in self.tail)

    def text(self) -> str:
        """Return the whole file.

        Raises:
            UserError: it would have more bytes than a rack file may have.
        """
        text = "".join(line.translate(_NEVER_PLAIN) + "\n" for line, _ in self.lines())
        if len(text.encode()) > MAX_BYTES:
            raise _too_large(f"more than {MAX_BYTES} bytes")
        return text

    def settle(self, findings: Findings) -> list[Diagnostic]:
        """Lessen what the reader of rack files refuses, tell it, and return what the reader says of the rest.

        What becomes a comment is lost (AMX6789), what becomes a plain common loses its place (AMX6795).

        Raises:
            UserError: the rack file would be larger than one may be.
        """
        found = self._read(findings)
        for _ in range(_MOST_ROUNDS):
            if not self._lessen(found, findings):
                break
            found = self._read(findings)
        return found

    def _read(self, findings: Findings) -> list[Diagnostic]:
        """Return all errors, and the first warnings, of the file as it is."""
        for module in self.modules:
            module.leave_out_tasks(findings)
        found = load_stored(SourceText("rack.yaml", self.text()), Path("rack.yaml"), MAX_NODES).diagnostics
        for item in found:
            if item.code == _SIZE:
                raise _too_large(item.message)
        return found

    def _lessen(self, found: Iterable[Diagnostic], findings: Findings) -> bool:
        """Lessen the things with errors, each once, and tell them; FALSE if there are none."""
        entries = [entry for _, entry in self.lines()]
        lessened: set[int] = set()
        for item in found:
            for entry in _refused(item, entries):
                if id(entry) in lessened or not entry.lessen(item.message):
                    continue
                lessened.add(id(entry))
                code, form = ("AMX6789", "a comment") if entry.is_comment else ("AMX6795", "a plain common")
                message = f"{entry.name} becomes {form} of the rack file: {item.message}"
                findings.add(code, message, entry.file, entry.record)
        return bool(lessened)


def _refused(item: Diagnostic, entries: Sequence[Entry | None]) -> Iterator[Entry]:
    """Yield what an error refuses: what its line stands for, and after the first task too many the module's others."""
    if item.severity is not Severity.ERROR:
        return
    for place in range(item.span.line - 1, len(entries)):
        entry = entries[place]
        if entry is not None:
            yield entry
        if item.code != _TOO_MANY_TASKS or entry is None or isinstance(entry, ModuleEntry):
            return


def _too_large(what: str) -> UserError:
    return UserError(f"the rack file would have {what}", "is this one rack?")
