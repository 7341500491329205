"""The runs of a sweep: each a new rack in simulated time, from its values to its measures."""

from __future__ import annotations

import hashlib
import platform
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from automax_ros.compile.native.run.forms import IN_PYTHON, NativeForms
from automax_ros.core.diagnostics import SourceText
from automax_ros.core.problems import Severity
from automax_ros.core.text import printable
from automax_ros.core.ticks import NS_PER_MS
from automax_ros.core.user_error import UserError
from automax_ros.parallel.job import Job, JobResult, Workers
from automax_ros.parallel.run import run_jobs
from automax_ros.rack.rack import Rack
from automax_ros.rack.tasks.installation import Installation
from automax_ros.rackfile.loader import load_stored
from automax_ros.rackfile.model.config import RackConfig
from automax_ros.rackfile.plant_numbers import PlantNumber, with_numbers
from automax_ros.rackfile.reading.files import FileFault, read_bytes
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.scenario.stimuli.player import StimuliPlayer
from automax_ros.scenario.stimuli.reader import MOST_BYTES, read_for_rack
from automax_ros.sweep.measures import FUNCTIONS, Measure, Subject
from automax_ros.sweep.points import Point
from automax_ros.sweep.quantities import Beginning, Quantity
from automax_ros.sweep.watching import Watch


@dataclass(frozen=True)
class RackTemplate:
    """A rack file's text and path, and the sources of the tasks by name: no file is read again.

    ``native`` selects which tasks scan as machine code, which changes no result.
    """

    text: str
    path: str
    sources: tuple[tuple[str, SourceText], ...]
    native: NativeForms = IN_PYTHON

    @classmethod
    def of(cls, rack: Rack, native: NativeForms = IN_PYTHON) -> RackTemplate:
        """Return the template of a rack as it is installed."""
        return cls(rack.config.text, str(rack.config.path), tuple(rack.sources.items()), native)

    def prepare(self) -> None:
        """Compile the tasks, so that copies of this process need not."""
        _installation(self)

    def rack(self, plants: Mapping[PlantNumber, str]) -> Rack:
        """Return a new rack with some other numbers of its plants.

        Raises:
            UserError: with these numbers the rack file has errors.
        """
        config = _config(self.text, self.path, tuple(plants.items()))
        return Rack(config, installation=_installation(self).again(config))


@lru_cache(maxsize=1)
def _config(text: str, path: str, numbers: tuple[tuple[PlantNumber, str], ...] = ()) -> RackConfig:
    result = load_stored(SourceText(path, with_numbers(text, dict(numbers))), Path(path))
    if result.config is None:
        first = next(item for item in result.diagnostics if item.severity is Severity.ERROR)
        raise UserError(first.message, first.hint, code=first.code)
    return result.config


@lru_cache(maxsize=1)
def _installation(template: RackTemplate) -> Installation:
    config = _config(template.text, template.path)
    return Installation(config, sources=dict(template.sources), native=template.native)


_SLICE_NS = 100 * NS_PER_MS
"""Rack time after which the write log is read, which grows meanwhile."""


@dataclass(frozen=True)
class Stimuli:
    """A stimuli file, which each process reads: ``digest`` is that of its bytes, so that all read the same."""

    path: Path
    digest: str
    allow_outside: bool = False

    @classmethod
    def of(cls, path: Path, *, allow_outside: bool) -> Stimuli:
        """Return a file as it is now; raises UserError if it cannot be read."""
        return cls(path.absolute(), _digest(path), allow_outside)


@dataclass(frozen=True)
class Plan:
    """The common part of all runs of a sweep."""

    template: RackTemplate
    quantities: tuple[Quantity, ...]
    measures: tuple[Measure, ...]
    duration_ns: int
    stimuli: Stimuli | None = None

    def beginning(self, point: Point) -> Beginning:
        """Return the start values for the run of a point."""
        beginning = Beginning()
        for quantity, value in zip(self.quantities, point, strict=True):
            quantity.give(value, beginning)
        return beginning


@dataclass(frozen=True)
class RunOutcome:
    """Result of a run: a number or None for each measure; ``fault`` is the reason of a failure, or ""."""

    measures: tuple[float | None, ...]
    fault: str = ""


def run_points(plan: Plan, points: Sequence[Point]) -> list[RunOutcome]:
    """Run points one after the other, as one job; raises UserError if the stimuli file differs from the plan's."""
    if plan.stimuli is not None and _digest(plan.stimuli.path) != plan.stimuli.digest:
        raise UserError(f"the stimuli file {plan.stimuli.path} is another one on {platform.node()}")
    return [run_point(plan, point) for point in points]


def run_point(
    plan: Plan,
    point: Point,
    attend: Callable[[Rack], Callable[[], None]] | None = None,
    should_stop: Callable[[], bool] = lambda: False,
) -> RunOutcome:
    """Run one point; any error becomes the outcome's fault, so that it ends no other run (decision).

    A run that a fault stops has no measures but ``errors`` and ``stopped`` (decision): STOP ALL clears the commons that
    they would measure. ``attend`` is called with the rack before it starts and returns a function that is called at its
    end. If ``should_stop`` returns TRUE, the run ends there, and its outcome is not valid.
    """
    try:
        return _run(plan, plan.beginning(point), attend, should_stop)
    except BagError:
        raise
    except UserError as fault:
        why = fault.message
    except Exception as error:
        why = f"{type(error).__name__}: {error}"
    return RunOutcome((None,) * len(plan.measures), printable(why))


def _run(
    plan: Plan,
    beginning: Beginning,
    attend: Callable[[Rack], Callable[[], None]] | None,
    should_stop: Callable[[], bool],
) -> RunOutcome:
    rack = plan.template.rack(beginning.plants)
    stimulation = _stimulation(rack, plan.stimuli)
    for item in beginning.tunings:
        rack.tune(rack.task(item.task), item.name, item.value)
    end = attend(rack) if attend is not None else None
    try:
        rack.start(beginning.settings, stimulation.begin)
        watch = Watch(rack, plan.measures, plan.duration_ns)
        _pass(rack, plan, stimulation, should_stop)
    finally:
        if end is not None:
            end()
    stopped = rack.operations.stopped
    fault = stopped.reason if stopped is not None and stopped.is_fault else ""
    values = watch.results(plan.duration_ns) if not fault else {}
    values.update((item, _of_rack(rack, item)) for item in plan.measures if not item.is_watched)
    refused = next((line for line in stimulation.news()), "")
    return RunOutcome(tuple(values.get(item) for item in plan.measures), fault or refused)


def _pass(rack: Rack, plan: Plan, stimulation: StimuliPlayer, should_stop: Callable[[], bool]) -> None:
    """Advance time as `automax run` does: after a fault only while stimuli may put the rack into RUN again."""
    while rack.now_ns < plan.duration_ns and not should_stop():
        if rack.stop_reason is not None and (plan.stimuli is None or stimulation.is_over):
            cause = rack.operations.stopped
            if cause is None or cause.is_fault:
                return
        rack.scheduler.run_until(min(rack.now_ns + _SLICE_NS, plan.duration_ns))
        rack.observers.report_writes()


def _stimulation(rack: Rack, stimuli: Stimuli | None) -> StimuliPlayer:
    if stimuli is None:
        return StimuliPlayer((), rack.scheduler)
    file = read_for_rack(stimuli.path, rack, allow_outside=stimuli.allow_outside)
    if file.stimuli is None:
        first = next(item for item in file.diagnostics if item.severity is Severity.ERROR)
        raise UserError(f"stimuli: {first.message}", first.hint)
    return StimuliPlayer(file.stimuli, rack.scheduler)


def _of_rack(rack: Rack, measure: Measure) -> float:
    if FUNCTIONS[measure.function].subject is Subject.TASK:
        return rack.task(measure.subject).errors.count
    return int(rack.stop_reason is not None)


def _digest(path: Path) -> str:
    try:
        return hashlib.sha256(read_bytes(path, MOST_BYTES)).hexdigest()
    except FileFault as fault:
        raise UserError(f"the stimuli file {path} {fault}") from fault


_PIECES_EACH = 8
"""Pieces per process (decision): so that all end at about the same time."""
_CLUSTER_PIECES = 256
"""Pieces for a cluster, whose size is not known (decision)."""
_MOST_IN_PIECE = 50
"""Most runs of a piece (decision): those that are lost with a worker."""


@dataclass(frozen=True)
class Row:
    """A run: its number from 1 on, its values, its outcome."""

    number: int
    point: Point
    outcome: RunOutcome


def run_sweep(
    plan: Plan,
    points: Sequence[Point],
    where: Workers,
    on_rows: Callable[[list[Row]], None] = lambda _: None,
    should_stop: Callable[[], bool] = lambda: False,
) -> list[Row]:
    """Run all points; return a row for each in their order, or fewer if ``should_stop`` ended it early.

    ``on_rows`` receives rows as they come, in any order. A row depends on nothing but the plan and its point.

    Raises:
        ClusterFault: the cluster cannot be used.
    """
    size = _size(len(points), where)
    pieces = [_piece(plan, points, first, size) for first in range(0, len(points), size)]
    firsts = {piece.name: number * size for number, piece in enumerate(pieces)}

    def rows_of(done: JobResult) -> list[Row]:
        return list(_rows(done, firsts[done.piece.name]))

    if where.scheduler is None:
        plan.template.prepare()
    found = run_jobs(pieces, where, lambda done: on_rows(rows_of(done)), should_stop)
    return [row for done in found for row in rows_of(done)]


def _size(count: int, where: Workers) -> int:
    if where.scheduler is None and where.processes == 1:
        return 1
    pieces = _CLUSTER_PIECES if where.scheduler is not None else where.processes * _PIECES_EACH
    return max(1, min(_MOST_IN_PIECE, count // pieces))


def _piece(plan: Plan, points: Sequence[Point], first: int, size: int) -> Job:
    some = tuple(points[first : first + size])
    name = f"run {first + 1}" if len(some) == 1 else f"runs {first + 1} to {first + len(some)}"
    return Job(name, run_points, (plan, some))


def _rows(done: JobResult, first: int) -> Iterable[Row]:
    plan, points = done.piece.arguments
    outcomes = done.result
    if outcomes is None:
        outcomes = [RunOutcome((None,) * len(plan.measures), str(done.fault))] * len(points)
    for number, (point, outcome) in enumerate(zip(points, outcomes, strict=True), start=first + 1):
        yield Row(number, point, outcome)


def best_rows(rows: Sequence[Row], measure: int, *, greatest: bool = False) -> list[Row]:
    """Return the rows without a fault that have a measure, the best first; of equal ones the earlier first."""
    sign = -1 if greatest else 1
    found = ((row.outcome.measures[measure], row) for row in rows if not row.outcome.fault)
    known = [(sign * value, row.number, row) for value, row in found if value is not None]
    return [row for _, _, row in sorted(known, key=lambda item: item[:2])]
