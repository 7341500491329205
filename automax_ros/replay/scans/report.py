"""The report of a replay, as text and as JSON."""

from __future__ import annotations

import dataclasses
import enum
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from automax_ros.core.problems import PROBLEMS
from automax_ros.core.text import printable, table
from automax_ros.core.types import Value
from automax_ros.core.values import source_text

OPEN_LOOP = (
    "Open loop: each task scans on the recorded inputs. After a first difference the values from other tasks, from "
    "ROS and from the plant stay those that were recorded."
)
_LONGEST_LIST = 40
"""Most inputs of one scan in the text."""


class Kind(enum.Enum):
    """The kind of a difference."""

    VARIABLE = "variable"
    WRITES = "writes"
    ERRORS = "errors"
    STATE = "state"
    STATUS = "status"
    MESSAGE = "message"
    COMMAND = "command"


@dataclass(frozen=True)
class Point:
    """One scan in which something differs: its number, its time since the start of the run, both values."""

    scan: int
    time_s: float
    recorded: Value
    replayed: Value


@dataclass(frozen=True)
class Greatest:
    """The greatest difference (replayed - recorded) of a number, and the scan in which it first occurs."""

    scan: int
    time_s: float
    difference: float


@dataclass(frozen=True)
class Settled:
    """From this scan to the end, the difference stays between ``low`` and ``high``; both 0: equal again.

    For booleans and strings both are 1 if the values differ in every scan.
    """

    scan: int
    time_s: float
    low: float
    high: float


@dataclass(frozen=True)
class Difference:
    """A variable or other item of one task that differs in at least one scan.

    ``lines`` are the BASIC lines that can write it. ``scans`` is the number of scans after which it differs (for a
    state: of recorded states).
    """

    task: str
    kind: Kind
    name: str
    first: Point
    scans: int
    unit: str = ""
    lines: tuple[int, ...] = ()
    greatest: Greatest | None = None
    settled: Settled | None = None


@dataclass(frozen=True)
class NamedValue:
    """A variable and its value."""

    name: str
    value: Value


@dataclass(frozen=True)
class FirstScan:
    """The first of all scans that differ, with its inputs: the latched values and the reads in their order."""

    task: str
    scan: int
    time_s: float
    differences: tuple[Difference, ...]
    latched: tuple[NamedValue, ...]
    read: tuple[NamedValue, ...]


@dataclass(frozen=True)
class TaskReport:
    """One task: the origin of its source, the numbers of scans and states compared, and of those that differ.

    ``scans`` includes the part before SCAN_LOOP, as scan 0. ``notes`` are further information for the user.
    """

    name: str
    source: str
    edited: bool
    scans: int
    different: int
    states: int
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class ReplayReport:
    """The whole result. Times count from the start of the run; ``more`` differences are counted, not listed."""

    bag: str
    rack: str
    version: str
    from_s: float
    to_s: float
    tolerance: float
    tasks: tuple[TaskReport, ...]
    first: FirstScan | None
    differences: tuple[Difference, ...]
    more: int = 0

    @property
    def identical(self) -> bool:
        """Whether nothing differs."""
        return not self.differences and not self.more

    @property
    def scans(self) -> int:
        """Number of compared scans."""
        return sum(task.scans for task in self.tasks)

    def as_json(self) -> dict[str, object]:
        """Return the report for ``--json``: plain dicts and lists; numbers that JSON lacks become texts."""
        data = {"identical": self.identical, "scans": self.scans, "open_loop": OPEN_LOOP, **dataclasses.asdict(self)}
        plain = _plain(data)
        assert isinstance(plain, dict)
        return plain

    def text(self) -> str:
        """Return the report as text."""
        return "\n".join(_lines(self)) + "\n"


def _plain(value: object) -> object:
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    if isinstance(value, enum.Enum):
        return value.value
    if isinstance(value, float) and not math.isfinite(value):
        return repr(value)
    return value


def difference_text(value: float) -> str:
    """Return a difference with its sign."""
    return f"{value:+.10g}"


def _lines(report: ReplayReport) -> Iterator[str]:
    where = f"{report.bag}: rack {report.rack}, {_seconds(report.from_s)} to {_seconds(report.to_s)} s"
    yield f"{printable(where)}, recorded by version {printable(report.version) or 'unknown'}"
    yield OPEN_LOOP
    if report.tolerance:
        yield f"Numbers that differ by at most {report.tolerance:g} count as equal; states are not compared."
    yield ""
    yield from table([("task", "source", "scans", "result"), *(_task_row(task) for task in report.tasks)])
    for task in report.tasks:
        for note in task.notes:
            yield f"{task.name}: {printable(note)}"
    yield ""
    if report.first is None:
        left = [task.name for task in report.tasks if not task.scans]
        but = f" Not compared: {', '.join(left)}." if left else ""
        yield f"{report.scans} scans executed again, no difference.{but}"
        return
    yield from _first_lines(report.first)
    yield ""
    yield from table([_HEAD, *(_difference_row(item) for item in report.differences)])
    if report.more:
        yield f"and {report.more} more (--max-differences shows them)"


def _task_row(task: TaskReport) -> tuple[str, ...]:
    if task.different:
        result = f"{task.different} scans differ" if task.different > 1 else "1 scan differs"
    elif not task.scans:
        result = "nothing compared"
    else:
        states = f", and {task.states} state{'s' if task.states > 1 else ''}" if task.states else ""
        result = f"identical{states}"
    return task.name, printable(task.source), str(task.scans), result


def _first_lines(first: FirstScan) -> Iterator[str]:
    yield f"First difference: task {first.task}, scan {first.scan} at {_seconds(first.time_s)} s"
    for item in first.differences:
        place = f"  (line {_numbers(item.lines)})" if item.lines else ""
        values = f"recorded {source_text(item.first.recorded)}, replayed {source_text(item.first.replayed)}"
        yield f"  {printable(item.name)}: {values}{place}"
    for title, values_seen in (("latched", first.latched), ("read", first.read)):
        if values_seen:
            shown = [f"{item.name}={source_text(item.value)}" for item in values_seen[:_LONGEST_LIST]]
            rest = len(values_seen) - len(shown)
            yield from _wrap(f"  it {title}: ", shown + ([f"and {rest} more"] if rest else []))


_HEAD = ("task", "differs", "line", "first scan", "at s", "recorded", "replayed", "greatest", "in scan", "scans", "")


def _difference_row(item: Difference) -> tuple[str, ...]:
    greatest = item.greatest
    name = f"{item.name} ({item.unit})" if item.unit else item.name
    return (
        item.task,
        printable(name),
        _numbers(item.lines),
        str(item.first.scan),
        _seconds(item.first.time_s),
        source_text(item.first.recorded),
        source_text(item.first.replayed),
        difference_text(greatest.difference) if greatest else "",
        str(greatest.scan) if greatest else "",
        str(item.scans),
        _settled_text(item),
    )


def _settled_text(item: Difference) -> str:
    settled = item.settled
    if settled is None:
        return ""
    since = f"from scan {settled.scan} ({_seconds(settled.time_s)} s) on"
    if settled.low == settled.high == 0:
        return f"equal again {since}"
    if item.greatest is None:
        return f"apart {since}"
    if settled.low == settled.high:
        return f"settles {difference_text(settled.low)} apart {since}"
    return f"settles {difference_text(settled.low)} to {difference_text(settled.high)} apart {since}"


def _numbers(lines: tuple[int, ...]) -> str:
    shown = ", ".join(map(str, lines[:3]))
    return f"{shown} ..." if len(lines) > 3 else shown


def _seconds(value: float) -> str:
    return f"{value:.9f}".rstrip("0").rstrip(".")


def errors_text(errors: Sequence[tuple[int, int]]) -> str:
    """Return the run-time errors of a scan: ``line 150 AMX7003 division by zero``; a line of 0 is left out."""
    return ", ".join(_error_text(line, code) for line, code in errors) or "none"


def _error_text(line: int, code: int) -> str:
    problem = PROBLEMS.get(f"AMX{code:04d}")
    title = f" {problem.title}" if problem else ""
    return f"line {line} AMX{code:04d}{title}" if line else f"AMX{code:04d}{title}"


def _wrap(title: str, parts: Sequence[str], width: int = 110) -> Iterator[str]:
    """Yield the lines of ``title: a, b, c``, broken between parts."""
    line = title
    for number, part in enumerate(parts):
        piece = part if number == len(parts) - 1 else f"{part}, "
        if len(line) + len(piece) > width and line.strip() and line != title:
            yield line.rstrip()
            line = " " * len(title)
        line += piece
    yield line.rstrip()
