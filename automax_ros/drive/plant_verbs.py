"""What a verb on a plant is, how its numbers are read, and how a plant notes what is broken."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from automax_ros.core.values import number
from automax_ros.drive.plant import DrivePlant

Numbers = tuple[float, ...]
Range = tuple[float, float]


@dataclass(frozen=True)
class PlantVerb:
    """What a verb takes and does.

    Attributes:
        wants: what it takes, for messages.
        read: makes numbers of a text; ValueError where it is none of the verb's.
        act: does it.
        keys: names of the numbers, for a form with keys.
        needed: how many of them must be given, from the first on.
        usual: what the others are where they are not given; those at the end without one stay away.
    """

    wants: str
    read: Callable[[str], Numbers]
    act: Callable[[DrivePlant, Numbers], None]
    keys: tuple[str, ...] = field(default=())
    needed: int = 1
    usual: Numbers = field(default=())


def one_of(words: Mapping[str, int]) -> Callable[[str], Numbers]:
    """Return a reader of one word, in any case."""

    def read(text: str) -> Numbers:
        word = text.strip().upper()
        if word not in words:
            raise ValueError(text)
        return (words[word],)

    return read


def in_ranges(
    *ranges: Range, needed: int = 1, usual: Numbers = (), whole: tuple[int, ...] = ()
) -> Callable[[str], Numbers]:
    """Return a reader of numbers with a blank between, each in its range.

    Args:
        ranges: the least and the greatest of each.
        needed: how many must be given.
        usual: what those after them are where they are missing.
        whole: places of numbers that must be whole.
    """

    def read(text: str) -> Numbers:
        found = tuple(number(word) for word in text.split())
        if not needed <= len(found) <= len(ranges):
            raise ValueError(text)
        found += usual[len(found) - needed :]
        if any(not low <= value <= high for value, (low, high) in zip(found, ranges, strict=False)):
            raise ValueError(text)
        if any(found[place] != int(found[place]) for place in whole):
            raise ValueError(text)
        return found

    return read


def note(plant: DrivePlant, text: str) -> None:
    """Note what is broken."""
    if text not in plant.notes:
        plant.notes.append(text)


def forget(plant: DrivePlant, verb: str) -> None:
    """Forget what a verb has broken."""
    plant.notes = [text for text in plant.notes if text.split(maxsplit=1)[0] != verb]
