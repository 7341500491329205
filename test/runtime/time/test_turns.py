"""Turns: a loop that scans without a pause and those who look at the rack meanwhile."""

import threading
from itertools import count

from waiting import PATIENCE_S, wait_until

from automax_ros.rack.operator.halting import Haltable
from automax_ros.runtime.time.turns import Turns


def test_a_loop_without_a_pause_lets_readers_in_and_readers_without_a_pause_let_it_go_on():
    turns, ended = Turns(), threading.Event()
    inside: list[str] = []
    seen: list[tuple[str, ...]] = []
    numbers = dict.fromkeys(("loop", "one", "two"), 0)

    def take(name: str) -> None:
        while not ended.is_set():
            with turns.turn():
                inside.append(name)
                seen.append(tuple(inside))
                inside.remove(name)
                numbers[name] += 1

    threads = [threading.Thread(target=take, args=(name,)) for name in numbers]
    for thread in threads:
        thread.start()
    wait_until(lambda: min(numbers.values()) > 100)
    ended.set()
    for thread in threads:
        thread.join(PATIENCE_S)
    assert {len(who) for who in seen} == {1}, "never two at a time"


def test_who_asks_first_is_served_first():
    turns, order, numbers = Turns(), [], count()
    asked = [threading.Event() for _ in range(4)]

    def take(number: int) -> None:
        asked[number].set()
        with turns.turn():
            order.append((number, next(numbers)))

    threads = [threading.Thread(target=take, args=(number,)) for number in range(4)]
    with turns.turn():
        for number, thread in enumerate(threads):
            thread.start()
            asked[number].wait(PATIENCE_S)
            wait_until(lambda number=number: turns.waiting == number + 1)
    for thread in threads:
        thread.join(PATIENCE_S)
    assert order == [(number, number) for number in range(4)]


def test_an_error_in_a_turn_ends_it():
    turns = Turns()
    try:
        with turns.turn():
            raise ValueError
    except ValueError:
        pass
    with turns.turn():
        assert turns.waiting == 0


def test_it_halts_a_rack():
    turns = Turns()
    assert isinstance(turns, Haltable)
    turns.halt()
    assert turns.halted
    turns.resume()
    assert not turns.halted
