"""The points of a drive digital I/O module that belong to the drive: DIG_IO_SLOT of the CML task names the module."""

from __future__ import annotations

from automax_ros.core.kinds import WriteKind
from automax_ros.drive.cml.signals import EXTERNAL_TRIP, PERMISSIVE
from automax_ros.rack.modules.digital_io import (
    DRIVE_INPUTS,
    DRIVE_OK_BIT,
    DRIVE_OUTPUTS,
    EXTERNAL_TRIP_BIT,
    FMCR_BIT,
    PERMISSIVE_BIT,
)
from automax_ros.running.backplane import Backplane
from automax_ros.running.memory import CommonMemory
from automax_ros.running.scheduler import Scheduler

_OWN = 3 << FMCR_BIT | 1 << DRIVE_OK_BIT


class DriveDigital:
    """Reads the drive's inputs and sets its outputs. A slot without such registers reads 0 and takes nothing.

    Attributes:
        slot: where the module is, None as long as no task has said so.
    """

    def __init__(self, memory: CommonMemory, backplane: Backplane, scheduler: Scheduler, writer: int) -> None:
        """Begin without a module; ``writer`` is the id under which outputs are written."""
        self._memory, self._backplane, self._scheduler, self._writer = memory, backplane, scheduler, writer
        self.slot: int | None = None
        self._view: int | None = None

    def serve(self, slot: int | None) -> None:
        """Take the module in a slot, None for none."""
        if slot != self.slot:
            bank = None if slot is None else self._backplane.bank(slot)
            self.slot = slot
            self._view = bank.view if bank is not None and bank.registers > DRIVE_OUTPUTS else None

    def status(self) -> int:
        """Return the bits of ``Measured.status`` that the inputs set, forced ones as they are forced."""
        if self._view is None:
            return 0
        word = int(self._memory.read_now(self._view, DRIVE_INPUTS))
        permissive = PERMISSIVE if word >> PERMISSIVE_BIT & 1 else 0
        return permissive | (EXTERNAL_TRIP if word >> EXTERNAL_TRIP_BIT & 1 else 0)

    def show(self, relays: int, *, ok: bool) -> None:
        """Set the contactor relays (FMCR, RMCR) and drive OK; the module's other outputs stay."""
        view = self._view
        if view is None:
            return
        memory = self._memory
        word = int(memory.read_now(view, DRIVE_OUTPUTS))
        wanted = word & ~_OWN | relays << FMCR_BIT | ok << DRIVE_OK_BIT
        if wanted != word:
            memory.now_ns = self._scheduler.now_ns
            memory.write_now(view, wanted, self._writer, DRIVE_OUTPUTS, WriteKind.OUTSIDE)
