"""Which application registers a UDC copies between its local memory and the dual port, and for which task.

What a task of the UDC writes is an output, all else an input (S-3056 p. 3-50). Booleans go out 32 bits at a time: with
one of them both registers of an even pair are outputs, whatever else stands there, so that neighbours are overwritten.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from automax_ros.core.types import DataType
from automax_ros.language.program import Program
from automax_ros.language.syntax.tree import Scope
from automax_ros.language.written import lines_that_write
from automax_ros.rack.modules.udc_registers import APPLICATION, EVERY_SCAN
from automax_ros.running.memory import CommonMemory
from automax_ros.running.registers import RegisterMap
from automax_ros.running.views import ViewSpec

Key = tuple[int, int]
"""View and element."""


@dataclass(frozen=True)
class Copied:
    """What is copied at one of the two rates: ``inputs`` in, and out what each task has written, by its name."""

    inputs: tuple[Key, ...]
    outputs: dict[str, tuple[Key, ...]]


@dataclass(frozen=True)
class Copies:
    """The copies of one UDC: at every scan, and at every Nth."""

    every: Copied
    nth: Copied


def copies_of(programs: Sequence[Program], bank: int, memory: CommonMemory) -> Copies:
    """Return what a UDC with these tasks, in their order, copies; ``bank`` is the view of its registers."""
    written: dict[int, str] = {}
    used: set[int] = set()
    for program in programs:
        names = {symbol.name for symbol in program.symbols.values() if symbol.scope is Scope.COMMON}
        used.update(register for name in names for register in application_registers(name, bank, memory))
        for name in lines_that_write(program):
            # Of two tasks that write a register, the later one is the last that has written it.
            written.update(dict.fromkeys(_sent_with(name, bank, memory), program.name))
    every = {register for register in (*used, *written) if register in EVERY_SCAN}
    nth = {register for register in (*used, *written) if register not in EVERY_SCAN}
    return Copies(_copied(every, written, bank, memory.registers), _copied(nth, written, bank, memory.registers))


def application_registers(name: str, bank: int, memory: CommonMemory) -> range:
    """Return the application registers that a common takes, none if it stands elsewhere."""
    spec = memory.specs[memory.view(name)]
    if spec.place is None or spec.place.bank != bank or spec.place.register not in APPLICATION:
        return range(0)
    return range(spec.place.register, spec.place.register + _width(spec))


def _sent_with(name: str, bank: int, memory: CommonMemory) -> range:
    """Return the registers that go out when a common does."""
    own = application_registers(name, bank, memory)
    if own and memory.specs[memory.view(name)].type is DataType.BOOLEAN:
        return range(own[0] & ~1, (own[0] & ~1) + 2)
    return own


def _width(spec: ViewSpec) -> int:
    return 2 if spec.type in (DataType.DOUBLE, DataType.REAL) else 1


def _copied(registers: Iterable[int], written: dict[int, str], bank: int, views: RegisterMap) -> Copied:
    """Return the copies among some registers: in with all that shows them, out by the words."""
    in_order = sorted(registers)
    inputs = views.showing(bank, [register for register in in_order if register not in written])
    outputs: dict[str, tuple[Key, ...]] = {}
    for register in in_order:
        if register in written:
            task = written[register]
            outputs[task] = (*outputs.get(task, ()), (bank, register))
    return Copied(tuple(sorted(inputs)), outputs)
