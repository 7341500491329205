"""The 57C406's access to a plant: it measures between interrupts and fires the gates as the loop commands.

It needs neither registers nor a rack: the module is in ``rack/modules``, and a bench or a PMI works without it.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from math import fmod, pi
from typing import Final

from automax_ros.drive.circuit.ac_line import Rotation
from automax_ros.drive.circuit.scr import mask_of
from automax_ros.drive.current_loop.signals import (
    LATE_BIT,
    LATEST_US,
    LINE,
    OVERCURRENT,
    OVERSPEED,
    RATED,
    ROTATION_ABC,
    VOLTAGE,
    VOLTS,
    Command,
    Measured,
    gate_numbers,
)
from automax_ros.drive.plant.overspeed import OverspeedCircuit
from automax_ros.drive.plant.plant import DrivePlant

LARGEST: Final = (1 << 31) - 1
LEAST_SYNC: Final = 0.25
"""Part of the nominal line voltage below which there is no sync voltage (decision)."""
TURN: Final = 2 * pi
_new = tuple.__new__
"""Creates a named tuple by tuple's constructor: its own takes twice the time."""


def _word(value: float) -> int:
    number = round(value)
    return number if -LARGEST <= number <= LARGEST else LARGEST if number > 0 else -LARGEST


@lru_cache(maxsize=4096)
def _gate_mask(word: int) -> int:
    return mask_of(gate_numbers(word))


class DriveController:
    """Measures a plant at interrupts and executes commands; without a plant there is no line."""

    def __init__(self, plant: DrivePlant | None, full_rpm: float | None = None) -> None:
        """Create the controller with gates off; ``full_rpm``: speed of 4095 counts, None for the motor's base speed."""
        self.plant = plant
        self.overspeed = OverspeedCircuit(plant, full_rpm)
        self.level = 400
        self.late_us = 0
        self._ahead = (0, 0)
        self._fired = (0, 0)

    def measure(self, now_ns: int, status: int = 0, registers: tuple[int, int, int, int] = (109, 4, 2, 0)) -> Measured:
        """Advance the plant to an interrupt and return the measurements since the previous one.

        Args:
            now_ns: the instant, ns.
            status: bits of inputs and switches; VOLTAGE where a 57C405 is wired to the armature. The delay of the last
                command is added.
            registers: 4136, 4137, 4138, 4146.
        """
        plant = self.plant
        if plant is None:
            return Measured(status, 0, 0, 0, 0, 0, *registers)
        plant.advance(now_ns)
        circuit, line = plant.circuit, plant.line
        sample = plant.sample()
        status |= self.late_us << LATE_BIT
        if self.watch() or self.overspeed.sees:
            status |= OVERSPEED
            self.overspeed.note_reported()
        sync = plant.sync
        if 0 not in line.missing and line.v_ll_v >= LEAST_SYNC * plant.rated_v and sync.is_there:
            status |= LINE
        if line.rotation is Rotation.CBA:
            status |= ROTATION_ABC
        amps = sample.mean_current_a
        line_a, rated_a = circuit.line_a, plant.rated_amps
        level_a = self.level * rated_a / 100
        if line_a > level_a or sample.exceeds(level_a):
            status |= OVERCURRENT
        idle_us = 0 if circuit.flows else int(circuit.idle_s * 1e6)
        voltage = since_ns = 0
        if status & VOLTAGE:
            volts = circuit.emf_v if idle_us else sample.mean_voltage_v
            voltage = _word(volts * VOLTS / plant.rated_v)
        if status & LINE:
            turn = fmod(line.angle(now_ns), TURN)
            since_ns = round(sync.since(turn if turn >= 0.0 else turn + TURN) / line.omega * 1e9)
        values = (
            status,
            _word(amps / rated_a * RATED),
            round(sample.zero_current_s * 1e6),
            idle_us,
            since_ns,
            voltage,
            *registers,
            _word(line_a / rated_a * RATED),
        )
        return _new(Measured, values)

    def command(self, command: Command, interrupt_ns: int, now_ns: int = 0) -> None:
        """Execute the loop's command until the next interrupt: relays and gates.

        A command that comes after its interrupt replaces the plan by which the gates continued meanwhile: pulses that
        should have begun since the interrupt begin at once, those that the plan has already fired are not fired twice
        (decision: nothing is lost for computing time).

        Args:
            command: the command.
            interrupt_ns: the instant of the interrupt, from which pulses count, ns.
            now_ns: the present where it is later, ns.
        """
        now_ns = max(now_ns, interrupt_ns)
        self.late_us = min(LATEST_US, (now_ns - interrupt_ns) // 1000)
        plant = self.plant
        if plant is None:
            return
        plant.advance(now_ns)
        self.level = command.level
        if self.overspeed.holds(ok=command.ok):
            return
        plant.relay(on=command.relays != 0)
        if command.block:
            plant.bridge.cancel(plant.now_ns)
            self._ahead = self._fired = (0, 0)
        elif self._ahead[1]:
            plant.bridge.take_back()
            if self._ahead[0] < now_ns:
                self._fired = self._ahead
            self._ahead = (0, 0)
        fired_ns, fired = self._fired
        for after_ns, length_ns, gates in command.pulses:
            on_ns = interrupt_ns + after_ns
            off_ns = on_ns + length_ns
            if gates == fired and on_ns < fired_ns + 3 * length_ns:
                continue
            if off_ns > now_ns:
                plant.circuit.fire_mask(on_ns if on_ns > now_ns else now_ns, off_ns, _gate_mask(gates))
            if after_ns >= command.next_ns:
                self._ahead = (on_ns, gates)

    def watch(self) -> bool:
        """Check the plant's present speed by the overspeed circuit; return whether it has an unreported trip.

        When it trips, gates and contactor are off, whatever the loop commands, and also without a loop.
        """
        if self.overspeed.look():
            self._suppress()
        return self.overspeed.is_news

    def state(self) -> list[int]:
        """Return the state, without that of the plant."""
        return [self.level, self.late_us, *self._ahead, *self._fired, *self.overspeed.state()]

    def load(self, state: Sequence[int]) -> None:
        """Restore what ``state`` returned."""
        self.level, self.late_us, ahead_ns, ahead, fired_ns, fired, *overspeed = state
        self._ahead, self._fired = (ahead_ns, ahead), (fired_ns, fired)
        self.overspeed.load(overspeed)

    def off(self, now_ns: int) -> None:
        """Suppress all gates at an instant, ns, and turn the contactor's relay off: there are no more commands."""
        self.late_us = 0
        if self.plant is not None:
            self.plant.advance(now_ns)
        self._suppress()

    def _suppress(self) -> None:
        """Suppress all gates and turn the contactor's relay off, at the plant's present."""
        self._ahead = self._fired = (0, 0)
        plant = self.plant
        if plant is not None:
            plant.bridge.cancel(plant.now_ns)
            plant.relay(on=False)
