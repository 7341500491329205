"""What the counts of a recorded rack's commons mean: the scales of the rack file that the recording holds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from math import isfinite
from pathlib import Path

import numpy as np
import numpy.typing as npt

from automax_ros.core.types import DataType
from automax_ros.rackfile.reading.scale import Scale
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.recordings.read.reader import BagReader
from automax_ros.recordings.tables.traces import Line, Traces
from automax_ros.replay.scans.stored_rack import SourceRefused, stored_rack


def recorded_scales(bag: Path) -> dict[str, Scale]:
    """Return the scales of a recording's commons by their names.

    There are none where it holds no rack file, or one with errors: values are then shown as memory held them
    (decision).
    """
    try:
        variables = stored_rack(BagReader(bag)).config.variables
    except (BagError, SourceRefused):
        return {}
    return {variable.name: variable.scale for variable in variables if variable.scale is not None}


def values_in_unit(counts: npt.NDArray[np.float64], scale: Scale) -> npt.NDArray[np.float64]:
    """Return the values of counts by a scale, in its unit; what is not finite stays."""
    known, places = np.unique(counts, return_inverse=True)
    values = [scale.value_of(int(count)) if isfinite(count) else count for count in known.tolist()]
    return np.array(values, np.float64)[places]


def traces_in_units(shown: Traces, scales: Mapping[str, Scale]) -> Traces:
    """Return traces with each line that has a scale in its unit, as REAL."""
    return replace(shown, lines=tuple(_in_unit(line, scales.get(line.variable.label)) for line in shown.lines))


def _in_unit(line: Line, scale: Scale | None) -> Line:
    if scale is None:
        return line
    return replace(line, variable=replace(line.variable, kind=DataType.REAL), values=values_in_unit(line.values, scale))
