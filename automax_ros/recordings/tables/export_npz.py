"""Recordings as NumPy files (.npz): one array per column, the same rows as the CSV table."""

from __future__ import annotations

from array import array
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from automax_ros.core.safe_file import open_at_once
from automax_ros.core.ticks import NS_PER_S
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.recordings.read.common_log import Cell
from automax_ros.recordings.tables.export import TIME, Column, Table, whole_output

MAX_BYTES = 256 << 20
"""Most bytes of all columns of an .npz export (decision): they are collected in memory."""
_CHECK_MASK = 0xFFF
_DTYPES = {"b": np.bool_, "i": np.int32, "q": np.int64, "d": np.float64}


def write_npz(bag: Path, table: Table, output: Path) -> int:
    """Write a table to a NumPy file; return the number of its rows. ``bag`` is named in errors.

    ``time_s`` is float64; integers are int32, REALs float64, booleans bool; the number of a scan is int64. A column
    with unknown cells is float64, with NaN for those. ``names`` are the headings, ``units`` their units.

    Raises:
        BagError: a column holds texts, the columns take more than ``MAX_BYTES``, the recording is damaged, or the
            output cannot be written.
    """
    texts = [item.label for item in table.columns if not item.typecode]
    if texts:
        hint = "leave it out, or export to a .csv file"
        raise BagError("AMX6828", bag, f"{texts[0]} holds texts, and a NumPy file numbers", hint)
    times = array("d")
    columns = [_Numbers(item, bag) for item in table.columns]
    for time, changed in table.rows():
        for index, value in changed.items():
            columns[index].hold(value)
        times.append(time / NS_PER_S)
        for numbers in columns:
            numbers.append()
        if not len(times) & _CHECK_MASK:
            _check_size(bag, times, columns)
    _check_size(bag, times, columns)
    arrays: dict[str, npt.NDArray[Any]] = {TIME: np.frombuffer(times, np.float64) if times else np.zeros(0)}
    arrays.update((item.label, numbers.finished()) for item, numbers in zip(table.columns, columns, strict=True))
    arrays["names"] = np.array([TIME, *(item.label for item in table.columns)])
    arrays["units"] = np.array(["s", *(item.unit for item in table.columns)])
    with whole_output(output) as place, open(place, "wb", opener=open_at_once) as file:
        np.savez_compressed(file, **arrays)  # type: ignore[arg-type]  # none is named allow_pickle
    return len(times)


class _Numbers:
    """Collects the values of one column."""

    def __init__(self, column: Column, bag: Path) -> None:
        self._column = column
        self._bag = bag
        self._whole = column.typecode != "d"
        self._numbers: array[Any] = array(column.typecode)
        self._unknown = array("Q")
        self._held: float | None = None

    @property
    def bytes(self) -> int:
        return self._numbers.itemsize * len(self._numbers) + self._unknown.itemsize * len(self._unknown)

    def hold(self, value: Cell | None) -> None:
        """Set the value that holds from this row on."""
        if value is None:
            self._held = None
            return
        assert not isinstance(value, str)
        try:
            self._held = int(value) if self._whole else value
            array(self._column.typecode, (self._held,))
        except (ValueError, OverflowError):
            raise BagError("AMX6813", self._bag, f"{self._column.label} holds {value!r}, which it cannot") from None

    def append(self) -> None:
        """Add a row."""
        if self._held is None:
            self._unknown.append(len(self._numbers))
            self._numbers.append(0)
        else:
            self._numbers.append(self._held)

    def finished(self) -> npt.NDArray[Any]:
        """Return the whole column."""
        if not self._numbers:
            return np.zeros(0, _DTYPES[self._column.typecode])
        stored = np.frombuffer(self._numbers, np.dtype(self._column.typecode))
        if self._unknown:
            numbers = stored.astype(np.float64)
            numbers[np.frombuffer(self._unknown, np.uint64).astype(np.int64)] = np.nan
            return numbers
        return stored.astype(_DTYPES[self._column.typecode], copy=False)


def _check_size(bag: Path, times: array[float], columns: list[_Numbers]) -> None:
    size = times.itemsize * len(times) + sum(item.bytes for item in columns)
    if size > MAX_BYTES:
        hint = "export fewer variables, a part of the run, or fewer rows by --every; or export to a .csv file"
        raise BagError("AMX6826", bag, f"makes a NumPy file of more than {MAX_BYTES >> 20} MiB", hint)
