"""The time of one Processor: pre-emption, order among equals, overlap; against a model that counts every ns."""

from __future__ import annotations

from dataclasses import dataclass, field

import pytest
from compile.support import repeatable
from hypothesis import given
from hypothesis import strategies as st

from automax_ros.runtime.scan.modeled_execution import ModeledExecution
from automax_ros.runtime.time.scheduler import EventClass, EventKey, Scheduler

Moments = list[tuple[int, str, int]]
"""Instant, name of the job, number of its step (0: begun)."""


@dataclass(eq=False)
class Job:
    """A stand-in for a task's scan: steps that cost what it is told, each noted at its instant."""

    name: str
    priority: int
    costs: tuple[int, ...]
    moments: Moments = field(default_factory=list)
    ended: list[tuple[int, int]] = field(default_factory=list)
    inside: object = None

    def steps(self, now_ns, skipped):
        self.moments.append((now_ns, self.name, 0))
        self.skipped = skipped
        for number, cost in enumerate(self.costs, 1):
            later = yield cost
            now_ns = now_ns if later is None else later
            self.moments.append((now_ns, self.name, number))
            if self.inside:
                self.inside(now_ns, number)
        return now_ns

    def done(self, record):
        self.ended.append((record, self.skipped))


class Rig:
    """Jobs that are due periodically on one Processor; one that is due while it is under way is an overlap."""

    def __init__(self, *jobs: tuple[Job, int, int]) -> None:
        self.scheduler, self.moments, self.overlaps = Scheduler(), [], []
        self.time = ModeledExecution(self.scheduler, "processor_1")
        for job, first, period in jobs:
            job.moments = self.moments
            key = EventKey(EventClass.SCAN, job.priority, job.name)
            self.scheduler.every(period, first, key, lambda now, skipped, job=job: self.due(job, now, skipped))

    def due(self, job, now, skipped):
        if self.time.busy(job):
            self.overlaps.append((now, job.name))
        else:
            self.time.begin(job, now, skipped)


def test_a_higher_priority_suspends_a_lower_one_that_goes_on_after_it():
    low, high = Job("LOW", 8, (10, 40, 5)), Job("HIGH", 5, (3, 4))
    rig = Rig((low, 0, 1000), (high, 30, 1000))
    rig.scheduler.run_until(100)
    assert rig.moments == [
        (0, "LOW", 0),
        (10, "LOW", 1),
        (30, "HIGH", 0),
        (33, "HIGH", 1),
        (37, "HIGH", 2),
        (57, "LOW", 2),
        (62, "LOW", 3),
    ]
    assert (low.ended, high.ended) == ([(62, 0)], [(37, 0)])


@pytest.mark.parametrize(
    ("jobs", "steps"),
    [
        # Z runs when A and B become due: it is not suspended, and A goes first after it though B was due first.
        ([("Z", 6, 10, 0), ("B", 6, 4, 3), ("A", 6, 4, 5)], [(10, "Z", 1), (14, "A", 1), (18, "B", 1)]),
        # One that was suspended goes on before an equal that became due meanwhile.
        ([("Z", 6, 10, 0), ("HIGH", 4, 5, 3), ("A", 6, 2, 4)], [(8, "HIGH", 1), (15, "Z", 1), (17, "A", 1)]),
        ([("C", 9, 9, 0), ("B", 7, 9, 3), ("A", 5, 9, 6)], [(15, "A", 1), (21, "B", 1), (27, "C", 1)]),
    ],
    ids=["equals in alphabetical order", "suspended before equal", "three levels"],
)
def test_jobs_of_one_step_end_in_their_order(jobs, steps):
    rig = Rig(*((Job(name, priority, (cost,)), due, 1000) for name, priority, cost, due in jobs))
    rig.scheduler.run_until(100)
    assert [moment for moment in rig.moments if moment[2]] == steps


def test_a_job_that_ends_exactly_when_it_is_due_again_has_ended():
    rig = Rig((Job("A", 5, (4, 6)), 0, 10))
    rig.scheduler.run_until(31)
    assert rig.overlaps == []
    assert [moment for moment in rig.moments if moment[2] == 0] == [(due, "A", 0) for due in (0, 10, 20, 30)]


def test_one_ns_more_is_an_overlap():
    rig = Rig((Job("A", 5, (4, 7)), 0, 10))
    rig.scheduler.run_until(31)
    assert rig.overlaps == [(10, "A"), (30, "A")]


def test_one_that_has_not_begun_when_it_is_due_again_is_an_overlap_too():
    rig = Rig((Job("A", 4, (25,)), 0, 100), (Job("B", 5, (1,)), 5, 10))
    rig.scheduler.run_until(40)
    assert rig.overlaps == [(15, "B"), (25, "B")]
    assert [moment[0] for moment in rig.moments if moment[1] == "B"] == [25, 26, 35, 36]


def test_a_dropped_job_makes_room_and_its_steps_end():
    low, high = Job("LOW", 8, (10, 40)), Job("HIGH", 5, (50,))
    rig = Rig((low, 0, 1000), (high, 20, 1000))
    rig.scheduler.at(40, EventKey(EventClass.OUTSIDE, 0, "X"), lambda _: rig.time.drop(high))
    rig.scheduler.run_until(200)
    assert rig.moments == [(0, "LOW", 0), (10, "LOW", 1), (20, "HIGH", 0), (70, "LOW", 2)]
    assert (low.ended, high.ended) == ([(70, 0)], [])
    assert not rig.time.busy(high)


def test_a_job_that_is_dropped_by_its_own_step_goes_no_further():
    job = Job("A", 5, (3, 3, 3))
    rig = Rig((job, 0, 1000))
    job.inside = lambda _, number: rig.time.drop(job) if number == 2 else None
    rig.scheduler.run_until(100)
    assert rig.moments == [(0, "A", 0), (3, "A", 1), (6, "A", 2)]
    assert job.ended == []


def test_a_job_that_a_step_begins_waits_for_that_step():
    """A task that sets an event which a higher priority waits for is suspended right after it."""
    low, high = Job("LOW", 8, (3, 3)), Job("HIGH", 4, (2,))
    rig = Rig((low, 0, 1000))
    high.moments = rig.moments
    low.inside = lambda now, number: rig.time.begin(high, now, 0) if number == 1 else None
    rig.scheduler.run_until(100)
    assert rig.moments == [(0, "LOW", 0), (3, "LOW", 1), (3, "HIGH", 0), (5, "HIGH", 1), (8, "LOW", 2)]


timetable = st.lists(
    st.tuples(st.integers(4, 6), st.integers(0, 12), st.integers(4, 30), st.lists(st.integers(0, 7), max_size=4)),
    min_size=1,
    max_size=5,
)
"""Priority, first instant, period, costs of the steps; names follow from the place in the list."""


def counted(tasks, end) -> tuple[Moments, list[tuple[int, str]]]:
    """What happens and the overlaps, by counting every ns: no queue, no suspended generators."""
    under_way: dict[str, list] = {}  # name -> [priority, begun, step number, ns left of the step]
    moments, overlaps = [], []

    def take_up():
        """Let all steps happen that take no more time, in the order of the Processor."""
        while under_way:
            name = min(under_way, key=lambda name: (under_way[name][0], not under_way[name][1], name))
            state, costs = under_way[name], named[name][3]
            if not state[1]:
                moments.append((now, name, 0))
                state[1], state[3] = True, costs[0] if costs else 0
            while state[3] == 0 and state[2] < len(costs):
                state[2] += 1
                moments.append((now, name, state[2]))
                state[3] = costs[state[2]] if state[2] < len(costs) else 0
            if state[2] < len(costs):
                return
            del under_way[name]

    named = {f"T{(number * 3) % 7}{number}": task for number, task in enumerate(tasks)}
    order = sorted(named, key=lambda name: (named[name][0], name))
    for now in range(end):
        take_up()
        for name in order:
            priority, first, period, _ = named[name]
            if now >= first and (now - first) % period == 0:
                if name in under_way:
                    overlaps.append((now, name))
                else:
                    under_way[name] = [priority, False, 0, 0]
                    take_up()
        running = [name for name, state in under_way.items() if state[1]]
        if running:
            # Of those begun the highest priority has the Processor: there is one of each priority at most.
            under_way[min(running, key=lambda name: under_way[name][0])][3] -= 1
    return moments, overlaps


def rig_of(tasks) -> Rig:
    return Rig(
        *(
            (Job(f"T{(number * 3) % 7}{number}", priority, tuple(costs)), first, period)
            for number, (priority, first, period, costs) in enumerate(tasks)
        )
    )


@given(timetable, st.lists(st.integers(1, 120), min_size=1, max_size=5))
@repeatable(400)
def test_every_instant_is_that_of_the_model(tasks, ends):
    """However simulated time is cut into pieces."""
    rig = rig_of(tasks)
    for end in sorted(ends):
        rig.scheduler.run_until(end)
    assert (rig.moments, rig.overlaps) == counted(tasks, max(ends))


@given(timetable)
@repeatable(100)
def test_a_wall_clock_that_is_never_late_by_a_period_gives_the_same(tasks):
    """Each call carries out all that is due up to then, whatever it makes due meanwhile."""
    rig = rig_of(tasks)
    for now in range(3, 100, 3):
        rig.scheduler.run_due(now)
    assert (rig.moments, rig.overlaps) == counted(tasks, rig.scheduler.now_ns + 1)
