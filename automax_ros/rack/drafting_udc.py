"""UDC modules of a rack file to be: which of a folder's tasks are a UDC's, and where their commons may stand.

A task is a UDC's where it calls a block that runs there alone (table 5). Two tasks of equal TICKS share a module.
Nothing in a task says where in the dual port its commons stand: they get application registers in turn (decision),
which the plant's drawings replace.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from automax_ros.blocks.catalogue import CATALOGUE
from automax_ros.blocks.declaration import Platform
from automax_ros.core.types import DataType
from automax_ros.language.program import CommonSpec, Program
from automax_ros.language.syntax.tree import Call, Module
from automax_ros.language.syntax.walk import statements_in_order
from automax_ros.language.written import places_that_write
from automax_ros.rack.modules.udc_config import DRIVES, UDC
from automax_ros.rack.modules.udc_registers import EVERY_SCAN

_BITS = 16
_PAIR_BITS = 2 * _BITS
"""A UDC writes booleans in pairs of registers: what it writes and what it reads stand in different ones."""
_MODEL = next(iter(UDC.models))


def is_udc_task(module: Module) -> bool:
    """Return whether a task calls a block that no Processor has."""
    calls = (item.block for item, _ in statements_in_order(module.statements) if isinstance(item, Call))
    blocks = (CATALOGUE[name] for name in calls if name in CATALOGUE)
    return any(Platform.UDC in block.runs_on and Platform.AUTOMAX not in block.runs_on for block in blocks)


@dataclass(frozen=True)
class DraftedUdc:
    """A UDC module to be: its slot and its tasks, that of drive A first."""

    slot: int
    tasks: tuple[str, ...]

    def lines(self, files: Mapping[str, str]) -> Iterator[str]:
        """Yield its lines of the rack file; ``files`` are what it says of the tasks' files."""
        yield f"  {self.slot}:"
        yield f"    module: {_MODEL}"
        yield "    tasks:"
        yield from (
            f"      {name}: {{{files[name]}drive: {drive}}}" for name, drive in zip(self.tasks, DRIVES, strict=False)
        )


def drafted_udcs(names: Sequence[str], programs: Mapping[str, Program | None], free: Iterator[int]) -> list[DraftedUdc]:
    """Return the modules of UDC tasks, in slots of ``free``."""
    by_ticks: dict[int, list[str]] = {}
    for name in names:
        program = programs[name]
        by_ticks.setdefault(0 if program is None else program.ticks, []).append(name)
    pairs = [own[at : at + 2] for own in by_ticks.values() for at in range(0, len(own), 2)]
    return [DraftedUdc(slot, tuple(pair)) for pair, slot in zip(pairs, free, strict=False)]


def dual_port_places(
    udc: DraftedUdc, programs: Mapping[str, Program | None], commons: Mapping[str, CommonSpec]
) -> dict[str, str]:
    """Return where the commons of a module's tasks stand, as the rack file says it, as many as there is room for.

    Arrays and strings stand nowhere: `automax check` says so.
    """
    own = [program for name in udc.tasks if (program := programs[name]) is not None]
    used = [spec for name, spec in commons.items() if any(name in program.symbols for program in own)]
    written = {name for program in own for name in places_that_write(program)}
    places: dict[str, str] = {}
    bit = EVERY_SCAN.start * _BITS
    for group in _groups([spec for spec in used if not spec.dimensions], written):
        bit = -(-bit // _PAIR_BITS) * _PAIR_BITS
        for spec in group:
            size = {DataType.BOOLEAN: 1, DataType.INTEGER: _BITS}.get(spec.type, _PAIR_BITS)
            if bit + size > EVERY_SCAN.stop * _BITS:
                return places
            place = f"slot: {udc.slot}, register: {bit // _BITS}"
            places[spec.name] = place + (f", bit: {bit % _BITS}" if size == 1 else "")
            bit += size
    return places


def _groups(simple: Sequence[CommonSpec], written: set[str]) -> Iterator[list[CommonSpec]]:
    """Yield what stands together: booleans that the UDC writes, other booleans, numbers of two registers, of one."""
    flags = [spec for spec in simple if spec.type is DataType.BOOLEAN]
    yield [spec for spec in flags if spec.name in written]
    yield [spec for spec in flags if spec.name not in written]
    yield [spec for spec in simple if spec.type in (DataType.DOUBLE, DataType.REAL)]
    yield [spec for spec in simple if spec.type is DataType.INTEGER]
