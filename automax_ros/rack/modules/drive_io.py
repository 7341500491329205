"""The modules next to a 57C406: the drive digital I/O, and the 57C405, which shows the armature voltage (52.6.1)."""

from __future__ import annotations

from functools import cache

from automax_ros.core.kinds import WriteKind
from automax_ros.core.numbers import round_count
from automax_ros.drive.current_loop.signals import EXTERNAL_TRIP, PERMISSIVE
from automax_ros.rack.modules.io_module import IoModule
from automax_ros.rackfile.modules.io import (
    DRIVE_INPUTS,
    DRIVE_OK_BIT,
    DRIVE_OUTPUTS,
    EXTERNAL_TRIP_BIT,
    FMCR_BIT,
    PERMISSIVE_BIT,
)
from automax_ros.runtime.memory.memory import CommonMemory
from automax_ros.runtime.memory.registers import Backplane
from automax_ros.runtime.time.scheduler import Scheduler

GAINS = {230: 0.02, 380: 0.0121, 460: 0.01, 550: 0.00835, 660: 0.00696}
"""Volts at the 57C405 per volt of the armature, by the nominal line voltage of the transformer, V rms (52.6.1)."""
FULL_SCALE_V, FULL_SCALE_COUNTS = 10.0, 4095
"""Full scale of the input, V and counts (decision: as a 57C409)."""
_OWN = 3 << FMCR_BIT | 1 << DRIVE_OK_BIT


@cache
def voltage_gain(line_v: float) -> float:
    """Return the gain of the transformer for a line's nominal voltage (V rms, line to line)."""
    return GAINS[min(GAINS, key=lambda nominal: abs(nominal - line_v))]


def voltage_counts(volts: float, line_v: float) -> int:
    """Return the count of register 0 for an armature voltage, V."""
    counts = round_count(volts * voltage_gain(line_v) / FULL_SCALE_V * FULL_SCALE_COUNTS)
    return max(-FULL_SCALE_COUNTS, min(FULL_SCALE_COUNTS, counts))


class DriveAnalogModule(IoModule):
    """A 57C405."""

    def show_voltage(self, volts: float, line_v: float) -> None:
        """Show an armature voltage, V, through the transformer for a line's nominal voltage, V."""
        self._own.show(0, voltage_counts(volts, line_v))


class DriveDigital:
    """The drive's inputs and outputs, in the ``slot`` that a task names; one without such registers reads 0."""

    def __init__(self, memory: CommonMemory, backplane: Backplane, scheduler: Scheduler, writer: int) -> None:
        """Create without a module; ``writer`` is the id under which outputs are written."""
        self._memory, self._backplane, self._scheduler, self._writer = memory, backplane, scheduler, writer
        self.slot: int | None = None
        self._view: int | None = None

    def serve(self, slot: int | None) -> None:
        """Use the module in a slot, None for none."""
        if slot != self.slot:
            bank = None if slot is None else self._backplane.bank(slot)
            self.slot = slot
            self._view = bank.view if bank is not None and bank.registers > DRIVE_OUTPUTS else None

    def status(self) -> int:
        """Return the bits of ``Measured.status`` that the inputs set, forced ones at their forced values."""
        if self._view is None:
            return 0
        word = int(self._memory.read_now(self._view, DRIVE_INPUTS))
        permissive = PERMISSIVE if word >> PERMISSIVE_BIT & 1 else 0
        return permissive | (EXTERNAL_TRIP if word >> EXTERNAL_TRIP_BIT & 1 else 0)

    def show(self, relays: int, *, ok: bool) -> None:
        """Set the contactor relays (FMCR, RMCR) and drive OK; the module's other outputs are unchanged."""
        view = self._view
        if view is None:
            return
        memory = self._memory
        word = int(memory.read_now(view, DRIVE_OUTPUTS))
        wanted = word & ~_OWN | relays << FMCR_BIT | ok << DRIVE_OK_BIT
        if wanted != word:
            memory.now_ns = self._scheduler.now_ns
            memory.write_now(view, wanted, self._writer, DRIVE_OUTPUTS, WriteKind.OUTSIDE)
