"""What waits at the door is taken in turn, a stated number at a time; a failure ends nothing."""

import time
from collections import deque

import pytest
from system.support import wait_until

from automax_ros.ros.intake import intake as door_module
from automax_ros.ros.intake import rcl
from automax_ros.ros.intake.intake import MOST_A_ROUND, MOST_OF_ONE, MessageIntake
from automax_ros.ros.intake.rcl import MOST_SENDERS, SequenceTracker, TakenMessage


class Way:
    """An entrance with messages that wait; nothing wakes the door for it."""

    handle = None

    def __init__(self, name, waiting, taken, fail_at=()):
        self.name, self.waiting, self.taken, self.fail_at = name, waiting, taken, fail_at

    def take(self):
        if not self.waiting:
            return False
        self.waiting -= 1
        self.taken.append((self.name, self.waiting))
        if self.waiting in self.fail_at:
            raise ValueError("cannot be read")
        return True


@pytest.fixture
def intake(monkeypatch):
    """A door that looks by itself, as where rcl is not found."""
    monkeypatch.setattr(door_module, "library", lambda: None)
    reports = []
    made = MessageIntake(lambda what, error: reports.append((what, error)))
    made.reports = reports
    yield made
    made.close()


def test_everything_is_taken(intake):
    taken = []
    ways = [Way(name, 50, taken) for name in "ABC"]
    for way in ways:
        intake.add(way)
    intake.open()
    wait_until(lambda: len(taken) == 150)
    assert not any(way.waiting for way in ways)


def test_round_takes_a_stated_number_and_each_gets_its_turn(intake):
    taken = []
    ready = deque(Way(name, 100, taken) for name in "ABCDEF")
    intake._round(ready)
    assert len(taken) == MOST_A_ROUND
    assert [sum(name == letter for name, _ in taken) for letter in "ABCDEF"] == [MOST_OF_ONE] * 4 + [0, 0]
    intake._round(ready)
    assert [sum(name == letter for name, _ in taken) for letter in "EF"] == [MOST_OF_ONE] * 2
    assert len(taken) == 2 * MOST_A_ROUND


def test_an_entrance_with_a_share_of_its_own_takes_nothing_from_the_others(intake):
    taken = []
    own, *others = ways = [Way(name, 100, taken) for name in "ABCDEF"]
    intake.add(own, share=32)
    intake._round(deque(ways))
    assert [sum(name == letter for name, _ in taken) for letter in "ABCDEF"] == [32] + [MOST_OF_ONE] * 4 + [0]
    intake._remove(own)
    taken.clear()
    intake._round(deque([own, *others]))
    assert sum(name == "A" for name, _ in taken) == MOST_OF_ONE


def test_pace_is_bounded(intake):
    """However much waits: a round of at most 16, then a rest of a millisecond."""
    taken = []
    intake.add(Way("FLOOD", 10**9, taken))
    intake.open()
    began = time.monotonic()
    wait_until(lambda: len(taken) > 100)
    intake.stop()
    assert len(taken) <= (time.monotonic() - began) * 1000 * MOST_OF_ONE + MOST_A_ROUND


def test_failure_is_told_and_the_others_go_on(intake):
    taken = []
    intake.add(Way("BAD", 10, taken, fail_at=(3, 7)))
    intake.add(Way("GOOD", 10, taken))
    intake.open()
    wait_until(lambda: len(taken) == 20)
    wait_until(lambda: len(intake.reports) == 2)
    assert [what for what, _ in intake.reports] == ["BAD: dropped"] * 2


def test_senders_tell_copies_and_what_is_missing():
    senders = SequenceTracker()

    def missing(sender, number):
        return senders.missing(TakenMessage(b"", 0, 0, number, sender))

    assert [missing(b"a", 5), missing(b"a", 6), missing(b"a", 6), missing(b"a", 9)] == [0, 0, None, 2]
    assert missing(b"b", 100) == 0
    assert missing(b"a", 4) is None
    assert missing(b"b", 10**12) == 0  # a stranger says what it likes
    for number in range(MOST_SENDERS):
        missing(number.to_bytes(2, "big"), 1)
    assert len(senders._last) == MOST_SENDERS


def test_rcl_is_found_here(ros_domain_id):
    """Else all tests of the door try the fallback alone."""
    assert rcl.library() is not None
