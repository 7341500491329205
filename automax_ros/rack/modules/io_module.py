"""An I/O module of a running rack: its registers, and its interrupts while the common clock runs.

Interrupts come at whole periods after the clock was turned on, a period being (period register + 1) x 0.5 ms. They need
the clock, an installed task with an EVENT on its ISCR and the enable bit, if the module has one: they start when the
last of the three is there, and a new period counts from the same start of the clock (decision). Interrupts of one
instant come in the order of slots, before all scans.
"""

from __future__ import annotations

from collections.abc import Sequence

from automax_ros.core.kinds import WriteKind
from automax_ros.core.numbers import sign_extended
from automax_ros.core.ticks import CLOCK_PERIOD_NS
from automax_ros.core.types import DataType, Value
from automax_ros.rack.modules.module import ModuleState
from automax_ros.rack.tasks.installation import RackServices
from automax_ros.rack.tasks.scheduled_task import ScheduledTask
from automax_ros.rackfile.model.module import Interrupt, ModuleConfig
from automax_ros.runtime.memory.memory import Freezer
from automax_ros.runtime.time.scheduler import NO_EVENT, EventClass, EventKey

_COUNTER_BITS = 24


class OwnRegisters:
    """The registers of a module as it reads and writes them itself; ``view`` is that of its bank."""

    def __init__(self, config: ModuleConfig, parts: RackServices) -> None:
        bank = parts.backplane.bank(config.slot)
        assert bank is not None
        self.view = bank.view
        self._name, self._parts, self._memory = config.name, parts, parts.memory

    def read(self, register: int) -> int:
        """Return a register."""
        return int(self._memory.read_now(self.view, register))

    def show(self, register: int, value: Value) -> None:
        """Write a register if its value changes."""
        memory = self._memory
        if memory.read_now(self.view, register) != value:
            memory.now_ns = self._parts.scheduler.now_ns
            memory.write_now(self.view, value, self._parts.writer(self._name), register, WriteKind.OUTSIDE)


class IoModule:
    """An I/O module."""

    tasks: Sequence[ScheduledTask] = ()

    def __init__(self, config: ModuleConfig, parts: RackServices) -> None:
        """Create a module from its configuration; it does nothing until the clock is turned on."""
        self.config, self._parts, self._own = config, parts, OwnRegisters(config, parts)
        self._view = view = self._own.view
        registers = config.registers
        inputs = (number for number in range(registers.count) if registers.direction(number) == "input")
        self.kept = parts.memory.registers.showing(view, inputs)
        self._interrupts = [_PeriodicInterrupt(config.slot, view, item, parts) for item in registers.interrupts]
        self._posted = False
        if self._interrupts:
            self._watch()
        for first in registers.counters:
            shown = sorted(parts.memory.registers.showing(view, [first]))
            doubles = [key for key in shown if parts.memory.specs[key[0]].type is DataType.DOUBLE]
            parts.inputs.shape(doubles, _counter_value)

    def power_on(self) -> None:
        """Start nothing: no register drives the clock yet."""

    def power_off(self) -> None:
        """End its interrupts."""
        self.stopped_all()

    def stopped_all(self) -> None:
        """Unfreeze the inputs: no task waits for them."""
        for interrupt in self._interrupts:
            interrupt.free()

    def state(self) -> ModuleState:
        """Return when its interrupts come, and what is frozen: ``{}`` without interrupts."""
        return {str(item.status): item.state() for item in self._interrupts}

    def load(self, state: ModuleState) -> None:
        """Restore a state; ValueError if it is that of another module."""
        if set(state) != {str(item.status) for item in self._interrupts}:
            raise ValueError(f"{self.config.name} has other interrupts")
        for item in self._interrupts:
            item.load(state[str(item.status)])
        if self._interrupts:
            self._check_soon()

    def _watch(self) -> None:
        parts, registers = self._parts, self.config.registers
        watched = {source for source, _ in registers.copies}
        for item in registers.interrupts:
            watched.update(number for number in (item.status, item.period) if number is not None)
            parts.clock.add_enable(self.config.name, self._view, item.status)
        for register in sorted(watched):
            parts.memory.watch(self._view, register, self._check_soon)
        parts.clock.watch(self._check)
        parts.interrupts.watch(self._task_installed)

    def _task_installed(self) -> None:
        if self._parts.clock.runs:
            self._check_soon()

    def _check_soon(self) -> None:
        """Check the registers when the write that changed one is complete, still at this instant."""
        if not self._posted:
            self._posted = True
            scheduler, key = self._parts.scheduler, EventKey(EventClass.IO, self.config.slot, "")
            scheduler.at(scheduler.now_ns, key, lambda _: self._check())

    def _check(self) -> None:
        """Start or end interrupts as the clock and the registers require."""
        self._posted = False
        for interrupt in self._interrupts:
            interrupt.schedule()
        own, registers = self._own, self.config.registers
        for source, copy in registers.copies:
            own.show(copy, own.read(source))
        for register, bits in registers.clock_status:
            own.show(register, bits if self._parts.clock.runs else 0)
        self._parts.report_writes()


class _PeriodicInterrupt:
    def __init__(self, slot: int, bank: int, interrupt: Interrupt, parts: RackServices) -> None:
        assert interrupt.period is not None
        self.status = interrupt.status
        self._bank, self._period, self._enable, self._parts = bank, interrupt.period, interrupt.enable, parts
        self._key = EventKey(EventClass.IO, slot, f"{interrupt.status:05}")
        self._freezer = Freezer(parts.memory.registers.showing(bank, interrupt.inputs))
        self._event = NO_EVENT

    def schedule(self) -> None:
        since, period = self._parts.clock.since_ns, self._period_ns
        if since is None or not self._is_enabled:
            self._event.cancel()
        elif self._event.cancelled or self._event.period_ns != period:
            passed = (self._parts.scheduler.now_ns - since) // period
            self._begin(since + (passed + 1) * period)

    def free(self) -> None:
        if self._parts.inputs.free(self._freezer):
            self._parts.report_writes()

    def state(self) -> dict[str, object]:
        return {"next_ns": self._parts.scheduler.due_ns(self._event), **self._freezer.state()}

    def load(self, state: ModuleState) -> None:
        self._event.cancel()
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
        self._event.cancel()
        self._event = self._parts.scheduler.every(self._period_ns, first_ns, self._key, self._happen)

    def _happen(self, now_ns: int, skipped: int) -> None:
        interrupts, inputs = self._parts.interrupts, self._parts.inputs
        inputs.freeze(self._freezer, interrupts.waiting(self._bank, self.status))
        self._parts.report_writes()
        interrupts.post(self._bank, self.status, now_ns, skipped)


def _counter_value(value: Value) -> Value:
    return sign_extended(int(value), _COUNTER_BITS)
