"""Compares two recordings scan by scan, up to the first one that differs from that of its task and number."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import cast

from automax_ros.core.names import element_name
from automax_ros.core.types import Value, same_bits
from automax_ros.core.values import source_text
from automax_ros.messages.types.messages import NAMES, Scan, Values
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.recordings.read.common_log import CommonLog
from automax_ros.recordings.tables.series import Progress
from automax_ros.replay.recorded.run import RecordedRun
from automax_ros.replay.scans.compare import within
from automax_ros.replay.scans.report import errors_text

_MOST_WAITING = 200_000
"""Most scans of the other recording that wait for those of the first (decision: a bound on memory)."""
_MOST_TOLD = 3
Named = Mapping[str, Value]


@dataclass(frozen=True)
class FirstApart:
    """The first scan that differs, its time in ns of the first recording, and how it differs in words."""

    task: str
    scan: int
    time_ns: int
    text: str


class _Side:
    """The scans of one recording, in their order."""

    def __init__(self, run: RecordedRun, progress: Progress | None) -> None:
        self._log, self._variables = CommonLog(run.bag, run.replay.facts), run.replay.rack.config.variables
        self._latched: dict[str, dict[str, Value]] = {}
        self._reader = run.replay.reader.again()
        self._reader.on_progress = progress

    def scans(self) -> Iterator[tuple[int, Scan]]:
        """Yield all scans, each with its place in its task's log."""
        counts: Counter[str] = Counter()
        for entry in self._reader.messages(types={NAMES[Scan]}):
            scan = cast(Scan, entry.message)
            yield counts[scan.task], scan
            counts[scan.task] += 1

    def parts(self, scan: Scan) -> dict[str, Named]:
        """Return what a scan latched, read and wrote; of each scan of a task, for messages do not repeat the latch."""
        latched = self._latched.setdefault(scan.task, {})
        if scan.full:
            latched.clear()
        latched.update(self._named(scan, scan.latched))
        given = {"read": scan.read, "wrote": scan.written, "committed": scan.committed}
        return {"latched": latched, **{what: dict(self._named(scan, part)) for what, part in given.items()}}

    def _named(self, scan: Scan, part: Values) -> Iterator[tuple[str, Value]]:
        for view, index, value in self._log.reads(part, scan.stamp):
            known = view < len(self._variables)
            yield element_name(self._variables[view], index) if known else f"input {view}.{index}", value


class _Following:
    """The scans of the other recording, as they are asked for."""

    def __init__(self, run: RecordedRun) -> None:
        self._run, self.side = run, _Side(run, None)
        self._scans = self.side.scans()
        self._waiting: dict[str, deque[tuple[int, Scan]]] = {name: deque() for name in run.tasks}
        self._count = 0

    def scan(self, task: str, place: int) -> Scan | None:
        """Return a scan of a task; each call asks for one after the last one. None after the end."""
        own = self._waiting[task]
        while not own or own[-1][0] < place:
            found = next(self._scans, None)
            if found is None:
                return None
            self._waiting[found[1].task].append(found)
            self._count += 1
            if self._count > _MOST_WAITING:
                what = f"{_MOST_WAITING} scans wait for those of the other recording: they are of different runs"
                raise BagError("AMX6814", self._run.bag, what)
        scan = None
        while own and own[0][0] <= place:
            _, scan = own.popleft()
            self._count -= 1
            if own and own[0][0] <= place:
                self.side.parts(scan)
        return scan


def first_apart(
    run: RecordedRun, other: RecordedRun, tolerance: float = 0.0, progress: Progress | None = None
) -> FirstApart | None:
    """Return the first scan that differs from the one of its task and number in another recording.

    None: none does. Compared are inputs, outputs and errors of those scans that both recordings have; numbers that
    differ by at most ``tolerance`` are equal.

    Raises:
        BagError: one of them cannot be read, or they are of different runs.
    """
    offsets = {name: _offset(run, other, name) for name in run.tasks if name in other.tasks}
    one, following = _Side(run, progress), _Following(other)
    for place, scan in one.scans():
        begin, its_begin = offsets.get(scan.task) or (place + 1, 0)
        own = one.parts(scan)
        found = following.scan(scan.task, place - begin + its_begin) if place >= begin else None
        if found is None:
            continue
        text = _difference(own, scan, following.side.parts(found), found, tolerance)
        if text:
            return FirstApart(scan.task, scan.scan, run.time_of(scan.stamp), text)
    return None


def _offset(run: RecordedRun, other: RecordedRun, task: str) -> tuple[int, int] | None:
    """Return the places of the first scan that both recordings have of a task, None if there is none."""
    own, its = run.tasks[task], other.tasks[task]
    if not own.numbers or not its.numbers:
        return None
    number = max(own.numbers[0], its.numbers[0])
    places = own.numbered(number), its.numbered(number)
    return None if places[0] is None or places[1] is None else (places[0], places[1])


def _difference(own: Mapping[str, Named], scan: Scan, its: Mapping[str, Named], found: Scan, tolerance: float) -> str:
    """Return in words what differs, "" if nothing does."""
    if scan.scan != found.scan:
        return f"scan {scan.scan} here, scan {found.scan} there"
    texts = []
    for what, values in own.items():
        for name in dict.fromkeys((*values, *its[what])):
            one, two = values.get(name), its[what].get(name)
            same = one is not None and two is not None and (same_bits(one, two) or within(one, two, tolerance))
            if not same:
                shown = ["nothing" if value is None else source_text(value) for value in (one, two)]
                texts.append(f"{name}: {what} {shown[0]}, there {shown[1]}")
    errors = [[(error.line, error.code) for error in item.errors] for item in (scan, found)]
    if errors[0] != errors[1]:
        texts.append(f"errors: {errors_text(errors[0])}, there {errors_text(errors[1])}")
    return "; ".join(texts[:_MOST_TOLD])
