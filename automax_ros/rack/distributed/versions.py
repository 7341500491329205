"""Versions of the values in common memory, by which the images of several processes come to agree.

A version is (rack time, slot of the process that wrote, number of its message); the greatest wins, wherever and in
whatever order writes arrive (decision). Each bit of a module's register has its own version, since a point may be one
bit; a REAL or DOUBLE INTEGER point is two registers.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from automax_ros.core.types import Value
from automax_ros.runtime.memory.registers import WORD, RegisterMap, RegisterPart

Version = tuple[int, int, int]
"""Rack time (ns), slot of the process, number of the message."""
AS_INSTALLED: Version = (-1, 0, 0)
"""Version of presets: every process writes them, and any other write wins over them."""
Key = tuple[int, int]
"""View and element."""


class VersionedValue(NamedTuple):
    """A value with its version; of a register, the bits of ``mask``."""

    view: int
    element: int
    value: Value
    mask: int
    version: Version


@dataclass(frozen=True)
class MergeResult:
    """Whether a write is to be applied as a ``whole``, else the newer bits of registers (``rest``) to write instead."""

    whole: bool
    rest: tuple[RegisterPart, ...] = ()


TAKEN = MergeResult(whole=True)
REFUSED = MergeResult(whole=False)


class Versions:
    """Versions of the values of one image. What was never written has none."""

    def __init__(self, registers: RegisterMap) -> None:
        self._registers = registers
        self._plain: dict[Key, tuple[Version, Value]] = {}
        self._bits: dict[Key, list[tuple[int, int, Version]]] = {}

    def settle(self, view: int, element: int, value: Value, version: Version) -> MergeResult:
        """Compare a write with what is held, and record what is newer or as new."""
        if view not in self._registers.views:
            held = self._plain.get((view, element))
            if held is not None and held[0] > version:
                return REFUSED
            self._plain[view, element] = version, value
            return TAKEN
        parts = self._registers.parts(view, element, value)
        rest = [part._replace(mask=self._settle_bits(part, version)) for part in parts]
        if all(new.mask == part.mask for new, part in zip(rest, parts, strict=True)):
            return TAKEN
        return MergeResult(whole=False, rest=tuple(part for part in rest if part.mask))

    def settle_bits(self, held: VersionedValue) -> tuple[RegisterPart, ...]:
        """Record the bits of a register in another image that are newer; return what to write, if anything."""
        part = RegisterPart(held.view, held.element, int(held.value) & WORD, held.mask & WORD)
        mask = self._settle_bits(part, held.version)
        return (part._replace(mask=mask),) if mask else ()

    def newest(self, view: int, element: int, value: Value) -> Iterator[RegisterPart | VersionedValue]:
        """Yield the values held that a late write of this process must not replace, to be restored."""
        if view not in self._registers.views:
            version, held = self._plain[view, element]
            yield VersionedValue(view, element, held, WORD, version)
            return
        for part in self._registers.parts(view, element, value):
            for mask, bits, _ in self._bits.get((part.bank, part.register), ()):
                if mask & part.mask:
                    yield RegisterPart(part.bank, part.register, bits, mask & part.mask)

    def all(self) -> Iterator[VersionedValue]:
        """Yield all values that were written, for another process's image."""
        for (view, element), (version, value) in self._plain.items():
            yield VersionedValue(view, element, value, WORD, version)
        for (view, element), pieces in self._bits.items():
            for mask, bits, version in pieces:
                yield VersionedValue(view, element, bits, mask, version)

    def _settle_bits(self, part: RegisterPart, version: Version) -> int:
        """Record the bits of a register that are newer; return their mask."""
        key, mask = (part.bank, part.register), part.mask
        kept: list[tuple[int, int, Version]] = []
        for own, bits, since in self._bits.get(key, ()):
            both = own & mask
            if since > version:
                mask &= ~both
                kept.append((own, bits, since))
            elif own != both:
                kept.append((own & ~both, bits, since))
        if mask:
            kept.append((mask, part.bits, version))
        self._bits[key] = kept
        return mask


def merged(before: int, parts: Sequence[RegisterPart]) -> int:
    """Return a register's word, with its sign, after some of its bits were replaced."""
    word = before & WORD
    for part in parts:
        word = word & ~part.mask | part.bits & part.mask
    return word - 0x10000 if word & 0x8000 else word
