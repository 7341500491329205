"""The outputs of DC_DRIVE_CML in the order of its declaration (52.1.6, 52.2), and the array DIAG_DATA apart from them.

In DIAG_DATA, an array of two pages, the current minor loop writes the records of scans (52.3.2, table 2). The array is
dimensioned (37,1): 38 rows of two columns, a column is a page. Element (row, page) has the index
``row * 2 + page``. Row 0 of page 0 is PAGE_NUMBER, row 1 of a page its NEXT_ENTRY. Record n, 1 to 12, stands in the
rows 3n - 1, 3n and 3n + 1: I_FDBK, REF_LAG_OUT, gate command word (decision: table 2 is not printed legibly; 2 + 12 x 3
rows are all there are).
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from operator import attrgetter
from typing import Final

from automax_ros.drive.base.state import Stateful
from automax_ros.drive.current_loop.signals import Pulse

RECORDS: Final = 12
"""Records of a page (52.3.2)."""
ROWS: Final = 38
PAGES: Final = 2
SIZE: Final = ROWS * PAGES
"""Elements of the array."""
PAGE_NUMBER: Final = 0
"""Index of the element that selects the page to write: 0 is page 0, any other value page 1."""
Record = tuple[int, int, int]
"""I_FDBK, REF_LAG_OUT and the gates to be pulsed for the feedback of the next scan."""


@dataclass
class Outputs(Stateful):
    """The outputs of the block; the loop keeps them up to date, and the task writes them at each system clock tick."""

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


def page_of(page_number: int) -> int:
    """Return the page that PAGE_NUMBER selects, 0 or 1."""
    return 1 if page_number else 0


def next_entry_index(page: int) -> int:
    """Return the index of a page's NEXT_ENTRY."""
    return PAGES + page


def writes(page: int, next_entry: int, record: Record) -> tuple[tuple[int, int], ...]:
    """Return the writes for a record: (index, value) of its three words, then of NEXT_ENTRY.

    Args:
        page: 0 or 1.
        next_entry: the page's NEXT_ENTRY; 0, and what is out of range, means the first record (decision: 52.3.2 has it
            clamped to 0).
        record: the words of the scan.
    """
    number = next_entry if 1 <= next_entry <= RECORDS else 1
    first = (3 * number - 1) * PAGES + page
    words = tuple((first + PAGES * place, word) for place, word in enumerate(record))
    return (*words, (next_entry_index(page), number % RECORDS + 1))


def gates_of(pulses: tuple[Pulse, ...], next_ns: int) -> int:
    """Return the gates to be pulsed from an interrupt to the next, as bits: 0 where none is (52.3.2).

    Args:
        pulses: the gate windows of a command.
        next_ns: time to the next interrupt, ns; a window that begins later belongs to a later record.
    """
    gates = 0
    for after_ns, _, word in pulses:
        if after_ns < next_ns:
            gates |= word
    return gates
