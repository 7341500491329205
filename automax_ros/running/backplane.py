"""The backplane: which registers answer at which slot. An empty slot or a missing register is bus error 31."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from dataclasses import dataclass

BUS_ERROR = 7031
"""The run-time error of a register that does not answer (hardware code 31, J-3650 p. 5-3).

It is logged, IOREAD% gives 0, IOWRITE writes nothing, and the task goes on (decision: none says that it stops all).
"""


@dataclass(frozen=True)
class Bank:
    """The registers of one module: ``view`` is their view in common memory, ``writable`` is what tasks may write."""

    slot: int
    view: int
    registers: int
    writable: Collection[int] = range(0)


class Backplane:
    """Finds the element of common memory that is a register of a slot."""

    def __init__(self, banks: Iterable[Bank] = ()) -> None:
        """Take the banks of all modules that have registers."""
        self._banks = {bank.slot: bank for bank in banks}

    def bank(self, slot: int) -> Bank | None:
        """Return the registers in a slot, None where there are none."""
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
