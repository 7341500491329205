"""The outputs of DC_DRIVE_CML in the order of its declaration (52.1.6, 52.2), DIAG_DATA left out."""

from __future__ import annotations

from dataclasses import dataclass, fields
from operator import attrgetter
from typing import Final

from automax_ros.drive.state import Stateful


@dataclass
class Outputs(Stateful):
    """What the block shows; the loop keeps it up to date, and the task writes it at each system clock tick."""

    dc_cml_state: bool = False
    sync_locked: bool = False
    line_period: int = 0
    inswitch_posa: bool = False
    inswitch_posb: bool = False
    infault_reset: bool = False
    dc_time: int = 0
    bridge_pol: bool = False
    ref_rate_out: int = 0
    ref_lag_out: int = 0
    fdbk_gain: int = 0
    i_fdbk: int = 0
    integral_gain: int = 0
    delta: int = 0
    ioc_out: bool = False
    sync_loss_out: bool = False
    tach_loss_out: bool = False
    osv_out: bool = False
    ext_iet_out: bool = False
    phrot_flt_out: bool = False
    bad_scr_out: bool = False
    bad_scr_num: int = 0

    def row(self) -> tuple[int, ...]:
        """Return the values in the order of ``OUTPUTS``."""
        return _row(self)


_NAMES: Final = tuple(item.name for item in fields(Outputs))
_row = attrgetter(*_NAMES)
OUTPUTS: Final = tuple(name.upper() for name in _NAMES)
Outputs._kept = _NAMES
