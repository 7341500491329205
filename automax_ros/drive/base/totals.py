"""Sums of floating-point numbers that are the same in every form of the program."""

from __future__ import annotations


def add_up(numbers: list[float]) -> float:
    """Return the sum, rounded after each addition, from the first number to the last.

    Python's own ``sum`` does that up to 3.11; later versions round once, at the end (decision: a rack does the same
    whatever runs it, and C rounds each time).
    """
    found = 0.0
    for number in numbers:
        found += number
    return found
