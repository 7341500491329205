"""The rows of a sweep as files: CSV for spreadsheets, NumPy for programs. Same rows, same bytes."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, TextIO
from zipfile import ZIP_DEFLATED, ZipFile, ZipInfo

import numpy as np
import numpy.typing as npt

from automax_ros.core.safe_file import atomic_write, open_at_once
from automax_ros.sweep.run import Plan, Row

RUN, FAULT, REPEAT = "run", "fault", "repeat"
_EPOCH = (1980, 1, 1, 0, 0, 0)
"""The earliest time that a zip file can hold: no file depends on when it was written."""


def headings(plan: Plan) -> list[str]:
    """Return the names of the columns: run, quantities, measures, fault."""
    quantities = [item.label for item in plan.quantities]
    return [RUN, *quantities, *(item.label for item in plan.measures), FAULT]


def write_csv(plan: Plan, rows: Sequence[Row], repeat: Callable[[Row], str], stream: TextIO) -> None:
    """Write one row per run; a cell is empty if the run does not have the measure. ``repeat`` is the last column."""
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow([*headings(plan), REPEAT])
    for row in rows:
        writer.writerow([*_cells(plan, row), repeat(row)])


def write_npz(plan: Plan, rows: Sequence[Row], path: Path) -> None:
    """Write a NumPy file: an array for each column under its heading; measures are float64, NaN if the run has none.

    ``names`` are the headings of the quantities, ``measures`` those of the measures.

    Raises:
        OSError: it cannot be written.
    """
    columns: dict[str, npt.NDArray[Any]] = {RUN: np.array([row.number for row in rows], np.int64)}
    for index, quantity in enumerate(plan.quantities):
        columns[quantity.label] = np.array([row.point[index] for row in rows])
    for index, measure in enumerate(plan.measures):
        values = [row.outcome.measures[index] for row in rows]
        columns[measure.label] = np.array([math.nan if value is None else value for value in values], np.float64)
    columns[FAULT] = np.array([row.outcome.fault for row in rows], np.str_)
    columns["names"] = np.array([item.label for item in plan.quantities], np.str_)
    columns["measures"] = np.array([item.label for item in plan.measures], np.str_)
    with (
        atomic_write(path) as place,
        open(place, "wb", opener=open_at_once) as file,
        ZipFile(file, "w") as archive,
    ):
        for name, column in columns.items():
            data = io.BytesIO()
            np.lib.format.write_array(data, column, allow_pickle=False)
            archive.writestr(ZipInfo(f"{name}.npy", _EPOCH), data.getvalue(), ZIP_DEFLATED)


def records(plan: Plan, rows: Sequence[Row], repeat: Callable[[Row], str]) -> list[dict[str, Any]]:
    """Return the rows as data for JSON, with null if the run does not have a measure."""
    return [
        {
            RUN: row.number,
            "values": dict(zip((item.label for item in plan.quantities), row.point, strict=True)),
            "measures": dict(zip((item.label for item in plan.measures), row.outcome.measures, strict=True)),
            FAULT: row.outcome.fault or None,
            REPEAT: repeat(row),
        }
        for row in rows
    ]


def _cells(plan: Plan, row: Row) -> Iterator[str]:
    yield str(row.number)
    yield from (quantity.text(value) for quantity, value in zip(plan.quantities, row.point, strict=True))
    yield from ("" if value is None else repr(value) for value in row.outcome.measures)
    yield row.outcome.fault
