"""One run of a sweep: a new rack in simulated time, from its values to its measures."""

from __future__ import annotations

import hashlib
import platform
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from automax_ros.core.problems import Severity
from automax_ros.core.text import printable
from automax_ros.core.ticks import NS_PER_MS
from automax_ros.core.user_error import UserError
from automax_ros.rack.rack import Rack
from automax_ros.rackfile.reading.files import FileFault, read_bytes
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.scenario.stimuli.player import StimuliPlayer
from automax_ros.scenario.stimuli.reader import MOST_BYTES, read_for_rack
from automax_ros.sweep.measures import FUNCTIONS, Measure, Subject
from automax_ros.sweep.points import Point
from automax_ros.sweep.quantities import Beginning, Quantity
from automax_ros.sweep.rack_template import RackTemplate
from automax_ros.sweep.watching import Watch

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

    blueprint: RackTemplate
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
class Outcome:
    """Result of a run: a number or None for each measure; ``fault`` is the reason of a failure, or ""."""

    measures: tuple[float | None, ...]
    fault: str = ""


def run_points(plan: Plan, points: Sequence[Point]) -> list[Outcome]:
    """Run points one after the other, as one job; raises UserError if the stimuli file differs from the plan's."""
    if plan.stimuli is not None and _digest(plan.stimuli.path) != plan.stimuli.digest:
        raise UserError(f"the stimuli file {plan.stimuli.path} is another one on {platform.node()}")
    return [run_point(plan, point) for point in points]


def run_point(
    plan: Plan,
    point: Point,
    attend: Callable[[Rack], Callable[[], None]] | None = None,
    should_stop: Callable[[], bool] = lambda: False,
) -> Outcome:
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
    return Outcome((None,) * len(plan.measures), printable(why))


def _run(
    plan: Plan,
    beginning: Beginning,
    attend: Callable[[Rack], Callable[[], None]] | None,
    should_stop: Callable[[], bool],
) -> Outcome:
    rack = plan.blueprint.rack(beginning.plants)
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
    values.update((item, _of_rack(rack, item)) for item in plan.measures if not item.is_of_common)
    refused = next((line for line in stimulation.news()), "")
    return Outcome(tuple(values.get(item) for item in plan.measures), fault or refused)


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
