"""A UDC module of a running rack: its scans on the common clock, its copies of registers, its interrupt.

A scan of the module is A's task, then B's, every TICKS x 0.5 ms, from the end of the first interval of the common clock
on (S-3056 p. 4-4, 4-8). It copies application registers in, executes A and copies out what A wrote, then likewise B.
What A wrote B reads in the same scan (S-3006 p. 4-2). A task that is put into RUN while the other scans joins at the
next scan of the module (decision). Scans of UDCs come before those of Processors at the same instant (decision).

Application registers are copied between the local memory and the dual port. A register that a task of the UDC writes is
an output, all others are inputs (S-3056 p. 3-50). Booleans are copied out 32 bits at a time: one of them makes both
registers of an even pair outputs, whatever else they hold, so that neighbours are overwritten.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from automax_ros.core.types import DataType
from automax_ros.language.program import Program, lines_that_write
from automax_ros.language.tree.tree import Scope
from automax_ros.rack.modules.io_module import OwnRegisters
from automax_ros.rack.modules.module import ModuleState
from automax_ros.rack.modules.udc_pmi import UdcPmis
from automax_ros.rack.tasks.installation import RackServices
from automax_ros.rack.tasks.scheduled_task import ScheduledTask
from automax_ros.rack.tasks.triggers import Due
from automax_ros.rackfile.model.module import ModuleConfig
from automax_ros.rackfile.modules.udc import (
    APPLICATION,
    EVERY_SCAN,
    ISCR,
    RETAINED,
    SCAN_COUNTER,
    SCANS_PER_INTERRUPT,
)
from automax_ros.runtime.memory.memory import CommonMemory
from automax_ros.runtime.memory.private_image import LocalMemory
from automax_ros.runtime.memory.registers import RegisterMap
from automax_ros.runtime.tasks.task import Status, Task
from automax_ros.runtime.time.scheduler import NO_EVENT, EventClass, EventKey

Key = tuple[int, int]
"""View and element."""


@dataclass(frozen=True)
class Copied:
    """Copies at one of the two rates: ``inputs`` are copied in, ``outputs`` out, by the task that writes them."""

    inputs: tuple[Key, ...]
    outputs: dict[str, tuple[Key, ...]]


def copies_of(programs: Sequence[Program], bank: int, memory: CommonMemory) -> tuple[Copied, Copied]:
    """Return the copies of a UDC with these tasks at every scan and at every Nth; ``bank`` is its registers' view."""
    written: dict[int, str] = {}
    used: set[int] = set()
    for program in programs:
        names = {symbol.name for symbol in program.symbols.values() if symbol.scope is Scope.COMMON}
        used.update(register for name in names for register in application_registers(name, bank, memory))
        for name in lines_that_write(program):
            # If two tasks write a register, the later one is its last writer.
            written.update(dict.fromkeys(_sent_with(name, bank, memory), program.name))
    every = {register for register in (*used, *written) if register in EVERY_SCAN}
    nth = {register for register in (*used, *written) if register not in EVERY_SCAN}
    return _plan_copies(every, written, bank, memory.registers), _plan_copies(nth, written, bank, memory.registers)


def application_registers(name: str, bank: int, memory: CommonMemory) -> range:
    """Return the application registers of a common, none if it is not on any."""
    spec = memory.specs[memory.view(name)]
    if spec.place is None or spec.place.bank != bank or spec.place.register not in APPLICATION:
        return range(0)
    width = 2 if spec.type in (DataType.DOUBLE, DataType.REAL) else 1
    return range(spec.place.register, spec.place.register + width)


def _sent_with(name: str, bank: int, memory: CommonMemory) -> range:
    own = application_registers(name, bank, memory)
    if own and memory.specs[memory.view(name)].type is DataType.BOOLEAN:
        return range(own[0] & ~1, (own[0] & ~1) + 2)
    return own


def _plan_copies(registers: Iterable[int], written: dict[int, str], bank: int, views: RegisterMap) -> Copied:
    in_order = sorted(registers)
    inputs = views.showing(bank, [register for register in in_order if register not in written])
    outputs: dict[str, tuple[Key, ...]] = {}
    for register in in_order:
        if register in written:
            task = written[register]
            outputs[task] = (*outputs.get(task, ()), (bank, register))
    return Copied(tuple(sorted(inputs)), outputs)


class _Trigger:
    def __init__(self, module: UdcModule, task: Task) -> None:
        self._module, self.task = module, task
        self.armed = False

    def arm(self, first_ns: int, due: Due) -> None:  # noqa: ARG002
        """Include the task in the module's scans, whenever they are."""
        self.armed = True
        self._module.follow()

    def disarm(self) -> None:
        """Exclude the task from the module's scans."""
        if self.armed:
            self.armed = False
            self._module.left_out(self.task)

    @property
    def next_ns(self) -> int | None:
        """The present rack time while the task is included: the module keeps the instant of its scans."""
        return self._module.now_ns if self.armed else None


class UdcModule:
    """A UDC with its tasks, in the order of their drives."""

    def __init__(self, config: ModuleConfig, parts: RackServices) -> None:
        """Install the tasks; the module does nothing until the common clock runs."""
        self.config, self._parts, self._own = config, parts, OwnRegisters(config, parts)
        self._bank = bank = self._own.view
        views = parts.memory.registers
        self.kept = views.showing(bank, RETAINED)
        self._local = tuple(sorted(views.showing(bank, APPLICATION)))
        self._memory = LocalMemory(parts.memory, {view for view, _ in self._local if view != bank})
        self._copies: tuple[Copied, Copied] | None = None
        self._count = self._missed = 0
        self._rest: list[ScheduledTask] = []
        self._current: ScheduledTask | None = None
        self._scanning = False
        self._skipped = 0
        self._event = NO_EVENT
        self._key = EventKey(EventClass.SCAN, 0, config.name)
        self._triggers: dict[str, _Trigger] = {}
        execution = parts.execution(config.name)
        self.tasks: Sequence[ScheduledTask] = [
            parts.install(item, execution, memory=self._memory, trigger=self._trigger, then=self._has_run)
            for item in config.tasks
        ]
        self._pmis = UdcPmis(config, parts, self._own, self._commands)
        parts.clock.add_enable(config.name, bank, ISCR)
        parts.clock.watch(self.follow)

    @property
    def now_ns(self) -> int:
        """Rack time."""
        return self._parts.scheduler.now_ns

    @property
    def scan_ns(self) -> int | None:
        """When the next scan of the module is due; None without the common clock or a task in RUN."""
        return self._parts.scheduler.due_ns(self._event)

    def power_on(self) -> None:
        """Start the PMIs, which follow their lines; the common clock is off, so no scan starts."""
        self._pmis.begin()

    def power_off(self) -> None:
        """Stop the tasks; locals and application registers are lost, tunables and error logs stay (2.4.5)."""
        for item in self.tasks:
            item.stop()
        self.stopped_all()

    def stopped_all(self) -> None:
        """Clear what a UDC loses at STOP ALL: the locals of its tasks and its local memory (2.4.5)."""
        self._rest, self._current, self._scanning = [], None, False
        self._count = self._missed = 0
        self._memory.image.clear(self._local)
        for item in self.tasks:
            item.task.lose_locals()

    def follow(self) -> None:
        """Scan every TICKS of the clock's intervals, while the common clock runs and a task is included."""
        self._pmis.follow()
        clock, running = self._parts.clock, self._taking_part()
        if not clock.runs or not running:
            self._event.cancel()
        elif self._event.cancelled or self._event.period_ns != running[0].task.period_ns:
            self._scan_from(clock.next_ns)

    def left_out(self, task: Task) -> None:
        """Continue without a task that was stopped, even in the middle of its scan."""
        if self._current is not None and self._current.task is task:
            self._current = None
            self._go_on_soon()
        self.follow()

    def state(self) -> ModuleState:
        """Return the state of each task, the local memory, and how far the module's scan is."""
        read = self._memory.image.read_now
        held = ((view, element, read(view, element)) for view, element in self._local)
        return {
            "tasks": {item.name: item.state() for item in self.tasks},
            "local": [entry for entry in held if entry[2]],
            "count": self._count,
            "missed": self._missed,
            "scan_ns": self.scan_ns,
            "scanning": self._scanning,
            "current": None if self._current is None else self._current.name,
            "rest": [item.name for item in self._rest],
            "pmis": self._pmis.state(),
        }

    def load(self, state: ModuleState) -> None:
        """Restore a state, even in the middle of a scan; ValueError if it is that of other tasks, or does not fit."""
        own = {item.name: item for item in self.tasks}
        if set(state["tasks"]) != set(own):
            raise ValueError(f"{self.config.name} has the tasks {sorted(own)}")
        for name, item in own.items():
            item.load(state["tasks"][name])
        image = self._memory.image
        image.clear(self._local)
        image.load_image(state["local"])
        self._count, self._missed, self._scanning = state["count"], state["missed"], state["scanning"]
        self._current = own[state["current"]] if state["current"] is not None else None
        self._rest = [own[name] for name in state["rest"]]
        self._event.cancel()
        if state["scan_ns"] is not None:
            self._scan_from(state["scan_ns"])
        self._pmis.load(state["pmis"])
        if self._scanning and self._current is None:
            self._go_on_soon()

    def _commands(self, drive: str) -> bool:
        """Return whether a task scans that commands a drive: its own; for a drive without one any (decision)."""
        running = {item.name for item in self._taking_part()}
        own = {item.name for item in self.config.tasks if item.drive == drive}
        return bool(running & own if own else running)

    def _trigger(self, task: Task) -> _Trigger:
        self._copies = None
        self._triggers[task.name] = made = _Trigger(self, task)
        return made

    def _taking_part(self) -> list[ScheduledTask]:
        return [item for item in self.tasks if self._triggers[item.name].armed and item.task.status is Status.RUNNING]

    def _scan_from(self, first_ns: int) -> None:
        self._event.cancel()
        period_ns = self._taking_part()[0].task.period_ns
        self._event = self._parts.scheduler.every(period_ns, first_ns, self._key, self._scan)

    def _scan(self, now_ns: int, skipped: int) -> None:
        """Start a scan of the module; if the last one is still in progress, its task has overlapped (code 14)."""
        if self._current is not None:
            self._current.due(now_ns, skipped)
            return
        if not self._taking_part():
            self._event.cancel()
            return
        self._skipped = skipped
        self._begin(now_ns, skipped)
        self._rest, self._scanning = self._taking_part(), True
        self._go_on(now_ns)

    def _begin(self, now_ns: int, skipped: int) -> None:
        """Count the scan, and copy in what the tasks read: every Nth time also the registers of the Nth scan.

        Scans that a late host leaves out count too: the next one takes the place of an Nth one among them (decision).
        """
        self._parts.memory.now_ns = now_ns
        self._pmis.exchange(now_ns)
        every = self._scans_per_interrupt
        before = min(self._count, max(every - 1, 0))
        present = before + skipped + 1
        self._count = present % every if every else 0
        self._missed = present // every - (before + 1) // every if every else 0
        if self._own.read(SCAN_COUNTER) != self._count:
            self._own.show(SCAN_COUNTER, self._count)
            self._parts.report_writes()
        image, (at_every, at_nth) = self._memory.image, self._present_copies
        image.take(at_every.inputs)
        if every and present // every > before // every:
            image.take(at_nth.inputs)
        if self._parts.memory.forced:
            image.take_forced()

    def _go_on(self, now_ns: int) -> None:
        while self._rest:
            self._current = item = self._rest.pop(0)
            if self._triggers[item.name].armed and item.task.status is Status.RUNNING:
                item.due(now_ns, self._skipped)
                return
        self._current = None
        if self._scanning:
            self._scanning = False
            self._end(now_ns)

    def _has_run(self, task: Task) -> None:
        if self._current is None or self._current.task is not task or not self._scanning:
            return
        self._current = None
        now_ns = self.now_ns
        self._copy_out(self._present_copies[0], task.name, now_ns)
        self._go_on(now_ns)

    def _end(self, now_ns: int) -> None:
        """Copy out the registers of the Nth scan at the end of the scan before it, then interrupt (S-3006 p. 4-9)."""
        every = self._scans_per_interrupt
        due = self._missed + (self._count == every - 1)
        if not every or not due:
            return
        _, at_nth = self._present_copies
        for name in at_nth.outputs:
            self._copy_out(at_nth, name, now_ns)
        self._parts.interrupts.post(self._bank, ISCR, now_ns, skipped=due - 1)

    def _copy_out(self, copied: Copied, name: str, now_ns: int) -> None:
        keys = copied.outputs.get(name)
        if keys:
            writer = next(item.task.writer for item in self.tasks if item.name == name)
            self._parts.memory.now_ns = now_ns
            self._memory.image.give(keys, writer)
            self._parts.report_writes()

    @property
    def _scans_per_interrupt(self) -> int:
        """Register 2001; 0 or less means no interrupt and no copy of the registers of the Nth scan (decision)."""
        return max(0, self._own.read(SCANS_PER_INTERRUPT))

    @property
    def _present_copies(self) -> tuple[Copied, Copied]:
        if self._copies is None:
            programs = [item.task.compiled.program for item in self.tasks]
            self._copies = copies_of(programs, self._bank, self._parts.memory)
        return self._copies

    def _go_on_soon(self) -> None:
        """Continue the scan when the operation that stopped its task is complete, still at this instant."""
        self._parts.scheduler.at(self.now_ns, self._key, self._resume)

    def _resume(self, now_ns: int) -> None:
        if self._scanning and self._current is None:
            self._go_on(now_ns)
