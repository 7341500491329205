"""A drive I/O controller 57C406 of a running rack: it interrupts, measures the drive and fires its gates (52.0, 52.7).

It is the ``DrivePort`` of the current minor loop (CML) task that names its slot. While that task runs it interrupts six
times per line cycle, measures its plant and makes a scan of the task due, whose command it executes: gates, the
contactor's relay, the outputs of the drive digital I/O module. Without such a task gates and relays are off. The plant
continues in any case, whether the rack runs, is stopped or has no power (decision).

Its registers are outputs: the task's initialisation gives them their defaults, STOP ALL and a loss of power 0 (2.4.5).
The contactor follows the task's command; a force on the point of a relay only changes what the point shows (decision).

Each access to it delays its microprocessor (52.7), and so the loop's command, not the firing circuit. In modeled
execution a command takes effect later by ``ACCESS_NS`` for each common on its registers that a scan of any task has
latched, read or written since the interrupt, at most until the next one. Accesses by the loop itself, from outside and
in another process do not count (decision).

On its front are a test switch A, centre, B and a fault reset switch (52.1.6). The test switch is held in its position
until it is moved to the centre; the fault reset switch is pressed for half a second, or as long as ``false`` says
(decision). They are only inputs: their effect is up to the application.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

from automax_ros.core.kinds import WriteKind
from automax_ros.core.text import count_of
from automax_ros.drive.current_loop.signals import (
    RESET_SWITCH,
    SWITCH_A,
    SWITCH_B,
    VOLTAGE,
    VOLTS,
    Command,
    Measured,
    Pulse,
)
from automax_ros.drive.plant.controller import DriveController
from automax_ros.drive.plant.plant import DrivePlant
from automax_ros.rack.modules.drive_io import DriveDigital
from automax_ros.rack.modules.module import ModuleState
from automax_ros.rack.tasks.installation import RackServices
from automax_ros.rack.tasks.scheduled_task import ScheduledTask
from automax_ros.rackfile.model.module import ModuleConfig
from automax_ros.rackfile.modules.drive import ACCESS_NS, DEFAULTS, OPTIONS, PERIOD_STEP, PHASE_STEP, TACH_THRESHOLD
from automax_ros.runtime.time.scheduler import NO_EVENT, EventClass, EventKey, PeriodicAction, ScheduledEvent, Scheduler

USUAL_NS = 2_777_778
"""Time between two interrupts until a task sets it, ns: a sixth of a cycle at 60 Hz (decision)."""
LATE_NS = 1_000_000
"""An interrupt later than this counts as late, ns."""
PRESSED_NS = 500_000_000
"""Time for which the fault reset switch is pressed, ns (decision)."""
TEST_SWITCH, FAULT_RESET_SWITCH = "test_switch", "fault_reset_switch"
CONTROLS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {TEST_SWITCH: ("A", "B", "centre"), FAULT_RESET_SWITCH: ("true", "false")}
)
"""The switches with their positions, as written in stimuli files and commands."""
_TEST_BITS = {"A": SWITCH_A, "B": SWITCH_B, "centre": 0}
_new = tuple.__new__
"""Makes a named tuple as a plain one: its own constructor takes twice the time, and one is made at each interrupt."""
REST_NS = 5_500_000
"""Interval at which a plant whose drive rests is updated, ns: the system clock tick (decision)."""


@dataclass
class InterruptTiming:
    """Lateness of interrupts on the wall clock, and how many were more than ``LATE_NS`` late; none if simulated."""

    interrupts: int = 0
    late: int = 0
    greatest_ns: int = 0

    def describe(self) -> str:
        """Return the counts in words."""
        late = f"{self.late} later than {LATE_NS / 1e6:g} ms"
        return f"{count_of(self.interrupts, 'interrupt')}, {late}, the latest by {self.greatest_ns / 1e6:.3g} ms"

    def note(self, late_ns: int) -> None:
        """Count an interrupt with its lateness, 0 or less if it was not late."""
        self.interrupts += 1
        self.greatest_ns = max(self.greatest_ns, late_ns)
        if late_ns > LATE_NS:
            self.late += 1


class DriveInterrupts:
    """Interrupts from ``arm`` to ``disarm``. One that a late host missed is executed late, in order (decision).

    ``at_ns`` is when the last one was, ``interval_ns`` the time from one to the next as the last command set it.
    """

    def __init__(self, scheduler: Scheduler, slot: int, measure: Callable[[int], None]) -> None:
        """Create without interrupts; each calls ``measure`` with its instant, before the scan that it makes due."""
        self._scheduler, self._measure = scheduler, measure
        self._key = EventKey(EventClass.IO, slot, "interrupt")
        self._event: ScheduledEvent | None = None
        self._event_ns = 0
        self._scan: ScheduledEvent | None = None
        self._scan_key = self._key
        self._due: PeriodicAction = _nothing
        self.armed = False
        self.at_ns = 0
        self.interval_ns = USUAL_NS
        self.timing = InterruptTiming()

    @property
    def next_ns(self) -> int | None:
        """When the next one comes; None while not armed."""
        return None if self._event is None else self._event_ns

    def arm(self, first_ns: int, key: EventKey, due: PeriodicAction) -> None:
        """Interrupt at ``first_ns`` and after each interval; ``due`` has the place ``key`` among the scans."""
        self.disarm()
        self._scan_key, self._due, self.armed = key, due, True
        self._post(first_ns, ScheduledEvent(self._key, self._happen))

    def disarm(self) -> None:
        """End the interrupts."""
        self.armed = False
        for event in (self._event, self._scan):
            if event is not None:
                event.cancel()
        self._event = self._scan = None

    def follow(self, next_ns: int) -> None:
        """Set the time from the last interrupt to the next, ns, as commanded; if that has passed, interrupt now."""
        self.interval_ns = max(1, next_ns)
        if self._event is None:
            return
        at_ns, now_ns = self.at_ns + self.interval_ns, self._scheduler.now_ns
        at_ns = max(at_ns, now_ns)
        if at_ns != self._event_ns:
            self._event.cancel()
            self._post(at_ns, ScheduledEvent(self._key, self._happen))

    def state(self) -> dict[str, int]:
        """Return when the last one was, and the interval; the caller of ``arm`` keeps when the next one comes."""
        return {"at_ns": self.at_ns, "interval_ns": self.interval_ns}

    def load(self, state: ModuleState) -> None:
        """Restore a state."""
        self.at_ns, self.interval_ns = state["at_ns"], state["interval_ns"]

    def _post(self, at_ns: int, event: ScheduledEvent) -> None:
        self._event, self._event_ns = self._scheduler.post(at_ns, event), at_ns

    def _happen(self, now_ns: int, _: int) -> None:
        scheduler, event = self._scheduler, self._event
        assert event is not None
        self.at_ns = now_ns
        self.timing.note(scheduler.wall_ns - now_ns)
        # Before the scan: time passes in a modeled one, and in what follows it, at most to the next interrupt.
        self._post(now_ns + self.interval_ns, event)
        self._measure(now_ns)
        if scheduler.advance_to(now_ns, self._scan_key):
            self._due(now_ns, 0)
        else:
            self._scan = scheduler.at(now_ns, self._scan_key, self._scan_now)

    def _scan_now(self, now_ns: int) -> None:
        self._scan = None
        self._due(now_ns, 0)


def _nothing(now_ns: int, skipped: int) -> None:
    """Do nothing: the interrupts are not armed."""


class FrontSwitches:
    """The switches of one module."""

    def __init__(self, scheduler: Scheduler, slot: int) -> None:
        self._scheduler = scheduler
        self._key = EventKey(EventClass.IO, slot, "switch")
        self._test = "centre"
        self._release: ScheduledEvent | None = None

    def status(self) -> int:
        """Return the bits of ``Measured.status`` that the switches set."""
        return _TEST_BITS[self._test] | (RESET_SWITCH if self._release is not None else 0)

    def move(self, switch: str, position: str) -> None:
        """Move a switch to one of its positions in ``CONTROLS``."""
        if switch == TEST_SWITCH:
            self._test = position
        else:
            self._end_press(0)
            if position == "true":
                self._press(self._scheduler.now_ns + PRESSED_NS)

    def state(self) -> dict[str, object]:
        """Return their positions, and when the fault reset switch is released, ns."""
        until_ns = None if self._release is None else self._scheduler.due_ns(self._release)
        return {"test": self._test, "pressed_until_ns": until_ns}

    def load(self, state: ModuleState) -> None:
        """Restore a state."""
        self._end_press(0)
        self._test = state["test"]
        if state["pressed_until_ns"] is not None:
            self._press(state["pressed_until_ns"])

    def _press(self, until_ns: int) -> None:
        self._release = self._scheduler.at(until_ns, self._key, self._end_press)

    def _end_press(self, _: int) -> None:
        if self._release is not None:
            self._release.cancel()
            self._release = None


class DriveControllerModule:
    """A 57C406 with the plant that it drives, if any."""

    kept: frozenset[tuple[int, int]] = frozenset()
    tasks: Sequence[ScheduledTask] = ()

    def __init__(
        self, config: ModuleConfig, parts: RackServices, plant: DrivePlant | None, full_rpm: float | None = None
    ) -> None:
        """Attach the module to the rack's drives; it does nothing until a task arms it.

        ``full_rpm`` is the speed that the plant's tachometer shows as 4095, None for the motor's base speed.
        """
        bank = parts.backplane.bank(config.slot)
        assert bank is not None
        self.config, self._parts, self._view, self._plant = config, parts, bank.view, plant
        self._memory, self._scheduler = parts.memory, parts.scheduler
        self._writer = parts.writer(config.name)
        self._controller = DriveController(plant, full_rpm)
        self._interrupts = DriveInterrupts(parts.scheduler, config.slot, self._measure)
        self._switches = FrontSwitches(parts.scheduler, config.slot)
        self._digital = DriveDigital(parts.memory, parts.backplane, parts.scheduler, self._writer)
        self._measured = Measured(0)
        self._rest_key = EventKey(EventClass.IO, config.slot, "rest")
        self._rest = NO_EVENT
        self._accesses = 0
        self._command_key = EventKey(EventClass.IO, config.slot, "command")
        self._delayed: tuple[Command, ScheduledEvent] | None = None
        parts.drives.attach(config.slot, self)
        parts.memory.watch_accesses(bank.view, self._count_access)

    @property
    def timing(self) -> InterruptTiming:
        """Lateness of the interrupts."""
        return self._interrupts.timing

    def power_on(self) -> None:
        """Start the plant's time; gates stay off until a task arms the module."""
        if not self._interrupts.armed:
            self._rest_from(self._scheduler.now_ns + REST_NS)

    def power_off(self) -> None:
        """Reset the overspeed circuit; the task that armed it is stopped, or has not started."""
        self.disarm()
        self._controller.overspeed.unpower()

    def stopped_all(self) -> None:
        """Disarm; the task that armed it is stopped."""
        self.disarm()

    def state(self) -> ModuleState:
        """Return the last measurement, the switches and when it interrupts; the plant has a state of its own."""
        return {
            "interrupts": self._interrupts.state(),
            "switches": self._switches.state(),
            "measured": list(self._measured),
            "firing": self._controller.state(),
            "digital": self._digital.slot,
            "rest_ns": self._scheduler.due_ns(self._rest),
            "accesses": self._accesses,
            "delayed": self._delayed_state(),
        }

    def load(self, state: ModuleState) -> None:
        """Restore a state; the task that armed the module arms it again."""
        self._interrupts.load(state["interrupts"])
        self._switches.load(state["switches"])
        self._measured = Measured(*state["measured"])
        self._controller.load(state["firing"])
        self._digital.serve(state["digital"])
        self._rest.cancel()
        if state["rest_ns"] is not None:
            self._rest_from(state["rest_ns"])
        self._forget_accesses()
        self._accesses = state["accesses"]
        if state["delayed"] is not None:
            due_ns, (next_ns, relays, pulses, level, block, ok) = state["delayed"]
            self._delay(Command(next_ns, relays, tuple(Pulse(*pulse) for pulse in pulses), level, block, ok), due_ns)

    @property
    def controls(self) -> Mapping[str, tuple[str, ...]]:
        """The switches on its front, with their positions."""
        return CONTROLS

    def operate(self, verb: str, value: str) -> None:
        """Move a switch."""
        self._switches.move(verb, value)

    @property
    def next_ns(self) -> int | None:
        """When the next interrupt comes; None while not armed."""
        return self._interrupts.next_ns

    def initialise(self) -> None:
        """Give the registers their defaults."""
        memory = self._memory
        memory.now_ns = self._scheduler.now_ns
        for register, value in DEFAULTS.items():
            memory.write_now(self._view, value, self._writer, register, WriteKind.OUTSIDE)

    def watch_speed(self, counts: int) -> None:
        """Set the limit of the overspeed circuit, which stays set when the task ends."""
        self._controller.overspeed.counts = counts

    def arm(self, first_ns: int, key: EventKey, due: PeriodicAction) -> None:
        """Interrupt at ``first_ns`` and from then on."""
        self._rest.cancel()
        self._interrupts.arm(first_ns, key, due)

    def disarm(self) -> None:
        """End the interrupts: gates, relays and drive OK are off at once."""
        if not self._interrupts.armed:
            return
        self._interrupts.disarm()
        self._forget_accesses()
        self._controller.off(self._scheduler.now_ns)
        self._digital.show(0, ok=False)
        self._rest_from(self._scheduler.now_ns + REST_NS)

    def measure(self, dig_slot: int) -> Measured:
        """Return the measurement of the last interrupt, with registers, inputs and switches as they are now."""
        digital = self._digital
        digital.serve(dig_slot)
        memory, view, last = self._memory, self._view, self._measured
        values = (
            last.status | digital.status() | self._switches.status(),
            last.current,
            last.zero_us,
            last.tail_us,
            last.since_sync_ns,
            last.voltage,
            int(memory.read_now(view, TACH_THRESHOLD)),
            int(memory.read_now(view, PHASE_STEP)),
            int(memory.read_now(view, PERIOD_STEP)),
            int(memory.read_now(view, OPTIONS)),
            last.line,
        )
        return _new(Measured, values)

    def command(self, command: Command) -> None:
        """Execute the command for the time up to the next interrupt; its times count from the last one."""
        at_ns, now_ns = self._interrupts.at_ns, self._scheduler.now_ns
        due_ns = min(now_ns + self._accesses * ACCESS_NS, at_ns + command.next_ns - 1)
        if due_ns > now_ns:
            self._delay(command, due_ns)
        else:
            self._controller.command(command, at_ns, now_ns)
        tripped = self._controller.overspeed.tripped
        self._digital.show(0 if tripped else command.relays, ok=command.ok and not tripped)
        self._interrupts.follow(command.next_ns)

    def _count_access(self) -> None:
        self._accesses += 1

    def _delay(self, command: Command, due_ns: int) -> None:
        self._delayed = command, self._scheduler.at(due_ns, self._command_key, self._carry_out)

    def _carry_out(self, now_ns: int) -> None:
        delayed, self._delayed = self._delayed, None
        if delayed is not None:
            self._controller.command(delayed[0], self._interrupts.at_ns, now_ns)

    def _forget_accesses(self) -> None:
        delayed, self._delayed, self._accesses = self._delayed, None, 0
        if delayed is not None:
            delayed[1].cancel()

    def _delayed_state(self) -> list[Any] | None:
        if self._delayed is None:
            return None
        command, event = self._delayed
        return [self._scheduler.due_ns(event), [*command[:2], [list(pulse) for pulse in command.pulses], *command[3:]]]

    def _measure(self, now_ns: int) -> None:
        """Measure at an interrupt; a 57C405 that is wired to the armature shows its voltage."""
        self._accesses = 0
        feedback = self._parts.drives.voltage(self.config.slot)
        self._measured = self._controller.measure(now_ns, VOLTAGE if feedback is not None else 0)
        if self._controller.overspeed.tripped:
            # A loop that hangs sends no command, and the hardware needs none.
            self._digital.show(0, ok=False)
        if feedback is not None and self._plant is not None:
            line_v = self._plant.data.parameters.line_v
            feedback(self._measured.voltage * line_v / VOLTS, line_v)

    def _rest_from(self, first_ns: int) -> None:
        if self._plant is not None:
            self._rest.cancel()
            self._rest = self._scheduler.at(first_ns, self._rest_key, self._update)

    def _update(self, now_ns: int) -> None:
        """Advance the plant while it is not driven; no update is left out if the host is late."""
        self._rest_from(now_ns + REST_NS)
        plant = self._plant
        if plant is not None:
            plant.advance(now_ns)
            self._controller.watch()
            feedback = self._parts.drives.voltage(self.config.slot)
            if feedback is not None:
                feedback(plant.circuit.armature_v, plant.data.parameters.line_v)
                self._parts.report_writes()
