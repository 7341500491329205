"""Runs the points of a sweep, in this process, in several, or on a cluster: the same rows in the same order."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

from automax_ros.parallel.job import Job, JobResult, Workers
from automax_ros.parallel.run import run_jobs
from automax_ros.sweep.points import Point
from automax_ros.sweep.run import Outcome, Plan, run_points

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
    outcome: Outcome


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
        plan.blueprint.prepare()
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
        outcomes = [Outcome((None,) * len(plan.measures), str(done.fault))] * len(points)
    for number, (point, outcome) in enumerate(zip(points, outcomes, strict=True), start=first + 1):
        yield Row(number, point, outcome)


def best_rows(rows: Sequence[Row], measure: int, *, greatest: bool = False) -> list[Row]:
    """Return the rows without a fault that have a measure, the best first; of equal ones the earlier first."""
    sign = -1 if greatest else 1
    found = ((row.outcome.measures[measure], row) for row in rows if not row.outcome.fault)
    known = [(sign * value, row.number, row) for value, row in found if value is not None]
    return [row for _, _, row in sorted(known, key=lambda item: item[:2])]
