"""What scans by columns are given and what they give."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Whole = npt.NDArray[np.int64]
Real = npt.NDArray[np.float64]
Column = npt.NDArray[np.int64] | npt.NDArray[np.float64]


@dataclass(frozen=True)
class BesideLatch:
    """What scans read and wrote in actual memory: scan k has the rows ``offsets[k]`` to ``offsets[k + 1]``.

    Values are doubles, which hold integers of 32 bits and REALs exactly. Without ``write_offsets`` what scans write is
    not compared.
    """

    read_offsets: Whole
    read_views: Whole
    read_elements: Whole
    read_values: Real
    write_offsets: Whole | None = None
    write_views: Whole | None = None
    write_elements: Whole | None = None
    write_values: Real | None = None


@dataclass(frozen=True)
class Written:
    """What scans wrote in actual memory, in order, a row for each write."""

    scans: Whole
    views: Whole
    elements: Whole
    values: Real


@dataclass(frozen=True)
class Executed:
    """What scans by columns came to.

    Attributes:
        done: scans executed whole. Where that is less than was asked for, the next one stopped, was too long, or did
            something else than was recorded; the state is that before it.
        outputs: for each of ``CompiledTask.written`` its values at END of each scan that was done.
        errors: a row for each logged error, in order: scan, line, code.
        written: what the scans wrote in actual memory.
    """

    done: int
    outputs: list[Column]
    errors: Whole
    written: Written
