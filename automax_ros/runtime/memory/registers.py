"""Registers of modules in common memory: the effect of a write to one view on others that show the same bits.

A word and its bits alias in actual memory; the latch copies views, so in a scan they are independent (3.3). An empty
slot or a missing register of the ``Backplane`` is bus error 31.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from automax_ros.core.numbers import stored_real
from automax_ros.core.types import DataType, Value
from automax_ros.runtime.memory.views import Place, ViewSpec

Entry = tuple[int, int, Value]
"""View, element, value."""
WORD = 0xFFFF
"""All bits of a register."""
_TWO_WORDS = (DataType.DOUBLE, DataType.REAL)
BUS_ERROR = 7031
"""The run-time error of a register that does not answer (hardware code 31, J-3650 p. 5-3).

It is logged, IOREAD% gives 0, IOWRITE writes nothing, and the task goes on (decision: none says that it stops all).
"""


class Part(NamedTuple):
    """The effect of a write on one register: the bits of ``mask`` become those of ``bits``."""

    bank: int
    register: int
    bits: int
    mask: int


class RegisterMap:
    """The views of each register. ``views`` are those that share registers with others: points and banks."""

    def __init__(self, specs: Sequence[ViewSpec]) -> None:
        """Sort the points of all banks by register."""
        self._types = {view: spec.type for view, spec in enumerate(specs)}
        self._places: dict[int, Place] = {view: spec.place for view, spec in enumerate(specs) if spec.place is not None}
        self._points: dict[tuple[int, int], list[int]] = {}
        for view, place in self._places.items():
            for register in self._registers(view):
                self._points.setdefault((place.bank, register), []).append(view)
        self.views = frozenset({*self._places, *(place.bank for place in self._places.values())})

    def consequences(self, view: int, element: int, value: Value, read: Callable[[int, int], Value]) -> Iterator[Entry]:
        """Yield the other changes by a write to ``view``: words of the bank, then points, by register.

        ``read`` returns the value of a view before the write.
        """
        place = self._places.get(view)
        bank = view if place is None else place.bank
        words = self._words(view, element, value, read)
        if place is not None:
            for register, word in words.items():
                if read(bank, register) != _to_signed(word):
                    yield bank, register, _to_signed(word)
        others = dict.fromkeys(
            other for register in words for other in self._points.get((bank, register), ()) if other != view
        )
        for other in others:
            shown = self._shown_value(other, words, read)
            if shown != read(other, 0):
                yield other, 0, shown

    def parts(self, view: int, element: int, value: Value) -> list[Part]:
        """Return the effect of a write to a point or a register on each register that it changes."""
        place = self._places.get(view)
        if place is None:
            return [Part(view, element, _to_unsigned(value), WORD)]
        if place.bit is not None:
            return [Part(place.bank, place.register, int(bool(value)) << place.bit, 1 << place.bit)]
        words = self._words(view, element, value, lambda *_: 0)
        return [Part(place.bank, register, word, WORD) for register, word in words.items()]

    def keeping(
        self,
        view: int,
        element: int,
        value: Value,
        forced: Collection[tuple[int, int]],
        read: Callable[[int, int], Value],
    ) -> Value:
        """Return the value that a write stores if ``view`` is a bank: the bits of forced points do not change."""
        for point in self._points.get((view, element), ()):
            if (point, 0) in forced:
                bit = self._places[point].bit
                mask = WORD if bit is None else 1 << bit
                value = _to_signed(_to_unsigned(value) & ~mask | _to_unsigned(read(view, element)) & mask)
        return value

    def showing(self, bank: int, registers: Iterable[int]) -> frozenset[tuple[int, int]]:
        """Return view and element of all views of some registers of a bank: the words, and their points."""
        words = [(bank, register) for register in registers]
        return frozenset([*words, *((view, 0) for word in words for view in self._points.get(word, ()))])

    def others(self, view: int) -> list[int]:
        """Return the points that share a bit with a point: a word, and each of its named bits."""
        place = self._places.get(view)
        if place is None:
            return []
        near = {other for register in self._registers(view) for other in self._points[place.bank, register]}
        near.discard(view)
        return sorted(other for other in near if place.bit is None or self._places[other].bit in (None, place.bit))

    def _registers(self, view: int) -> range:
        first = self._places[view].register
        return range(first, first + (2 if self._types[view] in _TWO_WORDS else 1))

    def _words(self, view: int, element: int, value: Value, read: Callable[[int, int], Value]) -> dict[int, int]:
        """Return the registers that a write changes, as unsigned 16-bit words.

        Two registers hold a REAL in IEEE single precision, high word first (decision).
        """
        assert not isinstance(value, str)
        place, kind = self._places.get(view), self._types[view]
        is_real = place is not None and kind is DataType.REAL
        number = int.from_bytes(struct.pack(">f", value), "big") if is_real else int(value)
        if place is None:
            return {element: number & WORD}
        first = place.register
        if place.bit is not None:
            before = _to_unsigned(read(place.bank, first))
            return {first: before & ~(1 << place.bit) | number << place.bit}
        if kind in _TWO_WORDS:
            return {first: number >> 16 & WORD, first + 1: number & WORD}
        return {first: number & WORD}

    def _shown_value(self, view: int, words: dict[int, int], read: Callable[[int, int], Value]) -> Value:
        """Return the value of a point from its registers; ``words`` are those that have just changed.

        Bits that are not a REAL show as 0 or as its largest (decision).
        """
        place = self._places[view]
        found = [words.get(number, _to_unsigned(read(place.bank, number))) for number in self._registers(view)]
        if place.bit is not None:
            return bool(found[0] >> place.bit & 1)
        if self._types[view] is DataType.REAL:
            real: float = struct.unpack(">f", (found[0] << 16 | found[1]).to_bytes(4, "big"))[0]
            return 0.0 if math.isnan(real) else stored_real(real)[0]
        if len(found) == 2:
            return _to_signed(found[0]) << 16 | found[1]
        return _to_signed(found[0])


def _to_signed(word: int) -> int:
    return word - 0x10000 if word & 0x8000 else word


def _to_unsigned(value: Value) -> int:
    assert not isinstance(value, str)
    return int(value) & WORD


@dataclass(frozen=True)
class Bank:
    """The registers of one module: ``view`` is their view in common memory; tasks may write those in ``writable``."""

    slot: int
    view: int
    registers: int
    writable: Collection[int] = range(0)


class Backplane:
    """Finds the element of common memory that is a register of a slot."""

    def __init__(self, banks: Iterable[Bank] = ()) -> None:
        self._banks = {bank.slot: bank for bank in banks}

    def bank(self, slot: int) -> Bank | None:
        """Return the registers in a slot; None if there are none."""
        return self._banks.get(slot)

    def readable(self, slot: int, register: int) -> tuple[int, int] | None:
        """Return view and element of a register that can be read; None is a bus error."""
        bank = self._banks.get(slot)
        return (bank.view, register) if bank is not None and 0 <= register < bank.registers else None

    def writable(self, slot: int, register: int) -> tuple[int, int] | None:
        """Return view and element of a register that a task may write; None is a bus error."""
        bank = self._banks.get(slot)
        return (bank.view, register) if bank is not None and register in bank.writable else None


NO_MODULES = Backplane()
"""A rack whose modules have no registers."""
