"""When each input of DC_DRIVE_CML is read, and what is in force when one is bad (52.1).

``fixed`` ones count from task initialisation on; the others are looked at each scan, each system clock tick, or in
standby or run alone. A bad dynamic value is logged, and the last good one stays.
"""

from __future__ import annotations

from automax_ros.drive.cml.inputs import Inputs
from automax_ros.drive.state import Stateful

TICK_NS = 5_500_000
"""The system clock tick, ns."""


class Latched(Stateful):
    """The inputs in force, by the names of ``Inputs``; ``usable`` is FALSE where a fixed one is bad."""

    _kept = (
        "usable", "ac_line_freq", "reference", "ref_rate", "ref_lag", "kp", "pi_w_lead", "ag_factor", "cc_thresh",
        "cml_run", "cml_coast_stop", "mcr_select", "max_m_dropout", "cml_test", "test_brpol", "test_alpha",
        "ioc_thresh", "lim_bar", "digital_tach", "tach_loss_stop", "osv_thresh", "auto_phrot", "fault_reset",
        "fast_change",
    )  # fmt: skip

    def __init__(self) -> None:
        """Begin with zeros: what is in force before a good value was seen."""
        self.usable = True
        self.ac_line_freq = 60
        self.reference = 0
        self.ref_rate = 0.0
        self.ref_lag = 200.0
        self.kp = 0.0
        self.pi_w_lead = 10.0
        self.ag_factor = 1
        self.cc_thresh = 0
        self.cml_run = self.cml_coast_stop = self.mcr_select = self.cml_test = self.test_brpol = False
        self.test_alpha = 180
        self.max_m_dropout = 0.1
        self.ioc_thresh = self.lim_bar = 100
        self.digital_tach = self.tach_loss_stop = True
        self.osv_thresh = 0
        self.auto_phrot = self.fault_reset = self.fast_change = False

    def start(self, inputs: Inputs) -> list[int]:
        """Read the fixed inputs at task initialisation; return the problems to log."""
        self.__init__()  # type: ignore[misc]
        for name in ("ac_line_freq", "ref_lag", "pi_w_lead", "ag_factor", "max_m_dropout", "ioc_thresh", "lim_bar",
                     "digital_tach", "tach_loss_stop", "osv_thresh", "auto_phrot"):  # fmt: skip
            setattr(self, name, getattr(inputs, name))
        return []

    def scan(self, inputs: Inputs) -> list[int]:
        """Read what is read each scan; return the problems to log."""
        self.reference = inputs.reference
        return []

    def tick(self, inputs: Inputs, *, running: bool, testing: bool, options: int) -> list[int]:
        """Read what is read each tick: in run and in standby each its own; return the problems to log."""
        self.cml_run = inputs.cml_run
        self.cc_thresh = inputs.cc_thresh
        if running:
            self.cml_coast_stop, self.ref_rate, self.kp = inputs.cml_coast_stop, inputs.ref_rate, inputs.kp
            if testing:
                self.test_alpha = inputs.test_alpha
        else:
            self.cml_test, self.test_brpol, self.fault_reset = inputs.cml_test, inputs.test_brpol, inputs.fault_reset
            self.fast_change = bool(options & 1)
        return []
