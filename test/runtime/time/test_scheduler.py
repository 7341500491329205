"""The scheduler: order of events, simulated time, the wall clock's grid; against a brute-force model."""

from __future__ import annotations

import itertools

import pytest
from compile.support import repeatable
from hypothesis import given
from hypothesis import strategies as st

from automax_ros.runtime.time.scheduler import EventClass, EventKey, Scheduler


def key(name="E", priority=0, event_class=EventClass.SCAN) -> EventKey:
    return EventKey(event_class, priority, name)


class Journal:
    """Notes what happens and when."""

    def __init__(self) -> None:
        self.entries: list[tuple[int, str]] = []

    def once(self, name):
        return lambda now: self.entries.append((now, name))

    def periodic(self, name):
        return lambda now, skipped: self.entries.append((now, name) if not skipped else (now, f"{name}+{skipped}"))


def test_order_is_time_class_priority_name():
    scheduler, journal = Scheduler(), Journal()
    keys = [
        key("B", 5),
        key("A", 5),
        key("C", 4),
        key("OBSERVER", 0, EventClass.OBSERVE),
        key("SET", 0, EventClass.OUTSIDE),
        key("INPUT", 0, EventClass.IO),
        key("BOOT", 0, EventClass.START),
    ]
    for order in itertools.islice(itertools.permutations(keys), 0, 5040, 97):
        scheduler, journal = Scheduler(), Journal()
        for one in order:
            scheduler.at(10, one, journal.once(one.name))
        scheduler.at(9, key("Z", 11), journal.once("EARLIER"))
        scheduler.run_until(11)
        names = [name for _, name in journal.entries]
        assert names == ["EARLIER", "SET", "BOOT", "INPUT", "C", "A", "B", "OBSERVER"]


def test_run_until_stops_before_its_end_and_goes_on_there():
    scheduler, journal = Scheduler(), Journal()
    scheduler.every(10, 0, key(), journal.periodic("E"))
    scheduler.run_until(20)
    assert ([now for now, _ in journal.entries], scheduler.now_ns, scheduler.next_ns) == ([0, 10], 20, 20)
    scheduler.run_until(21)
    assert [now for now, _ in journal.entries] == [0, 10, 20]
    scheduler.run_until(5)
    assert scheduler.now_ns == 21


def test_events_at_one_key_and_instant_keep_the_order_of_posting():
    scheduler, journal = Scheduler(), Journal()
    for number in range(5):
        scheduler.at(1, key(), journal.once(str(number)))
    scheduler.run_until(2)
    assert [name for _, name in journal.entries] == list("01234")


def test_events_may_post_and_cancel_events():
    scheduler, journal = Scheduler(), Journal()
    victim = scheduler.at(30, key("VICTIM"), journal.once("VICTIM"))

    def post(now):
        journal.entries.append((now, "POST"))
        scheduler.at(now, key("NOW", 11), journal.once("NOW"))
        scheduler.at(now + 5, key("LATER"), journal.once("LATER"))
        victim.cancel()

    scheduler.at(10, key("POST"), post)
    scheduler.run_until(100)
    assert journal.entries == [(10, "POST"), (10, "NOW"), (15, "LATER")]


def test_a_periodic_event_may_cancel_itself():
    scheduler, journal = Scheduler(), Journal()

    def tick(now, _):
        journal.entries.append((now, "TICK"))
        if now == 20:
            event.cancel()

    event = scheduler.every(10, 0, key(), tick)
    scheduler.run_until(100)
    event.cancel()
    assert journal.entries == [(0, "TICK"), (10, "TICK"), (20, "TICK")]
    assert scheduler.next_ns is None


def test_what_cannot_be_is_refused():
    scheduler = Scheduler(100)
    with pytest.raises(ValueError, match="before the present"):
        scheduler.at(99, key(), print)
    with pytest.raises(ValueError, match="before the present"):
        scheduler.every(5, 99, key(), print)
    with pytest.raises(ValueError, match="not positive"):
        scheduler.every(0, 200, key(), print)


def test_late_events_happen_once_at_their_last_instant_and_stay_on_the_grid():
    scheduler, journal = Scheduler(), Journal()
    scheduler.every(10, 0, key(), journal.periodic("E"))
    for now in (0, 9, 10, 47, 50, 51):
        scheduler.run_due(now)
    assert journal.entries == [(0, "E"), (10, "E"), (40, "E+2"), (50, "E")]
    assert scheduler.next_ns == 60


def test_late_events_happen_in_the_order_of_the_instants_they_happen_at():
    """A that skipped stands at 20 now: B at 5 comes before it, C at 20 after it by its priority."""
    scheduler, journal = Scheduler(), Journal()
    scheduler.every(10, 0, key("A", 5), journal.periodic("A"))
    scheduler.every(100, 5, key("B", 9), journal.periodic("B"))
    scheduler.at(20, key("C", 11), journal.once("C"))
    scheduler.at(20, key("D", 4), journal.once("D"))
    scheduler.run_due(25)
    assert journal.entries == [(5, "B"), (20, "D"), (20, "A+2"), (20, "C")]
    assert scheduler.now_ns == 25


def test_what_becomes_due_meanwhile_happens_in_its_order():
    """A Processor that goes on in modeled time posts what it does next while a late call is carried out."""
    scheduler, journal = Scheduler(), Journal()
    scheduler.at(10, key("FIRST"), lambda now: scheduler.at(now + 3, key("SECOND"), journal.once("SECOND")))
    scheduler.at(12, key("BEFORE"), journal.once("BEFORE"))
    scheduler.at(14, key("AFTER"), journal.once("AFTER"))
    scheduler.at(10, key("LATER"), lambda now: scheduler.at(now + 11, key("FUTURE"), journal.once("FUTURE")))
    scheduler.run_due(20)
    assert journal.entries == [(12, "BEFORE"), (13, "SECOND"), (14, "AFTER")]
    assert scheduler.next_ns == 21


def test_an_action_may_go_on_to_a_later_instant_unless_something_comes_before():
    """Up to the end of the time that passes; an event of that instant and a lower key goes before it."""
    scheduler, going = Scheduler(), key("ME", 5, EventClass.EXECUTE)
    answers = []

    def go(now):
        instants = (now + 4, now + 5, now + 9, now + 10)
        answers.extend((later, scheduler.advance_to(later, going), scheduler.now_ns) for later in instants)

    scheduler.at(10, going, go)
    gone = scheduler.at(11, key("GONE"), go)
    gone.cancel()
    scheduler.at(15, key("SCAN", 4), lambda _: None)
    scheduler.run_until(16)
    assert answers == [(14, True, 14), (15, True, 15), (19, False, 15), (20, False, 15)]
    answers.clear()
    scheduler.at(20, going, go)
    scheduler.run_due(25)
    assert answers == [(24, True, 24), (25, True, 25), (29, False, 25), (30, False, 25)]


def test_an_event_that_another_due_one_cancels_does_not_happen():
    scheduler, journal = Scheduler(), Journal()
    victim = scheduler.every(10, 10, key("VICTIM", 5), journal.periodic("VICTIM"))
    scheduler.at(10, key("FIRST", 4), lambda _: victim.cancel())
    scheduler.run_due(30)
    scheduler.run_due(90)
    assert journal.entries == []


posted = st.lists(
    st.tuples(
        st.integers(0, 30),
        st.sampled_from([0, 0, 3, 5, 7]),
        st.sampled_from(list(EventClass)),
        st.integers(4, 6),
        st.sampled_from("ABC"),
        st.integers(0, 40),
    ),
    max_size=8,
)
"""First instant, period or 0, class, priority, name, and the instant from which on it is cancelled."""


def model_run(events, ends) -> list[tuple[int, int]]:
    """Instant and number of what happens: every instant, every event in its order, no queue."""
    happened = []
    for now in range(ends[-1]):
        due = [
            (event_class, priority, name, number)
            for number, (first, period, event_class, priority, name, _) in enumerate(events)
            if now == first or (period and now > first and (now - first) % period == 0)
        ]
        happened += [(now, number) for *_, number in sorted(due, key=lambda item: item[:3])]
    return happened


@given(posted, st.lists(st.integers(1, 60), min_size=1, max_size=4))
@repeatable(200)
def test_simulated_time_against_the_model(events, ends):
    """However time is cut into pieces. Events of one instant and key may stand in any order of theirs."""
    scheduler, happened = Scheduler(), []
    for number, (first, period, event_class, priority, name, _) in enumerate(events):
        one = EventKey(event_class, priority, name)
        if period:
            scheduler.every(period, first, one, lambda now, _, number=number: happened.append((now, number)))
        else:
            scheduler.at(first, one, lambda now, number=number: happened.append((now, number)))
    ends = sorted(ends)
    for end in ends:
        scheduler.run_until(end)

    def alike(entry):
        now, number = entry
        return (now, *events[number][2:5])

    expected = model_run(events, ends)
    assert list(map(alike, happened)) == list(map(alike, expected))
    assert sorted(happened) == sorted(expected)


@given(posted, st.lists(st.integers(0, 25), min_size=1, max_size=8))
@repeatable(200)
def test_the_wall_clock_against_the_model(events, waits):
    """Each call carries out the last passed instant of every event, counts the ones before it, and orders them."""
    scheduler, happened = Scheduler(), []
    for number, (first, period, event_class, priority, name, _) in enumerate(events):
        one = EventKey(event_class, priority, name)
        if period:
            scheduler.every(period, first, one, lambda now, late, number=number: happened.append((now, number, late)))
        else:
            scheduler.at(first, one, lambda now, number=number: happened.append((now, number, 0)))
    before, now, expected = -1, 0, []
    for wait in waits:
        now += wait
        scheduler.run_due(now)
        passed = []
        for number, (first, period, event_class, priority, name, _) in enumerate(events):
            instants = range(first, now + 1, period) if period else range(first, min(first, now) + 1)
            new = [instant for instant in instants if before < instant <= now]
            if new:
                passed.append(((new[-1], event_class, priority, name), number, len(new) - 1))
        expected.append([(place, sorted_number, late) for place, sorted_number, late in passed])
        before = now

    def placed(entry):
        instant, number, _ = entry
        return (instant, *events[number][2:5])

    position = 0
    for passed in expected:
        part = happened[position : position + len(passed)]
        position += len(passed)
        assert list(map(placed, part)) == sorted(place for place, _, _ in passed)
        assert sorted(part) == sorted((place[0], number, late) for place, number, late in passed)
    assert position == len(happened)


@given(posted, st.integers(1, 60))
@repeatable(60)
def test_the_same_posts_give_the_same_run(events, end):
    def journal():
        scheduler, happened, made = Scheduler(), [], []
        for number, (first, period, event_class, priority, name, cancel) in enumerate(events):
            one = EventKey(event_class, priority, name)
            action = lambda now, _=0, number=number: happened.append((now, number))  # noqa: E731
            made.append(scheduler.every(period, first, one, action) if period else scheduler.at(first, one, action))
            scheduler.at(cancel, EventKey(EventClass.OUTSIDE, 0, "X"), lambda _, event=made[-1]: event.cancel())
        scheduler.run_until(end)
        return happened

    first = journal()
    assert journal() == first
    for now, number in first:
        assert now <= events[number][5]
