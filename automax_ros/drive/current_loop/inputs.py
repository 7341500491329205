"""The inputs of DC_DRIVE_CML as the task has latched them, when each is read, and the handling of bad values (52.1).

Three clocks: REFERENCE at each scan; most of the others at each system clock tick, only in run or only in standby as
table 1's text says; the fixed ones once, at task initialisation. A bad dynamic value is logged once, as it goes bad,
and the last good one stays. A bad fixed one is logged, the initial value of ``Latched`` stays, and the drive never
runs.

What is read in run is read as the run begins, too, so that no scan runs with values of the last run (decision).
CC_THRESH, for which the manual names no clock, is read at each tick (decision).
"""

from __future__ import annotations

from functools import lru_cache
from typing import Final, NamedTuple

from automax_ros.blocks.cml import ioc_is_possible, is_good
from automax_ros.drive.base.state import Stateful
from automax_ros.drive.current_loop.pll import LONGEST_NS, SHORTEST_NS

TICK_NS: Final = 5_500_000
"""The system clock tick, ns."""
FAST_CHANGE: Final = 1
DIERIKON: Final = 2
"""Bits of register 4146: fast bridge change (52.6.2), the SCR test of both bridges (52.7)."""
BAD_DYNAMIC: Final = 7105
BAD_FIXED: Final = 7106
BAD_LEVEL: Final = 7107
"""Problems: a dynamic input out of range, a fixed one out of range, IOC_THRESH of 1.8 LIM_BAR or more."""
BAD_RATIO: Final = 7117
"""Problem: the phase change of the PLL is not twice its period change (52.5.1)."""
_LIMITED: Final = (
    "ac_line_freq",
    "ref_lag",
    "pi_w_lead",
    "ag_factor",
    "max_m_dropout",
    "ioc_thresh",
    "lim_bar",
    "osv_thresh",
)
_SWITCHES: Final = ("digital_tach", "tach_loss_stop", "auto_phrot")
_DYNAMIC: Final = ("cc_thresh", "ref_rate", "kp", "test_alpha")
_SEEN: Final = 1 << len(_DYNAMIC)
_LOGGED: Final = _SEEN << 1
"""Bits after those of the dynamic inputs: registers of another ratio were read at the last tick; they were logged."""
_INPUTS: Final = _SEEN - 1


class Inputs(NamedTuple):
    """Values of one scan: latched variables, literals, and the defaults of table 1.

    The names are those of the block's parameters in lower case, in the order of its declaration. SPEED_FDBK and
    OSV_FDBK are None where they are not programmed.
    """

    io_cntl_slot: int
    dig_io_slot: int
    ac_line_freq: int
    reference: int
    ref_rate: float
    ref_lag: float
    kp: float
    pi_w_lead: float
    ag_factor: int
    cc_thresh: int
    cml_run: bool
    cml_coast_stop: bool
    mcr_select: bool
    max_m_dropout: float
    cml_test: bool
    test_brpol: bool
    test_alpha: int
    ioc_thresh: int
    lim_bar: int
    digital_tach: bool
    speed_fdbk: int | None
    tach_loss_stop: bool
    osv_fdbk: int | None
    osv_thresh: int
    nonstand_phrot: bool
    auto_phrot: bool
    fault_reset: bool


INPUTS: Final = tuple(name.upper() for name in Inputs._fields)
AT_REST: Final = Inputs(
    io_cntl_slot=0, dig_io_slot=0, ac_line_freq=60, reference=0, ref_rate=0.0, ref_lag=200.0, kp=0.0, pi_w_lead=10.0,
    ag_factor=1, cc_thresh=0, cml_run=False, cml_coast_stop=False, mcr_select=False, max_m_dropout=0.1, cml_test=False,
    test_brpol=False, test_alpha=180, ioc_thresh=400, lim_bar=100, digital_tach=True, speed_fdbk=None,
    tach_loss_stop=True, osv_fdbk=None, osv_thresh=0, nonstand_phrot=False, auto_phrot=False, fault_reset=False,
)  # fmt: skip
"""The inputs of a drive that is not to run."""


@lru_cache(maxsize=64)
def _is_rate_at_any_line(ref_rate: float) -> bool:
    """Return whether a REF_RATE (s) is within its limits at every line period that can be measured."""
    return all(is_good("REF_RATE", ref_rate, 1e9 / period_ns) for period_ns in (SHORTEST_NS, LONGEST_NS))


class Latched(Stateful):
    """The inputs in force, by the names of ``Inputs``; ``usable`` is FALSE where a fixed one is bad.

    ``fast_change`` and ``both_bridges`` are the bits of register 4146.
    """

    _kept = (
        "usable", "ac_line_freq", "reference", "ref_rate", "ref_lag", "kp", "pi_w_lead", "ag_factor", "cc_thresh",
        "cml_run", "cml_coast_stop", "max_m_dropout", "cml_test", "test_brpol", "test_alpha",
        "ioc_thresh", "lim_bar", "digital_tach", "tach_loss_stop", "osv_thresh", "auto_phrot", "fault_reset",
        "fast_change", "both_bridges", "_bad",
    )  # fmt: skip

    def __init__(self) -> None:
        self.usable = True
        self.ac_line_freq = 60
        self.reference = 0
        self.ref_rate = 0.0
        self.ref_lag = 200.0
        self.kp = 0.0
        self.pi_w_lead = 10.0
        self.ag_factor = 1
        self.cc_thresh = 0
        self.cml_run = self.cml_coast_stop = self.cml_test = self.test_brpol = False
        self.test_alpha = 180
        self.max_m_dropout = 0.1
        self.ioc_thresh = 400
        self.lim_bar = 100
        self.digital_tach = self.tach_loss_stop = True
        self.osv_thresh = 32767
        self.auto_phrot = self.fault_reset = self.fast_change = self.both_bridges = False
        self._bad = 0

    def start(self, inputs: Inputs) -> list[int]:
        """Read the fixed inputs at task initialisation; return the problems to log, one for each bad input."""
        self.__init__()  # type: ignore[misc]
        problems = []
        line_hz = inputs.ac_line_freq
        for name in _LIMITED:
            value = getattr(inputs, name)
            if is_good(name.upper(), value, line_hz):
                setattr(self, name, value)
            else:
                problems.append(BAD_FIXED)
        # Steps of 1 rad/s (52.1.2).
        self.ref_lag, self.pi_w_lead = float(round(self.ref_lag)), float(round(self.pi_w_lead))
        for name in _SWITCHES:
            setattr(self, name, getattr(inputs, name))
        if not problems and not ioc_is_possible(self.ioc_thresh, self.lim_bar):
            problems.append(BAD_LEVEL)
        self.usable = not problems
        return problems

    def standby(self, inputs: Inputs, options: int) -> None:
        """Read the inputs of standby at a tick: test mode, FAULT_RESET, register 4146."""
        self.cml_test, self.test_brpol, self.fault_reset = inputs.cml_test, inputs.test_brpol, inputs.fault_reset
        self.fast_change, self.both_bridges = bool(options & FAST_CHANGE), bool(options & DIERIKON)

    def run(self, inputs: Inputs, period_ns: int) -> list[int]:
        """Read the inputs of run at a tick; return the problems to log.

        Args:
            inputs: the values that the task has latched.
            period_ns: the measured period of the line, ns, which sets the limits of REF_RATE.
        """
        self.cml_coast_stop = inputs.cml_coast_stop
        problems = self._read("kp", inputs.kp, 0.0) if inputs.kp != self.kp or self._bad & _INPUTS else []
        rate = inputs.ref_rate
        if self._bad & _INPUTS or (rate and not (rate == self.ref_rate and _is_rate_at_any_line(rate))):
            problems += self._read("ref_rate", rate, 1e9 / period_ns)
        elif not rate:
            self.ref_rate = 0.0
        if self.cml_test and (inputs.test_alpha != self.test_alpha or self._bad & _INPUTS):
            problems += self._read("test_alpha", inputs.test_alpha, 0.0)
        return problems

    def always(self, inputs: Inputs) -> list[int]:
        """Read the inputs of both run and standby at a tick; return the problems to log."""
        self.cml_run = inputs.cml_run
        if inputs.cc_thresh == self.cc_thresh and not self._bad & _INPUTS:
            return []
        return self._read("cc_thresh", inputs.cc_thresh, 0.0)

    def ratio(self, phase_step: int, period_step: int) -> list[int]:
        """Check registers 4137 and 4138 at a tick; return the problem to log where their ratio is not 2 to 1.

        It is logged once from task initialisation on, if two ticks in a row show it: a task that changes them writes
        one after the other. They are used as they are (decision).
        """
        if phase_step == 2 * period_step or min(phase_step, period_step) <= 0 or self._bad & _LOGGED:
            self._bad &= ~_SEEN
            return []
        if self._bad & _SEEN:
            self._bad ^= _SEEN | _LOGGED
            return [BAD_RATIO]
        self._bad |= _SEEN
        return []

    def _read(self, name: str, value: int | float, line_hz: float) -> list[int]:
        """Read a dynamic value; return the problem to log as it goes bad."""
        bit = 1 << _DYNAMIC.index(name)
        if is_good(name.upper(), value, line_hz):
            setattr(self, name, value)
            self._bad &= ~bit
            return []
        if self._bad & bit:
            return []
        self._bad |= bit
        return [BAD_DYNAMIC]
