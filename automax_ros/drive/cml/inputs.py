"""The inputs of DC_DRIVE_CML as the loop gets them at each scan: what the task has latched, in the order of 52.1."""

from __future__ import annotations

from typing import Final, NamedTuple


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
