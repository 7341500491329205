"""The comparison of two recordings: read, aligned, each variable compared, and the result as data."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from automax_ros.comparison.align import Alignment, Event, aligned
from automax_ros.comparison.courses import Course, RecordedCourses, all_names, read_courses
from automax_ros.comparison.differences import Difference, difference
from automax_ros.comparison.measures import BAND_PERCENT, Measures, Response, is_step_like, response, steady_before
from automax_ros.comparison.signals import plain_name
from automax_ros.core.text import count_of
from automax_ros.core.ticks import NS_PER_S, seconds_text, time_text
from automax_ros.core.types import DataType
from automax_ros.core.user_error import UsageError
from automax_ros.core.values import is_number, number
from automax_ros.parallel.job import Job, JobResult, Workers
from automax_ros.parallel.run import run_jobs
from automax_ros.recordings.read.reader import BagReader
from automax_ros.recordings.tables.series import Progress

_LONG_BYTES = 4_000_000
"""From this size on two recordings are read at once (decision: half a second of reading)."""


@dataclass(frozen=True)
class ComparisonOptions:
    """What is compared, and how.

    Attributes:
        variables: names; None for all that both recordings have.
        references: what variables are meant to follow, by their names: another variable, or a number, as text.
        event: the event that is at 0 of the common axis, None for the start of the runs.
        event_from_ns: from when in each run it is looked for.
        shift_ns: how much later the second recording is placed.
        start_ns, end_ns: the part of the common axis, None for all that both recordings have.
        tolerance: numbers of memory that differ by at most this are equal.
        band_percent: the band in which a response has settled, % of its step.
    """

    variables: Sequence[str] | None = None
    references: Mapping[str, str] = field(default_factory=dict)
    event: Event | None = None
    event_from_ns: int = 0
    shift_ns: int = 0
    start_ns: int | None = None
    end_ns: int | None = None
    tolerance: float = 0.0
    band_percent: float = BAND_PERCENT


@dataclass(frozen=True)
class Side:
    """One of two recordings: its path, its rack, and its part of the common axis, s."""

    bag: Path
    rack: str
    start_s: float
    end_s: float


@dataclass(frozen=True)
class Responses:
    """How a variable responds in both recordings; ``reference`` is what it is meant to follow, "" for its own end."""

    reference: str
    before: Response
    after: Response

    @property
    def change(self) -> Measures:
        """The second one's measures less the first one's."""
        return self.after.measures.less(self.before.measures)


@dataclass(frozen=True)
class Compared:
    """One variable: its course in both recordings on the common axis, its difference and its responses.

    ``difference`` is None where the recordings have no value of it at the same time; ``note`` says what is odd.
    """

    before: Course
    after: Course
    difference: Difference | None
    responses: Responses | None = None
    references: tuple[Course, ...] = ()
    note: str = ""

    @property
    def name(self) -> str:
        """The full name."""
        return self.before.variable.label

    @property
    def unit(self) -> str:
        """The engineering unit, that of the first recording."""
        return self.before.variable.unit.strip()

    @property
    def is_scaled(self) -> bool:
        """Whether its values are those of a scale, in its unit, and not what memory held."""
        return self.before.counts is not None

    @property
    def differs(self) -> bool:
        """Whether it differs by more than the tolerance, or cannot be compared."""
        return self.difference is None or self.difference.first is not None

    @property
    def first_s(self) -> float:
        """When it first differs; the end of time where it does not."""
        first = self.difference.first if self.difference is not None else None
        return float("inf") if first is None else first.time_s


@dataclass(frozen=True)
class Comparison:
    """Two recordings side by side, from ``start_s`` to ``end_s`` of the common axis.

    ``variables`` are in the order of the first recording, or as they were named. ``only_before`` and ``only_after`` are
    names that the other recording lacks; ``notes`` say in words what else the two do not have in common.
    """

    before: Side
    after: Side
    alignment: Alignment
    start_s: float
    end_s: float
    tolerance: float
    variables: tuple[Compared, ...]
    only_before: tuple[str, ...] = ()
    only_after: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def differing(self) -> list[Compared]:
        """The variables that differ, in the order of time; those that differ first are nearest to the cause."""
        return sorted((item for item in self.variables if item.differs), key=lambda item: item.first_s)

    @property
    def equal(self) -> bool:
        """Whether nothing differs, and each has what the other has (decision: a variable that is gone is a change)."""
        return not (self.only_before or self.only_after or any(item.differs for item in self.variables))


def compare(
    before: Path, after: Path, options: ComparisonOptions | None = None, progress: Progress | None = None
) -> Comparison:
    """Compare two recordings.

    Raises:
        BagError: one cannot be read, holds nothing that is compared, or a variable that was named is not in it.
        UsageError: the event does not happen, or the recordings have no time in common.
    """
    options = options or ComparisonOptions()
    named = options.variables
    only: tuple[list[str], list[str]] = [], []
    if named is None:
        own, its = all_names(before), all_names(after)
        only = [name for name in own if name not in set(its)], [name for name in its if name not in set(own)]
        named = [name for name in own if name in set(its)]
        if not named:
            raise UsageError(f"{before} and {after} have no variable in common", "name variables, or other recordings")
    names = _all_asked(named, options)
    sides = _read_in_parallel((before, after), names, progress) or [
        read_courses(bag, names, None if progress is None else _half(progress, place))
        for place, bag in enumerate((before, after))
    ]
    return _compared(sides[0], sides[1], options, named, (tuple(only[0]), tuple(only[1])))


def _read_in_parallel(
    bags: Sequence[Path], names: Sequence[str], progress: Progress | None
) -> list[RecordedCourses] | None:
    """Read long recordings each in a process of its own; None where that is not worth it, or one cannot be read."""
    where = Workers(None)
    if where.processes < 2 or sum(file.stat().st_size for bag in bags for file in BagReader(bag).files) < _LONG_BYTES:
        return None
    done: list[JobResult] = []

    def take(result: JobResult) -> None:
        done.append(result)
        if progress is not None:
            progress(len(done) / len(bags))

    jobs = [Job(f"{place} {bag}", read_courses, (bag, names)) for place, bag in enumerate(bags)]
    found = [item.result for item in run_jobs(jobs, where, take) if item.result is not None]
    return found if len(found) == len(bags) else None


def _all_asked(named: Sequence[str], options: ComparisonOptions) -> list[str]:
    """Return the names to read: what is compared, and what this needs."""
    others = [*options.references, *(text for text in options.references.values() if not is_number(text))]
    if options.event is not None:
        others.append(options.event.variable)
    known = {plain_name(name): name for name in reversed(named)}
    more = {plain_name(name): name for name in reversed(others) if plain_name(name) not in known}
    return [*named, *reversed(more.values())]


def _half(progress: Progress, place: int) -> Progress:
    return lambda share: progress((place + share) / 2)


def _compared(
    before: RecordedCourses,
    after: RecordedCourses,
    options: ComparisonOptions,
    named: Sequence[str],
    only: tuple[tuple[str, ...], tuple[str, ...]],
) -> Comparison:
    before, after, of_scales = _alike(before, after)
    labels = {plain_name(name): label for name, label in before.labels.items()}
    event = options.event
    if event is not None:
        event = Event(labels[plain_name(event.variable)], event.relation, event.value, event.text)
        before, after = _by_label(before), _by_label(after)
    alignment = aligned(before, after, event, options.event_from_ns, options.shift_ns)
    moves = alignment.move_before_ns, alignment.move_after_ns
    start_ns, end_ns = _common_part(before, after, moves, options)
    pairs = {
        label: (course.moved(moves[0]), after.courses[label].moved(moves[1]))
        for label, course in before.courses.items()
    }
    references = {labels[plain_name(name)]: text for name, text in options.references.items()}
    shown = dict.fromkeys([*(labels[plain_name(name)] for name in named), *references])
    measured_ns = max(start_ns, 0) if event is not None else start_ns
    found: list[Compared] = []
    for label in shown:
        one, two = pairs[label]
        differs = difference(one, two, start_ns, end_ns, options.tolerance)
        text = references.get(label, "")
        wanted: tuple[Course | float | None, Course | float | None] = (None, None)
        if text:
            wanted = (number(text), number(text)) if is_number(text) else pairs[labels[plain_name(text)]]
        asked = bool(text) or options.variables is not None or differs is None or differs.first is not None
        responses = None
        if asked and one.variable.kind is not DataType.BOOLEAN:
            name = text if not text or is_number(text) else labels[plain_name(text)]
            begins = before.start_ns + moves[0], after.start_ns + moves[1]
            from_rest = before.start_ns == 0 == after.start_ns
            responses = _responses(
                (one, two), name, wanted, (measured_ns, end_ns), begins, options.band_percent, from_rest=from_rest
            )
        drawn = tuple(item for item in wanted if isinstance(item, Course))
        found.append(Compared(one, two, differs, responses, drawn, _note(one, two, differs)))
    return Comparison(
        _side(before, moves[0]),
        _side(after, moves[1]),
        alignment,
        start_ns / NS_PER_S,
        end_ns / NS_PER_S,
        options.tolerance,
        tuple(found),
        *only,
        (*_notes(before, after, moves), *of_scales),
    )


def _by_label(recorded: RecordedCourses) -> RecordedCourses:
    labels = {label: label for label in recorded.courses}
    return replace(recorded, labels=labels)


def _alike(before: RecordedCourses, after: RecordedCourses) -> tuple[RecordedCourses, RecordedCourses, list[str]]:
    """Return both with what has a scale in one of them alone as counts (decision), and notes on scales that differ."""
    notes, plain = [], set()
    for label in dict.fromkeys([*before.scales, *after.scales]):
        one, two = before.scales.get(label), after.scales.get(label)
        if one is None or two is None:
            plain.add(label)
            notes.append(f"{label} has a scale {'before' if two is None else 'after'} alone: it is compared in counts")
        elif one != two:
            notes.append(f"{label} has another scale after than before; whether it differs is decided on counts")
    return _in_counts(before, plain), _in_counts(after, plain), notes


def _in_counts(recorded: RecordedCourses, labels: set[str]) -> RecordedCourses:
    courses = {
        label: replace(course.in_memory, variable=replace(course.variable, unit="counts"))
        if label in labels
        else course
        for label, course in recorded.courses.items()
    }
    return replace(recorded, courses=courses)


def _common_part(
    before: RecordedCourses, after: RecordedCourses, moves: tuple[int, int], options: ComparisonOptions
) -> tuple[int, int]:
    """Return the part of the common axis that is compared, ns.

    Raises:
        UsageError: there is none.
    """
    starts = [recorded.start_ns + move for recorded, move in zip((before, after), moves, strict=True)]
    ends = [recorded.end_ns + move for recorded, move in zip((before, after), moves, strict=True)]
    start_ns, end_ns = max(starts), min(ends)
    if start_ns > end_ns:
        texts = [
            f"{recorded.bag} is from {time_text(start)} to {time_text(end)} s"
            for recorded, start, end in zip((before, after), starts, ends, strict=True)
        ]
        raise UsageError(
            f"the recordings have no time in common: {', '.join(texts)}", "align them by an event with --align"
        )
    wanted = start_ns if options.start_ns is None else options.start_ns
    until = end_ns if options.end_ns is None else options.end_ns
    if wanted > end_ns or until < start_ns:
        what = f"both recordings are there from {time_text(start_ns)} to {time_text(end_ns)} s"
        raise UsageError(f"--from and --to: the range is outside of what is compared; {what}")
    return max(start_ns, wanted), min(end_ns, until)


def _responses(
    courses: tuple[Course, Course],
    name: str,
    wanted: Sequence[Course | float | None],
    part_ns: tuple[int, int],
    begins_ns: tuple[int, int],
    band_percent: float,
    *,
    from_rest: bool,
) -> Responses | None:
    """Return the responses of a variable; without a reference only those to a step, None where there are none.

    ``begins_ns`` is when each recording begins, ``from_rest`` whether with its run, before which all is at rest. One
    that lacks the time before the step counts as steady there if the other one is.
    """
    found = [
        response(course, reference, *part_ns, band_percent) for course, reference in zip(courses, wanted, strict=True)
    ]
    before, after = found
    if before is None or after is None:
        return None
    if not name:
        length_ns = part_ns[1] - part_ns[0]
        steady = [
            steady_before(course, item, begin, length_ns, band_percent)
            for course, item, begin in zip(courses, (before, after), begins_ns, strict=True)
        ]
        if False in steady or (True not in steady and not from_rest):
            return None
        if not (is_step_like(before, part_ns[1]) and is_step_like(after, part_ns[1])):
            return None
    return Responses(name, before, after)


def _note(one: Course, two: Course, differs: Difference | None) -> str:
    if differs is None:
        return "no value in both recordings at the same time"
    texts = []
    if one.variable.kind is not two.variable.kind:
        texts.append(f"{one.variable.kind.word} before, {two.variable.kind.word} after")
    if one.variable.unit.strip() != two.variable.unit.strip():
        units = [course.variable.unit.strip() or "no unit" for course in (one, two)]
        texts.append(f"{units[0]} before, {units[1]} after")
    return "; ".join(texts)


def _side(recorded: RecordedCourses, move_ns: int) -> Side:
    return Side(
        recorded.bag,
        recorded.rack,
        (recorded.start_ns + move_ns) / NS_PER_S,
        (recorded.end_ns + move_ns) / NS_PER_S,
    )


def _notes(before: RecordedCourses, after: RecordedCourses, moves: tuple[int, int]) -> Iterable[str]:
    for which, recorded in (("before", before), ("after", after)):
        if recorded.edited:
            yield f"the run {which} is a rerun, {recorded.edited}"
    if before.rack != after.rack:
        yield f"the recordings are of two racks, {before.rack[:40]} and {after.rack[:40]}"
    apart_ns = (after.end_ns + moves[1]) - (before.end_ns + moves[0])
    if apart_ns:
        which = "before" if apart_ns > 0 else "after"
        yield f"the recording {which} ends {seconds_text(abs(apart_ns))} s earlier than the other one"


def summary(found: Comparison) -> str:
    """Return the outcome in a sentence."""
    differing, whole = len(found.differing), len(found.variables)
    compared = f"{count_of(whole, 'variable')} compared"
    verdict = f"{differing} differ{'s' if differing == 1 else ''}" if differing else "none differs"
    counts = " counts" if any(item.is_scaled for item in found.variables) else ""
    allowed = f" by more than {found.tolerance:g}{counts}" if found.tolerance else ""
    return f"{compared}: {verdict}{allowed}"
