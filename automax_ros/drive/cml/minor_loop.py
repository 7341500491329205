"""The current minor loop: one scan at each interrupt of the 57C406, six times a line cycle (52.0).

It knows neither the rack nor the plant: what it sees is ``Inputs`` and ``Measured``, what it gives an ``Outcome``.
Given the same state and the same of both it does the same, so a recorded drive runs again without its plant.
"""

from __future__ import annotations

from collections.abc import Sequence as Numbers
from dataclasses import dataclass

from automax_ros.drive.cml.current_control import CurrentControl
from automax_ros.drive.cml.inputs import Inputs
from automax_ros.drive.cml.latching import TICK_NS, Latched
from automax_ros.drive.cml.outputs import Outputs
from automax_ros.drive.cml.pll import Pll
from automax_ros.drive.cml.sequence import Phase, Sequence
from automax_ros.drive.cml.signals import FMCR, PERMISSIVE, RMCR, Command, Measured, Pulse
from automax_ros.drive.state import Stateful


@dataclass(frozen=True)
class Outcome:
    """What a scan gives.

    Attributes:
        command: for the 57C406.
        outputs: values in the order of ``OUTPUTS`` at a system clock tick, None between two.
        record: I_FDBK, REF_LAG_OUT and gate word for DIAG_DATA, None where none is written (52.3.2).
        problems: numbers of what is logged (``AMX7xxx``).
        initialised: whether this scan was the task's first: the registers of the 57C406 get their defaults.
    """

    command: Command
    outputs: tuple[int, ...] | None = None
    record: tuple[int, int, int] | None = None
    problems: tuple[int, ...] = ()
    initialised: bool = False


class CurrentMinorLoop(Stateful):
    """The loop of one drive; ``tests_scrs``: BAD_SCR_OUT is programmed, so the shorted SCR test is done (52.3.1)."""

    _kept = ("_started", "_tick")

    def __init__(self, *, tests_scrs: bool = False) -> None:
        """Begin as before task initialisation."""
        self._tests_scrs = tests_scrs
        self.restart()

    def restart(self) -> None:
        """The task is put into RUN: the next scan is its first."""
        self._started = False
        self._tick = -1
        self.outputs = Outputs()
        self.latched = Latched()
        self.pll = Pll()
        self.control = CurrentControl()
        self.sequence = Sequence()
        self._parts = (self.outputs, self.latched, self.pll, self.sequence, *self.control.parts)

    def scan(self, now_ns: int, measured: Measured, inputs: Inputs) -> Outcome:
        """Execute one scan at an interrupt.

        Args:
            now_ns: its instant, ns of rack time.
            measured: what the 57C406 tells.
            inputs: what the task has latched.
        """
        problems: list[int] = []
        first = not self._started
        if first:
            self._started = True
            problems += self.latched.start(inputs)
            self.pll.start(self.latched.ac_line_freq)
        self.pll.follow(measured)
        ticked = now_ns // TICK_NS != self._tick
        self._tick = now_ns // TICK_NS
        problems += self.latched.scan(inputs)
        if ticked:
            problems += self._look(now_ns, measured, inputs)
        self.control.feed_back(measured, self.latched.lim_bar, self.pll.period_ns)
        self.sequence.scan(now_ns, dropout_s=self.latched.max_m_dropout, discontinuous=measured.zero_us > 0)
        pulses = self._drive(measured)
        running = self.sequence.running
        self.outputs.dc_cml_state = running
        self.outputs.sync_locked = self.pll.locked
        self.outputs.line_period = self.pll.period_us
        command = Command(
            self.pll.next_ns, self.sequence.relays, pulses, self.latched.ioc_thresh, not running or self.control.block
        )
        return Outcome(
            command,
            self.outputs.row() if ticked else None,
            None,
            tuple(problems),
            first,
        )

    def _look(self, now_ns: int, measured: Measured, inputs: Inputs) -> list[int]:
        """Read the inputs of a tick and follow CML_RUN."""
        latched, sequence = self.latched, self.sequence
        problems = latched.tick(inputs, running=sequence.running, testing=latched.cml_test, options=measured.options)
        may_start = latched.usable and self.pll.locked and bool(measured.status & PERMISSIVE)
        relay = RMCR if inputs.mcr_select else FMCR
        before = sequence.phase
        sequence.tick(now_ns, run=latched.cml_run, may_start=may_start, relay=relay)
        if before is Phase.STANDBY and sequence.phase is Phase.CLOSING:
            self.control.begin()
        return problems

    def _drive(self, measured: Measured) -> tuple[Pulse, ...]:
        """Regulate and plan the pulses up to the next interrupt."""
        if not self.sequence.running:
            return self.control.off(self.pll)
        reference = self.latched.reference if self.sequence.phase is Phase.RUN else 0
        pulses = self.control.scan(measured, reference, self.latched, self.pll, reverse=False)
        self.control.show(self.outputs)
        return pulses

    # What is kept

    def numbers(self) -> list[float]:
        """Return all that the future depends on as numbers, always as many (``NUMBERS``)."""
        values: list[float] = []
        for part in (self, *self._parts):
            for name in part._kept:
                value = getattr(part, name)
                values.extend(map(float, value) if isinstance(value, list) else [float(value)])
        return values

    def take(self, numbers: Numbers[float]) -> None:
        """Take over what ``numbers`` gave.

        Raises:
            ValueError: they are not as many.
        """
        if len(numbers) != NUMBERS:
            raise ValueError(f"a drive's loop has {NUMBERS} numbers, not {len(numbers)}")
        rest = iter(numbers)
        for part in (self, *self._parts):
            for name in part._kept:
                old = getattr(part, name)
                if isinstance(old, list):
                    setattr(part, name, [type(item)(next(rest)) for item in old])
                else:
                    setattr(part, name, _like(old, next(rest)))


def _like(old: object, number: float) -> object:
    """Return a number as the type that an attribute has."""
    if isinstance(old, Phase):
        return Phase(int(number))
    return type(old)(number) if isinstance(old, (bool, int, float)) else number


NUMBERS = len(CurrentMinorLoop().numbers())
"""How many numbers the state of a loop is."""
