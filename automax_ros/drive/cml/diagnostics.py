"""DIAG_DATA: where the current minor loop writes the record of a scan in the array of two pages (52.3.2, table 2).

The array is dimensioned (37,1): 38 rows of two columns, a column is a page. Element (row, page) has the index
``row * 2 + page``. Row 0 of page 0 is PAGE_NUMBER, row 1 of a page its NEXT_ENTRY. Record n, 1 to 12, stands in the
rows 3n - 1, 3n and 3n + 1: I_FDBK, REF_LAG_OUT, gate command word (decision: table 2 is not printed legibly; 2 + 12 x 3
rows are all there are).
"""

from __future__ import annotations

from typing import Final

from automax_ros.drive.cml.signals import Pulse
from automax_ros.drive.state import Stateful

RECORDS: Final = 12
"""Records of a page (52.3.2)."""
ROWS: Final = 38
PAGES: Final = 2
SIZE: Final = ROWS * PAGES
"""Elements of the array."""
PAGE_NUMBER: Final = 0
"""Index of the element that says which page is written: 0 is page 0, anything else page 1."""

Record = tuple[int, int, int]
"""I_FDBK, REF_LAG_OUT and the gates that make the feedback of the next scan."""


def page_of(page_number: int) -> int:
    """Return the page that PAGE_NUMBER selects, 0 or 1."""
    return 1 if page_number else 0


def next_entry_index(page: int) -> int:
    """Return the index of a page's NEXT_ENTRY."""
    return PAGES + page


def writes(page: int, next_entry: int, record: Record) -> tuple[tuple[int, int], ...]:
    """Return what to write for a record: (index, value) of its three words, then of NEXT_ENTRY.

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


class Feeding(Stateful):
    """Which gates make the feedback of the next scan: those whose SCRs carry current for most of it (decision).

    A pair is fired up to a scan after the interrupt; where that is late in the scan, the pair before it still makes
    most of the current that the next interrupt measures.
    """

    _kept = ("word", "began_ns")

    def __init__(self) -> None:
        """Begin with nothing fired."""
        self.word = 0
        self.began_ns = 0

    def begin(self) -> None:
        """Begin a run: nothing is fired."""
        self.word = self.began_ns = 0

    def follow(self, pulses: tuple[Pulse, ...], next_ns: int, flow_ns: int) -> int:
        """Return the gates that make the feedback of the scan from an interrupt to the next.

        Args:
            pulses: the gate windows of that time.
            next_ns: how long it is, ns.
            flow_ns: for how long a pair conducts, ns; not longer than to the next.
        """
        fed, began_ns = self.word, self.began_ns
        word, most = (pulses[0].gates, 0) if pulses else (fed, 0)
        for after_ns, _, gates in (*pulses, (next_ns, 0, 0)):
            end_ns = began_ns + flow_ns
            carries_ns = (after_ns if after_ns < end_ns else end_ns) - (began_ns if began_ns > 0 else 0)
            if carries_ns > most:
                word, most = fed, carries_ns
            if gates:
                fed, began_ns = gates, after_ns
        self.word, self.began_ns = fed, began_ns - next_ns
        return word
