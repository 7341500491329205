"""Recordings with given courses, as a rack would have written them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from recordings.recordings import RUN, image_of, record, write_of

from automax_ros.comparison.courses import Course
from automax_ros.core.kinds import WriterKind
from automax_ros.core.types import DataType
from automax_ros.messages.types.messages import PlantState, RollState, Variable, VariableTable, WebState, Writer
from automax_ros.recordings.read.common_log import Watched

S = 1_000_000_000
KINDS = {"%": DataType.INTEGER, "!": DataType.DOUBLE, "@": DataType.BOOLEAN, "$": DataType.STRING}
Steps = Iterable[tuple[float, float]]


def recording(
    folder: Path,
    courses: Mapping[str, Steps],
    *,
    rack: str = "PM1",
    until_s: float | None = None,
    plants: Mapping[str, Steps] | None = None,
    webs: Mapping[str, Steps] | None = None,
    units: Mapping[str, str] | None = None,
) -> Path:
    """Record commons: for each of its name the (s, value) that are written; of plants their speed in rpm.

    Of webs it records the tension in N, and 100 times as long a web has gone over the roller of plant P.
    """
    kinds = {name: KINDS.get(name[-1], DataType.REAL) for name in courses}
    variables = tuple(
        Variable(index, name, kind.number, unit=(units or {}).get(name, ""), length=31)
        for index, (name, kind) in enumerate(kinds.items())
    )
    log: list[tuple[str, Any]] = [
        ("/pm1/variables", VariableTable(0, rack, RUN, variables, (Writer(1, "SPEED", WriterKind.TASK, 1),))),
        ("/pm1/backplane/snapshot", image_of(0, 0, {})),
    ]
    writes = sorted(
        (round(time_s * S), index, value)
        for index, steps in enumerate(courses.values())
        for time_s, value in steps
        if kinds[list(courses)[index]] is not DataType.STRING
    )
    timed: list[tuple[int, str, Any]] = [
        (time_ns, "/pm1/backplane", write_of(number, time_ns, {(index, 0): value}))
        for number, (time_ns, index, value) in enumerate(writes, 1)
    ]
    for plant, steps in (plants or {}).items():
        timed += [(round(time_s * S), f"/pm1/plants/{plant}", plant_state(plant, time_s, rpm)) for time_s, rpm in steps]
    for web, steps in (webs or {}).items():
        for time_s, tension_n in steps:
            at = round(time_s * S)
            timed.append((at, f"/pm1/webs/{web}", WebState(at, web, "P", "Q", tension_n, 0.1, 0.0, 0.0, 0.0, False)))
            timed.append((at, "/pm1/rolls/P", RollState(at, "P", 1.0, 197.0, 0.5, 100 * tension_n, 3.0)))
    if until_s is not None:
        timed.append((round(until_s * S), "/pm1/backplane", write_of(len(writes) + 1, round(until_s * S), {})))
    log += [(topic, message) for _, topic, message in sorted(timed, key=lambda item: item[0])]
    return record(folder, log)


def plant_state(plant: str, time_s: float, rpm: float) -> PlantState:
    zeros = dict.fromkeys(PlantState._fields, 0.0)
    given = {"stamp": round(time_s * S), "plant": plant, "slot": 3, "drive": "", "speed_rpm": rpm, "bridge": 0}
    return PlantState(**{**zeros, **given, "contactor": True, "faults": ()})


def course(steps: Steps, name: str = "X", kind: DataType = DataType.REAL) -> Course:
    """A course of (s, value)."""
    times, values = zip(*steps, strict=True)
    at = np.array([round(time_s * S) for time_s in times], np.int64)
    return Course(Watched(name, 0, 0, kind), at, np.array(values, np.float64))


def sampled(values: np.ndarray, step_s: float, start_s: float = 0.0) -> Course:
    """A course of samples on a grid."""
    times = (np.arange(len(values)) * round(step_s * S) + round(start_s * S)).astype(np.int64)
    return Course(Watched("Y", 0, 0, DataType.REAL), times, np.asarray(values, np.float64))
