"""Parallel replay of a split recording's files: by processes of this machine, or by a Dask cluster.

Each part begins with the states in its first file, and proves that nothing differs in it. That it continues the part
before is proven by the equal state that both carry at that place (``carried_state``). From the first part without that
proof on, the replay continues in one process, so that the report is the same as that of one job, including all notes.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from automax_ros.parallel.job import Job, JobResult, Workers
from automax_ros.parallel.run import run_jobs
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.recordings.mcap.opening import size_of
from automax_ros.replay.engine import LONGEST_WAIT_NS, Replay
from automax_ros.replay.part import Part, PartResult, begun, is_unsure, packed, replay_part, scanning
from automax_ros.replay.scans.carried_state import CarriedState
from automax_ros.replay.scans.report import ReplayReport
from automax_ros.replay.scans.totals import Totals, added_up

LEAST_PART_BYTES = 16 << 20
"""Files are combined into parts of at least this size (decision: less is executed in a fraction of a second).

They are distributed in their order: the first one that differs ends the work, and the last is usually the shortest.
"""
ONE_PART = (
    "the recording is replayed here: a cluster is handed parts of at least "
    f"{LEAST_PART_BYTES >> 20} MB, each of one file or more, and this recording makes only one such part"
)
"""The note about a cluster that is not used."""
Progress = Callable[[float], None]


def replay_side_by_side(
    replay: Replay, where: Workers, on_progress: Progress | None = None, on_note: Callable[[str], None] = lambda _: None
) -> ReplayReport:
    """Replay a recording; its files in parallel if there are several and that is worthwhile.

    ``on_note`` is called if a cluster was given and is not used: a single part is executed here (decision).

    Raises:
        BagError: the recording cannot be read, or not by a worker of the cluster, or lacks something that is needed.
        ClusterFault: the cluster cannot be used.
    """
    parts = [] if where.scheduler is None and where.processes == 1 else parts_of(replay)
    if len(parts) < 2:
        if where.scheduler is not None:
            on_note(ONE_PART)
        return replay.run(on_progress)
    return _SideBySide(replay, parts, on_progress or (lambda _: None)).run(where)


def parts_of(replay: Replay) -> list[Part]:
    """Return the parts of a recording that can be executed independently: none unless our recorder made it."""
    reader = replay.reader
    count = len(reader.files)
    if count < 2 or not reader.is_ours:
        return []
    try:
        first, end = _files_in_range(replay, count)
        sizes = [size_of(file) for file in reader.files]
    except BagError:
        return []  # raised again when the recording is read from its beginning
    parts: list[Part] = []
    begin, size = 0, 0
    for number in range(first, end):
        size += sizes[number]
        if size >= LEAST_PART_BYTES or number == end - 1:
            parts.append(Part(begin, number + 1))
            begin, size = number + 1, 0
    return parts


def _files_in_range(replay: Replay, count: int) -> tuple[int, int]:
    """Return the number of the last file that begins before the range, and that after the last one of the range."""
    options, start = replay.options, replay.facts.table.stamp
    first, end = 0, count
    if options.from_ns:
        begin = start + options.from_ns
        first = max((number for number in range(count) if _first_stamp(replay, number) < begin), default=0)
    if options.to_ns is not None:
        last = start + options.to_ns + LONGEST_WAIT_NS
        end = max((number + 1 for number in range(first, count) if _first_stamp(replay, number) <= last), default=count)
    return first, end


def _first_stamp(replay: Replay, number: int) -> int:
    """Return the stamp of a file's first message. BagError: it cannot be read."""
    for record in replay.reader.part(number, number + 1).records():
        return record.publish_time
    raise BagError("AMX6813", replay.reader.files[number], "holds no message")


@dataclass(frozen=True)
class _Proven:
    """The proven beginning of the recording: the totals of its parts, and the part with which to continue.

    ``part`` is None if the whole recording is proven. ``stopped`` are the tasks that have stopped by themselves before
    that part, ``knows_no_force``: no force had held by then. ``failed`` is a part without result.
    """

    counted: tuple[Totals, ...] = ()
    part: int | None = 0
    stopped: frozenset[str] = frozenset()
    knows_no_force: bool = True
    failed: int | None = None

    def follows(self, exit: CarriedState, result: PartResult) -> bool:
        """Whether a part is the continuation of one that ended with ``exit``."""
        forces_known = self.knows_no_force or not result.asked_back
        same = exit.content == result.entry.content
        return same and forces_known and not result.unsure and not self.stopped & result.went_on

    def and_then(self, result: PartResult, part: int | None) -> _Proven:
        """Return this with one more proven part; ``part`` is the next one."""
        stopped = (self.stopped - result.scanned) | (result.exit.stopped & result.scanned)
        return _Proven((*self.counted, result.totals), part, stopped, result.exit.knows_no_force)


class _SideBySide:
    """Executes one replay in parts."""

    def __init__(self, replay: Replay, parts: list[Part], on_progress: Progress) -> None:
        self._replay, self._parts, self._on_progress = replay, parts, on_progress
        self._done: dict[str, JobResult] = {}
        self._sizes = [sum(map(size_of, replay.reader.files[part.first : part.end])) for part in parts]

    def run(self, where: Workers) -> ReplayReport:
        """Execute the parts, join their results, and replay the rest in this process."""
        what = packed(self._replay)
        pieces = [Job(self._name(number), replay_part, (what, part)) for number, part in enumerate(self._parts)]
        run_jobs(pieces, where, self._take, self._is_over)
        results = [result for number in range(len(pieces)) if (result := self._result(number)) is not None]
        self._replay.native_elsewhere = tuple(text for result in results for text in result.native)
        proven = self._join_proven()
        if proven.failed is not None:
            self._require_worker(pieces[proven.failed])
        if proven.part is None:
            return self._replay.report(added_up(proven.counted), self._replay.options)
        return self._gone_on(proven) or self._replay.run(self._on_progress)

    def _gone_on(self, proven: _Proven) -> ReplayReport | None:
        """Continue in this process with a part whose beginning is proven; None if that proof turns out not to hold."""
        assert proven.part is not None
        replay, first = self._replay, self._parts[proven.part].first
        if not first:
            return None
        base, _ = begun(replay, first)
        reader = replay.reader.part(first, len(replay.reader.files))
        share = sum(self._sizes[: proven.part]) / sum(self._sizes)
        reader.on_progress = lambda done: self._on_progress(share + (1 - share) * done)
        run = replay.begin({}, replay.options)
        run.take_all(reader)
        totals = run.totals()
        _, went_on = scanning(run, totals)
        asked = (run.asked_back and not proven.knows_no_force) or is_unsure(run) or proven.stopped & went_on
        if asked or totals.full or not base.clean or run.ends_in_doubt():
            return None
        return replay.report(added_up([*proven.counted, totals.since(base)]), replay.options)

    def _join_proven(self) -> _Proven:
        """Join the parts as far as each is the continuation of the one before, and nothing differs."""
        before: tuple[_Proven, CarriedState] | None = None
        proven = _Proven()
        for number in range(len(self._parts)):
            result = self._result(number)
            if result is None:
                return replace(before[0] if before else proven, failed=number)
            if before is not None and not proven.follows(before[1], result):
                return before[0]
            if not result.clean:
                return proven
            is_last = result.ended or number == len(self._parts) - 1
            before = proven, result.exit
            proven = proven.and_then(result, None if is_last else number + 1)
            if is_last:
                return _Proven() if result.doubtful else proven
        return proven

    def _result(self, number: int) -> PartResult | None:
        done = self._done.get(self._name(number))
        result = done.result if done is not None else None
        return result if isinstance(result, PartResult) else None

    def _take(self, done: JobResult) -> None:
        self._done[done.piece.name] = done
        sizes = sum(size for number, size in enumerate(self._sizes) if self._name(number) in self._done)
        self._on_progress(sizes / sum(self._sizes))

    def _is_over(self) -> bool:
        """Whether the replay will continue in this process with some part, and all parts before it are done."""
        for number in range(len(self._parts)):
            if self._name(number) not in self._done:
                return False
            result = self._result(number)
            if result is None or not result.clean or result.unsure or result.ended:
                return True
        return False

    def _require_worker(self, piece: Job) -> None:
        """Check whether a failed part failed because of its worker, which died or cannot read the recording.

        Raises:
            BagError: the worker is the cause.
        """
        done = self._done.get(piece.name)
        if done is None or done.fault is None:
            return
        if done.fault.died:
            hint = "give it fewer --jobs if memory ran out; --jobs 1 does all of it in one process"
            raise BagError("AMX6855", self._replay.bag, str(done.fault), hint)
        if done.fault.worker:
            try:
                piece.work(*piece.arguments)
            except BagError:
                return
            hint = "each worker reads the files by the same path: put the recording where all of them find it"
            raise BagError("AMX6856", self._replay.bag, str(done.fault), hint)

    def _name(self, number: int) -> str:
        part = self._parts[number]
        names = [file.name for file in self._replay.reader.files[part.first : part.end]]
        return names[0] if len(names) == 1 else f"{names[0]} to {names[-1]}"
