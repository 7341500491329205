"""Modeled execution times of a task on a Processor (section 53).

Blocks, SCAN_LOOP, END and ``!`` remarks have the manual's times. It has none for BASIC statements: their estimates, in
the tables of the lowering, are ours (decision: no source prints these times).
"""

from __future__ import annotations

import enum
from collections.abc import Iterable
from dataclasses import dataclass

from automax_ros.blocks.declare.declaration import Platform, Time, Times
from automax_ros.blocks.scan_loop import END_TIMES, REMARK_TIMES, SCAN_LOOP
from automax_ros.core.ticks import NS_PER_US, UDC_MAX_TICKS
from automax_ros.core.types import DataType
from automax_ros.language.program import BoundCall, Program, Symbol
from automax_ros.language.tree.tree import Remark


class Model(enum.Enum):
    """The model whose times are used; NONE: everything takes no time."""

    NONE = "none"
    MODEL_7010 = "57C435"
    MODEL_6010 = "57C430A"
    MODEL_6011 = "57C431"
    UDC = "udc"
    PC3000 = "pc3000"


PLATFORMS = {Model.UDC: Platform.UDC, Model.PC3000: Platform.PC3000}
"""The platforms of the models that are not AutoMax Processors: they determine the blocks and statements of a task."""
MOST_SHARED_TICKS = {Model.UDC: UDC_MAX_TICKS}
"""Largest TICKS of modules whose tasks run one after the other in one scan (53.2)."""

NEXT_US, MINOR_LOOP_US = 6.0, 250.0
"""Estimated microseconds on a 7010 of each turn of a FOR, and of a scan of DC_DRIVE_CML without the latch of the
commons: no manual prints its time (decision).
"""
SLOWER_THAN_7010 = {Model.MODEL_6010: 4.0, Model.MODEL_6011: 4.0, Model.UDC: 0.8, Model.PC3000: 0.7}
"""Time of a BASIC statement on each module over the 7010's estimate (decision: the ratios of tables 4 to 6)."""


@dataclass(frozen=True)
class CostModel:
    """Times of one Processor model, in whole nanoseconds; ``alone``: the UDC runs one task, not two (table 5)."""

    model: Model = Model.NONE
    alone: bool = False

    def block_ns(self, bound: BoundCall) -> int:
        """Return the time of one block as programmed, without that of the elements that it searches."""
        time = self._time(bound.block.times)
        return 0 if time is None else _to_ns(_sum(time, _count_programmed(bound)))

    def element_ns(self, bound: BoundCall) -> int:
        """Return the time of each element that a block searches; a scan determines their number (m of the tables)."""
        time = self._time(bound.block.times)
        return 0 if time is None else _to_ns(time.m)

    def block_bounds_ns(self, bound: BoundCall) -> tuple[int, int]:
        """Return the least and the most time of one block, with one searched element and with all."""
        programmed, each = self.block_ns(bound), self.element_ns(bound)
        return programmed + each, programmed + each * max(1, bound.elements)

    def scan_loop_ns(self, program: Program) -> int:
        """Return the time of SCAN_LOOP, or of the block in its place, with its latch."""
        return self._scan_part(SCAN_LOOP.times, program)

    @property
    def loop_ns(self) -> int:
        """The estimated time of a scan of a current minor loop."""
        return self.estimate_ns(MINOR_LOOP_US)

    def end_ns(self, program: Program) -> int:
        """Return the time of END, including the write-back."""
        return self._scan_part(END_TIMES, program)

    def remark_ns(self, remark: Remark) -> int:
        """Return the time of a remark: only one that begins with ``!`` takes any."""
        time = self._time(REMARK_TIMES) if remark.costs else None
        return 0 if time is None else _to_ns(time.base)

    @property
    def turn_ns(self) -> int:
        """The estimated time of NEXT, for each turn of a FOR loop that reaches it."""
        return self.estimate_ns(NEXT_US)

    def estimate_ns(self, microseconds: float) -> int:
        """Return the time of what takes so long on a 7010, by estimate."""
        return 0 if self.model is Model.NONE else _to_ns(microseconds * SLOWER_THAN_7010.get(self.model, 1.0))

    def _scan_part(self, times: Times, program: Program) -> int:
        time = self._time(times)
        if time is None:
            return 0
        return _to_ns(_sum(time, _commons(program.symbols.values())) + (time.alone if self.alone else 0.0))

    def _time(self, times: Times) -> Time | None:
        if self.model is Model.MODEL_7010:
            return times.model_7010
        if self.model in (Model.MODEL_6010, Model.MODEL_6011):
            return times.model_6010
        if self.model is Model.UDC:
            return times.udc
        return times.pc3000 if self.model is Model.PC3000 else None


def _to_ns(microseconds: float) -> int:
    return round(microseconds * NS_PER_US)


def _count_programmed(bound: BoundCall) -> dict[str, int]:
    """Return the counts of programmed parameters, by the letters of the manual's tables.

    Only inputs of numbered channels count as ``j``: SELECT's are INPUTn and SELECTn, those of WRITE blocks are without
    STRUCTURE_NAME, COLUMN and ENABLE; ERROR of READ blocks is an output among ``n`` (decision).
    """
    block = bound.block
    outputs = sum(item.name in bound.arguments for item in block.outputs)
    channels = sum(item.name in bound.arguments and item.name[-1].isdigit() for item in block.inputs)
    pairs = sum(item.name in bound.arguments and item.name.startswith("INPUT") for item in block.inputs)
    order = bound.facts.get("order", 0)
    return {"n": outputs, "j": channels, "k": pairs, "p": pairs, "o": int(order)}


def _commons(symbols: Iterable[Symbol]) -> dict[str, int]:
    kinds = [symbol.type for symbol in symbols if symbol.latched]
    return {
        "t": len(kinds),
        "i": kinds.count(DataType.INTEGER),
        "b": kinds.count(DataType.BOOLEAN),
        "d": kinds.count(DataType.DOUBLE),
    }


def _sum(time: Time, counts: dict[str, int]) -> float:
    total: float = time.base + sum(getattr(time, term) * count for term, count in counts.items())
    return total
