"""The current minor loop: one scan at each interrupt of the 57C406, six in a line cycle (52.0).

It depends neither on the rack nor on the plant: it reads ``Inputs`` and ``Measured`` and returns an ``Outcome``.
The same state, inputs and measurements give the same outcome, so a recorded drive can run again without its plant.
"""

from __future__ import annotations

from collections.abc import Sequence as Numbers
from typing import Final, NamedTuple

from automax_ros.drive.base.state import Stateful
from automax_ros.drive.current_loop.current_control import CurrentControl
from automax_ros.drive.current_loop.faults import Faults
from automax_ros.drive.current_loop.inputs import TICK_NS, Inputs, Latched
from automax_ros.drive.current_loop.outputs import Outputs, gates_of
from automax_ros.drive.current_loop.pll import Pll
from automax_ros.drive.current_loop.scr_test import GO_ON, PASSED, ScrTest
from automax_ros.drive.current_loop.sequence import Phase, Sequence
from automax_ros.drive.current_loop.signals import (
    FMCR,
    PERMISSIVE,
    RESET_SWITCH,
    RMCR,
    ROTATION_ABC,
    SWITCH_A,
    SWITCH_B,
    Command,
    Measured,
    Pulse,
    late_us,
)

_REGISTERS: Final = {
    name: Measured._field_defaults[name] for name in ("tach_threshold", "phase_step", "period_step", "options")
}
"""The registers of the 57C406 at task initialisation (52.7), whatever they were before."""


_SCR_TEST: Final = Phase.SCR_TEST
_RUN: Final = Phase.RUN
_new = tuple.__new__


class Outcome(NamedTuple):
    """The result of a scan.

    Attributes:
        command: the command for the 57C406.
        outputs: values in the order of ``OUTPUTS`` at a system clock tick, None between two.
        record: I_FDBK, REF_LAG_OUT and gate word for DIAG_DATA, None where none is written (52.3.2).
        problems: numbers of the problems to log (``AMX7xxx``).
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
        self._tests_scrs = tests_scrs
        self.restart()

    def restart(self) -> None:
        """Prepare for RUN of the task: the next scan is its first; no fault is remembered (decision)."""
        self._started = False
        self._tick = -1
        self.outputs = Outputs()
        self.latched = Latched()
        self.pll = Pll()
        self.control = CurrentControl()
        self.sequence = Sequence()
        self.faults = Faults()
        self.scr_test = ScrTest()
        self._parts = (
            self.outputs, self.latched, self.pll, self.sequence, self.faults, self.scr_test,
            *self.control.parts,
        )  # fmt: skip

    @property
    def overspeed_counts(self) -> int:
        """The threshold of the hardware's overspeed circuit, counts; 0 where it is not set up (52.1.5).

        DIGITAL_TACH sets it up with OSV_THRESH, which it needs: without one, or with a bad fixed input, there is no
        circuit (decision).
        """
        latched = self.latched
        return latched.osv_thresh if latched.digital_tach and latched.usable else 0

    def scan(self, now_ns: int, measured: Measured, inputs: Inputs) -> Outcome:
        """Execute one scan at an interrupt."""
        first = not self._started
        problems: list[int] = []
        if first:
            self._started = True
            problems = self.latched.start(inputs)
            self.pll.start(self.latched.ac_line_freq)
            measured = measured._replace(**_REGISTERS)
        pll, sequence = self.pll, self.sequence
        pll.follow(measured)
        tick = now_ns // TICK_NS
        ticked = tick != self._tick
        self._tick = tick
        self.latched.reference = inputs.reference
        if ticked:
            problems += self._read(measured, inputs)
        self.control.feed_back(measured, self.latched.lim_bar, pll.period_ns)
        testing = sequence.phase is _SCR_TEST
        verdict = self.scr_test.judge(measured, reverse=_reverse(measured)) if testing else GO_ON
        causes = self.faults.causes(measured, inputs, self.latched, pll, running=sequence.phase >= _RUN)
        problems += self._protect(measured, causes, verdict)
        if ticked:
            self._follow_run(now_ns, measured, inputs, causes)
        if sequence.under_way:
            problems += self._go_on(now_ns, inputs, verdict)
        pulses = self._fire(measured)
        block = sequence.phase < _RUN or self.control.block
        ok = self.latched.usable and not self.faults.active
        # Named tuples are created by tuple's constructor: their own takes twice the time.
        values = pll.next_ns, sequence.relays, pulses, self.latched.ioc_thresh, block, ok
        row = self._row(measured) if ticked else None
        logged = tuple(problems) if problems else ()
        return _new(Outcome, (_new(Command, values), row, self._record(pulses), logged, first))

    def _read(self, measured: Measured, inputs: Inputs) -> list[int]:
        problems = self.latched.always(inputs) + self.latched.ratio(measured.phase_step, measured.period_step)
        if self.sequence.running:
            return problems + self.latched.run(inputs, self.pll.period_ns)
        self.latched.standby(inputs, measured.options)
        return problems

    def _protect(self, measured: Measured, causes: int, verdict: int) -> list[int]:
        """Latch faults; coast on a fault, without the permissive, or by CML_COAST_STOP; return the problems to log."""
        faults, sequence = self.faults, self.sequence
        problems = faults.blame(verdict) if verdict > PASSED else []
        if causes:
            problems += faults.latch(causes)
        if sequence.phase:
            called = sequence.running and self.latched.cml_coast_stop
            if called or not measured.status & PERMISSIVE or (faults.active and faults.stops(self.latched)):
                sequence.coast()
        return problems

    def _follow_run(self, now_ns: int, measured: Measured, inputs: Inputs, causes: int) -> None:
        """Follow CML_RUN and FAULT_RESET at a tick: a start that comes with the reset is refused (decision)."""
        latched, faults, sequence = self.latched, self.faults, self.sequence
        permitted = bool(measured.status & PERMISSIVE)
        may_start = latched.usable and self.pll.locked and permitted and not faults.active
        relay = RMCR if inputs.mcr_select else FMCR
        sequence.tick(now_ns, run=latched.cml_run, may_start=may_start, relay=relay)
        if faults.active and latched.fault_reset and not sequence.running:
            faults.reset(causes)

    def _go_on(self, now_ns: int, inputs: Inputs, verdict: int) -> list[int]:
        """Execute the next step of a start or stop when it is due; return the problems to log."""
        latched, sequence = self.latched, self.sequence
        if sequence.closed(now_ns) and self._tests_scrs:
            sequence.test(now_ns)
            self.scr_test.begin(both=latched.both_bridges)
        elif sequence.closed(now_ns) or (sequence.phase is _SCR_TEST and verdict == PASSED):
            return self._begin_run(now_ns, inputs)
        elif sequence.stopped(now_ns, dropout_s=latched.max_m_dropout, discontinuous=self.control.discontinuous):
            sequence.coast()
        return []

    def _begin_run(self, now_ns: int, inputs: Inputs) -> list[int]:
        self.sequence.run(now_ns)
        self.control.begin()
        self.faults.begin_run()
        problems = self.latched.run(inputs, self.pll.period_ns)
        if self.latched.cml_coast_stop:
            self.sequence.coast()
        return problems

    def _fire(self, measured: Measured) -> tuple[Pulse, ...]:
        pll, latched, phase, control = self.pll, self.latched, self.sequence.phase, self.control
        reverse = _reverse(measured)
        if phase < _RUN:
            none = control.off()
            if phase is _SCR_TEST:
                return self.scr_test.fire(
                    pll.position, pll.period_ns, reverse=reverse, late=late_us(measured.status) > 0
                )
            return none
        stopping = phase is not _RUN
        if stopping:
            control.chain.begin()
        if latched.cml_test:
            delta_us = 0.0 if stopping else (180 - latched.test_alpha) * pll.period_ns / 360_000
            pulses = control.open_loop(delta_us, 2 if latched.test_brpol else 1, pll, reverse=reverse)
        else:
            pulses = control.scan(measured, 0 if stopping else latched.reference, latched, pll, reverse=reverse)
        control.show(self.outputs)
        self.faults.note_delta(self.outputs.delta)
        return pulses

    def _row(self, measured: Measured) -> tuple[int, ...]:
        outputs, status = self.outputs, measured.status
        outputs.dc_cml_state = self.sequence.running
        outputs.sync_locked = self.pll.locked
        outputs.line_period = self.pll.period_us
        outputs.inswitch_posa = bool(status & SWITCH_A)
        outputs.inswitch_posb = bool(status & SWITCH_B)
        outputs.infault_reset = bool(status & RESET_SWITCH)
        self.faults.show(outputs)
        return outputs.row()

    def _record(self, pulses: tuple[Pulse, ...]) -> tuple[int, int, int] | None:
        """Return the record of a scan for DIAG_DATA: only while the loop regulates (52.3.2)."""
        if self.sequence.phase < _RUN or self.latched.cml_test:
            return None
        return self.outputs.i_fdbk, self.outputs.ref_lag_out, gates_of(pulses, self.pll.next_ns)

    # State

    def numbers(self) -> list[float]:
        """Return the whole state as numbers, always ``NUMBERS`` of them."""
        values: list[float] = []
        for part in (self, *self._parts):
            for name in part._kept:
                value = getattr(part, name)
                values.extend(map(float, value) if isinstance(value, list) else [float(value)])
        return values

    def take(self, numbers: Numbers[float]) -> None:
        """Restore the state that ``numbers`` returned.

        Raises:
            ValueError: there are more or fewer than ``NUMBERS``.
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


def _reverse(measured: Measured) -> bool:
    return bool(measured.status & ROTATION_ABC)


def _like(old: object, number: float) -> object:
    if isinstance(old, Phase):
        return Phase(int(number))
    return type(old)(number) if isinstance(old, (bool, int, float)) else number


NUMBERS: Final = len(CurrentMinorLoop().numbers())
"""Count of the numbers in the state of a loop."""
