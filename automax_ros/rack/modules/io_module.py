"""An I/O module of a running rack: its registers, and the interrupts that it raises while there is a common clock.

An interrupt comes at whole periods after the clock was turned on, a period being (period register + 1) x 0.5 ms. It
needs the clock, an installed task with an EVENT on its ISCR and, where it has one, its enable bit: it begins when the
last of the three is there, and a new period counts from the same beginning (decision). Interrupts of one instant come
in the order of slots, before all scans. A module without a clock does not interrupt.
"""

from __future__ import annotations

from collections.abc import Sequence

from automax_ros.core.kinds import WriteKind
from automax_ros.core.numbers import sign_extended
from automax_ros.core.ticks import CLOCK_PERIOD_NS
from automax_ros.core.types import DataType, Value
from automax_ros.rack.modules.module import ModuleState, RackServices
from automax_ros.rack.tasks.scheduled_task import ScheduledTask
from automax_ros.rackfile.model.module import Interrupt, ModuleConfig
from automax_ros.runtime.memory.process_inputs import Freezer
from automax_ros.runtime.time.scheduler import EventClass, EventKey, ScheduledEvent

_COUNTER_BITS = 24


class IoModule:
    """An I/O module."""

    tasks: Sequence[ScheduledTask] = ()

    def __init__(self, config: ModuleConfig, parts: RackServices) -> None:
        """Take a module's configuration; nothing happens before the clock is turned on."""
        bank = parts.backplane.bank(config.slot)
        assert bank is not None
        self.config, self._parts, self._view = config, parts, bank.view
        registers = config.registers
        inputs = (number for number in range(registers.count) if registers.direction(number) == "input")
        self.kept = parts.memory.registers.showing(bank.view, inputs)
        self._interrupts = [_PeriodicInterrupt(config.slot, bank.view, item, parts) for item in registers.interrupts]
        self._looks = False
        if self._interrupts:
            self._watch()
        for first in registers.counters:
            parts.inputs.shape(self._doubles(first), _counted)

    def power_on(self) -> None:
        """Nothing begins: no register drives the clock yet."""

    def power_off(self) -> None:
        """End its interrupts."""
        self.stopped_all()

    def stopped_all(self) -> None:
        """Let the inputs follow the process again: nobody waits for them."""
        for interrupt in self._interrupts:
            interrupt.free()

    def state(self) -> ModuleState:
        """Return when its interrupts come, and what is frozen: ``{}`` for a module without interrupts."""
        return {str(item.status): item.state() for item in self._interrupts}

    def load(self, state: ModuleState) -> None:
        """Take over a state.

        Raises:
            ValueError: the state is that of another module.
        """
        if set(state) != {str(item.status) for item in self._interrupts}:
            raise ValueError(f"{self.config.name} has other interrupts")
        for item in self._interrupts:
            item.load(state[str(item.status)])
        if self._interrupts:
            self._look_soon()

    def _watch(self) -> None:
        parts, registers = self._parts, self.config.registers
        looked_at = {source for source, _ in registers.copies}
        for item in registers.interrupts:
            looked_at.update(number for number in (item.status, item.period) if number is not None)
            parts.clock.add_enable(self.config.name, self._view, item.status)
        for register in sorted(looked_at):
            parts.memory.watch(self._view, register, self._look_soon)
        parts.clock.watch(self._look)
        parts.interrupts.watch(self._task_installed)

    def _doubles(self, first: int) -> list[tuple[int, int]]:
        """Return the DOUBLE INTEGERs that stand at a register."""
        memory = self._parts.memory
        shown = memory.registers.showing(self._view, [first])
        return [key for key in sorted(shown) if memory.specs[key[0]].type is DataType.DOUBLE]

    def _task_installed(self) -> None:
        if self._parts.clock.runs:
            self._look_soon()

    def _look_soon(self) -> None:
        """Look at the registers once the write that has changed one is complete, still at this instant."""
        if not self._looks:
            self._looks = True
            scheduler, key = self._parts.scheduler, EventKey(EventClass.IO, self.config.slot, "")
            scheduler.at(scheduler.now_ns, key, lambda _: self._look())

    def _look(self) -> None:
        """Follow the clock and the registers."""
        self._looks = False
        for interrupt in self._interrupts:
            interrupt.look()
        read, registers = self._parts.memory.read_now, self.config.registers
        for source, copy in registers.copies:
            self._show(copy, read(self._view, source))
        for register, bits in registers.clock_status:
            self._show(register, bits if self._parts.clock.runs else 0)
        self._parts.tell_writes()

    def _show(self, register: int, value: Value) -> None:
        """Write an input that the module itself sets."""
        memory = self._parts.memory
        if memory.read_now(self._view, register) != value:
            memory.now_ns = self._parts.scheduler.now_ns
            writer = self._parts.writer(self.config.name)
            memory.write_now(self._view, value, writer, register, WriteKind.OUTSIDE)


class _PeriodicInterrupt:
    """One interrupt of a module, with the inputs that freeze at it."""

    def __init__(self, slot: int, bank: int, interrupt: Interrupt, parts: RackServices) -> None:
        assert interrupt.period is not None
        self.status = interrupt.status
        self._bank, self._period, self._enable, self._parts = bank, interrupt.period, interrupt.enable, parts
        self._key = EventKey(EventClass.IO, slot, f"{interrupt.status:05}")
        self._freezer = Freezer(parts.memory.registers.showing(bank, interrupt.inputs))
        self._event: ScheduledEvent | None = None

    def look(self) -> None:
        """Let the next interrupt be where clock and registers have it."""
        since, period = self._parts.clock.since_ns, self._period_ns
        if since is None or not self._is_enabled:
            self._cancel()
        elif self._event is None or self._event.period_ns != period:
            passed = (self._parts.scheduler.now_ns - since) // period
            self._begin(since + (passed + 1) * period)

    def free(self) -> None:
        """Let its inputs follow the process."""
        if self._parts.inputs.free(self._freezer):
            self._parts.tell_writes()

    def state(self) -> dict[str, object]:
        """Return when it comes next (ns), and what is frozen."""
        due = self._parts.scheduler.due_ns(self._event) if self._event is not None else None
        return {"next_ns": due, **self._freezer.state()}

    def load(self, state: ModuleState) -> None:
        """Take over a state, with the registers of that time."""
        self._cancel()
        if state["next_ns"] is not None:
            self._begin(state["next_ns"])
        self._parts.inputs.load(self._freezer, state["owed"], state["kept"])

    @property
    def _period_ns(self) -> int:
        return ((int(self._parts.memory.read_now(self._bank, self._period)) & 0xFFFF) + 1) * CLOCK_PERIOD_NS

    @property
    def _is_enabled(self) -> bool:
        word = int(self._parts.memory.read_now(self._bank, self.status))
        wanted = self._enable is None or word >> self._enable & 1
        return bool(wanted) and self._parts.interrupts.is_enabled(self._bank, self.status)

    def _begin(self, first_ns: int) -> None:
        self._cancel()
        self._event = self._parts.scheduler.every(self._period_ns, first_ns, self._key, self._happen)

    def _cancel(self) -> None:
        if self._event is not None:
            self._event.cancel()
            self._event = None

    def _happen(self, now_ns: int, skipped: int) -> None:
        interrupts, inputs = self._parts.interrupts, self._parts.inputs
        inputs.freeze(self._freezer, interrupts.waiting(self._bank, self.status))
        self._parts.tell_writes()
        interrupts.post(self._bank, self.status, now_ns, skipped)


def _counted(value: Value) -> Value:
    """Return a number as a counter of 24 bits holds it."""
    return sign_extended(int(value), _COUNTER_BITS)
