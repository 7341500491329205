"""Locals and block states of tasks as columns, against the states as another reader sees them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from automax_ros.messages.types.messages import TaskState
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.recordings.tables.export import CommonTable, write_csv
from automax_ros.recordings.tables.series import Window
from automax_ros.recordings.tables.traces import traces
from recordings.independent import GOLDEN, decoded, nanoseconds
from recordings.recordings import MS, TABLE, image_of, record, write_of

FIELDS = ("RATIO%", "GAIN", "RUN@", "TABLE%", "NOTE$", "1030 LAG.x")
SIZES = (1, 1, 1, 6, 1, 1)


def state(ms: int, values: tuple[float, ...], **changes: Any) -> tuple[str, TaskState]:
    task = TaskState(ms * MS, 1, "SPEED", ms, "a", "b", FIELDS, SIZES, values, ("text",))
    return "/a/states", task._replace(**changes)


LOG = [
    ("/a/variables", TABLE),
    ("/a/backplane/snapshot", image_of(0, 0, {(0, 0): 0})),
    state(0, (1, 0.5, 0, *range(6), 0, 2.25)),
    ("/a/backplane", write_of(1, 5 * MS, {(0, 0): 7})),
    state(5, (2, 0.5, 1, *range(10, 16), 0, -1)),
    state(5, (9, 9, 9), task="OTHER", field=("RATIO%",), size=(3,)),
    state(6, (2, 0.5, 1, *range(10, 16), 0, -1)),
]


def exported(
    folder: Path, watch: list[str], log: list[tuple[str, Any]] = LOG, window: Window | None = None
) -> list[str]:
    write_csv(CommonTable(record(folder / "bag", log), watch, window or Window()), folder / "out.csv")
    return (folder / "out.csv").read_text().splitlines()


def test_locals_stand_beside_commons(tmp_path: Path) -> None:
    watch = ["speed.ratio%", "REF%", "SPEED.TABLE%(4)", "SPEED.1030  LAG.x", "SPEED.RUN@", "SPEED.RATIO%", "SPEED.GAIN"]
    assert exported(tmp_path, watch) == [
        "time_s,SPEED.RATIO%,REF%,SPEED.TABLE%(4),SPEED.1030 LAG.X,SPEED.RUN@,SPEED.GAIN",
        "0,1,0,4,2.25,0,0.5",
        "0.005,2,7,14,-1.0,1,0.5",
    ]


def test_another_layout_moves_the_places(tmp_path: Path) -> None:
    moved = state(9, (5, 3), layout_hash="c", field=("GAIN", "RATIO%"), size=(1, 1))
    lines = exported(tmp_path, ["SPEED.RATIO%"], [*LOG, moved])
    assert lines == ["time_s,SPEED.RATIO%", "0,1", "0.005,2", "0.009,3"]


def test_states_of_the_example() -> None:
    name, expected = "1120 LAG.y1", []
    for message in decoded(GOLDEN / "scans_0.mcap", "/pm1/states"):
        if message.task == "SPEED":
            place = sum(message.size[: list(message.field).index(name)])
            value = (nanoseconds(message.stamp) / 1e9, message.value[place])
            if not expected or expected[-1][1] != value[1]:
                expected.append(value)
    (line,) = traces(GOLDEN, [f"SPEED.{name}"]).lines
    assert list(zip(line.times.tolist(), line.values.tolist(), strict=True)) == expected
    assert len(expected) == 2


@pytest.mark.parametrize(
    ("name", "code", "hint"),
    [
        ("SPEED.RATO%", "AMX6821", "did you mean SPEED.RATIO%?"),
        ("SPEED.RATIO", "AMX6821", "SPEED.RATIO%"),
        ("SPEED.QQQ", "AMX6821", "it has RATIO%, GAIN"),
        ("SPEED.TABLE%(6)", "AMX6821", "the largest is 5"),
        ("SPEED.", "AMX6821", "write TASK.NAME"),
        ("SPEED.NOTE$", "AMX6828", "leave it out"),
        ("LINE.RATIO%", "AMX6827", "it holds those of SPEED"),
    ],
)
def test_unknown_names_are_explained(tmp_path: Path, name: str, code: str, hint: str) -> None:
    with pytest.raises(BagError) as caught:
        exported(tmp_path, ["SPEED.GAIN", name])
    assert caught.value.code == code
    assert hint in caught.value.hint


@pytest.mark.parametrize("window", [Window(), Window(0, 3 * MS), Window(2 * MS)])
def test_a_task_without_states_is_told_in_every_window(tmp_path: Path, window: Window) -> None:
    with pytest.raises(BagError, match="AMX6827"):
        exported(tmp_path, ["REF%", "LINE.RATIO%"], window=window)


def test_states_that_do_not_fit_together(tmp_path: Path) -> None:
    with pytest.raises(BagError, match="AMX6813"):
        exported(tmp_path, ["SPEED.GAIN"], [*LOG, state(9, (5,))])
