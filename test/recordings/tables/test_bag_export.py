"""Common memory as CSV, from write logs made by hand."""

from __future__ import annotations

import tracemalloc
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from automax_ros.core.numbers import stored_real
from automax_ros.core.ticks import seconds_text
from automax_ros.core.types import DataType
from automax_ros.messages.types.messages import Int16, Values, Variable, VariableTable
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.recordings.tables.export import CommonTable, write_csv
from recordings.recordings import MS, TABLE, image_of, record, sample_recording, write_of

VARIABLES = "/line1/variables"
BACKPLANE = "/line1/backplane"
SNAPSHOT = "/line1/backplane/snapshot"

REF, COUNT, GAIN, RUN, NOTE, REEL = (0, 0), (1, 0), (2, 0), (3, 0), (4, 0), (6, 0)
START = image_of(0, 0, {REF: 0, COUNT: 0, GAIN: 0, RUN: 0, NOTE: 0, **{(5, i): 0 for i in range(6)}, REEL: 0}, ("", ""))


def exported(tmp_path: Path, messages: list[tuple[str, Any]], watch: list[str] | None = None) -> list[str]:
    tmp_path.mkdir(exist_ok=True)
    bag = record(tmp_path / "bag", messages, custom_data={"version": "0.1.0"})
    rows = write_csv(CommonTable(bag, watch), tmp_path / "out.csv")
    lines = (tmp_path / "out.csv").read_text().splitlines()
    assert len(lines) == rows + 1
    return lines


LOG = [
    (VARIABLES, TABLE),
    (SNAPSHOT, START),
    (BACKPLANE, write_of(1, 5 * MS, {REF: -100, RUN: 1})),
    (BACKPLANE, write_of(2, 5 * MS + 500_000, {(5, 3): 7})),
    (BACKPLANE, write_of(3, 10 * MS, {COUNT: 70000})),
    (BACKPLANE, write_of(4, 10 * MS, {GAIN: stored_real(0.1)[0]})),
    (BACKPLANE, write_of(5, 15 * MS, {REF: -100})),
    (BACKPLANE, write_of(6, 20 * MS, {RUN: 0, NOTE: 0, REF: 5, REEL: 0}, ("a,b", "R7"))),
]


def test_a_row_for_each_instant_with_a_change_and_values_held(tmp_path: Path) -> None:
    assert exported(tmp_path, LOG) == [
        "time_s,REF%,COUNT!,GAIN,RUN@",
        "0,0,0,0.0,0",
        "0.005,-100,0,0.0,1",
        "0.01,-100,70000,0.1,1",
        "0.02,5,70000,0.1,0",
    ]


def test_watched_variables_in_the_order_asked_for(tmp_path: Path) -> None:
    assert exported(tmp_path, LOG, ["reel$", "TABLE%(1,0)", " REF% ", "TABLE%[0,2]", "NOTE$", "REF%"]) == [
        'time_s,REEL$,"TABLE%(1,0)",REF%,"TABLE%(0,2)",NOTE$',
        "0,,0,0,0,",
        "0.005,,0,-100,0,",
        "0.0055,,7,-100,0,",
        '0.02,R7,7,5,0,"a,b"',
    ]


def test_writes_and_restores_within_one_instant_are_no_change(tmp_path: Path) -> None:
    log = [*LOG[:3], (BACKPLANE, write_of(2, 7 * MS, {REF: 3})), (BACKPLANE, write_of(3, 7 * MS, {REF: -100}))]
    assert exported(tmp_path, log, ["REF%"]) == ["time_s,REF%", "0,0", "0.005,-100"]


def test_cells_are_empty_until_the_value_is_known(tmp_path: Path) -> None:
    log = [LOG[0], LOG[2], LOG[3], LOG[4]]
    assert exported(tmp_path, log) == ["time_s,REF%,COUNT!,GAIN,RUN@", "0.005,-100,,,1", "0.01,-100,70000,,1"]


def test_later_images_count_and_older_messages_do_not(tmp_path: Path) -> None:
    log = [
        *LOG[:3],
        (SNAPSHOT, image_of(9, 30 * MS, {REF: 9})),
        (BACKPLANE, write_of(8, 29 * MS, {REF: 8})),
        (SNAPSHOT, image_of(7, 28 * MS, {REF: 7})),
        (BACKPLANE, write_of(10, 31 * MS, {REF: 10})),
        (BACKPLANE, write_of(11, 32 * MS, {REF: 11})._replace(run_id=1)),
        ("/line1/common/REF", Int16(99)),
    ]
    assert exported(tmp_path, log, ["REF%"]) == ["time_s,REF%", "0,0", "0.005,-100", "0.03,9", "0.031,10"]


def test_a_whole_recording(tmp_path: Path) -> None:
    write_csv(CommonTable(sample_recording(tmp_path / "bag", seconds=1), ["REF%", "RUN@"]), tmp_path / "out.csv")
    lines = (tmp_path / "out.csv").read_text().splitlines()
    # the first write repeats the zeros of the image
    expected = [f"{seconds_text((index + 1) * 5_500_000)},{index},{index % 2}" for index in range(1, 181)]
    assert lines == ["time_s,REF%,RUN@", "0,0,0", *expected]


@settings(deadline=None, derandomize=True)
@given(st.integers(0, 2**62))
def test_seconds_are_exact(time: int) -> None:
    whole, _, fraction = seconds_text(time).partition(".")
    assert int(whole) * 10**9 + int(fraction.ljust(9, "0") or 0) == time
    assert not fraction.endswith("0")


def test_reals_come_back_as_they_were(tmp_path: Path) -> None:
    numbers = [stored_real(value)[0] for value in (1 / 3, -2.5, 9.2e18, 5.5e-20, 1e10, 123456.789, 16777217.0)]
    log = [LOG[0], *((BACKPLANE, write_of(i + 1, i * MS, {GAIN: value})) for i, value in enumerate(numbers))]
    cells = [line.split(",")[1] for line in exported(tmp_path, log, ["GAIN"])[1:]]
    assert [stored_real(float(cell))[0] for cell in cells] == numbers
    assert cells[0] == "0.33333334"
    assert all(len(cell) <= 15 for cell in cells)


def test_numbers_that_no_rack_writes_do_no_harm(tmp_path: Path) -> None:
    odd = [float("nan"), float("inf"), 1e300, -0.0]
    log = [LOG[0], *((BACKPLANE, write_of(i + 1, i * MS, {GAIN: v, REF: v, RUN: v})) for i, v in enumerate(odd))]
    assert len(exported(tmp_path, log)) == 1 + len(odd)


@pytest.mark.parametrize(
    ("name", "message", "hint"),
    [
        ("REFF%", "no common variable 'REFF%'", "did you mean REF%"),
        ("REF", "no common variable 'REF'", "did you mean REF%"),
        ("run", "no common variable 'run'", "RUN@"),
        ("XYZZY", "no common variable 'XYZZY'", "it has REF%, COUNT!, GAIN"),
        ("", "no common variable ''", "it has REF%"),
        ("TABLE%", "TABLE% is an array", "name one element; the last is TABLE%(1,"),
        ("TABLE%(1)", "TABLE% has 2 subscripts, not 1", "name one element; the last is TABLE%(1,"),
        ("TABLE%(2,0)", "subscript 2 of TABLE%(2,0) is out of range", "the largest is 1"),
        ("REF%(0)", "REF% is not an array", "write REF%"),
        ("TABLE%(1,", "no common variable", "TABLE%"),
    ],
)
def test_an_unknown_name_is_explained(tmp_path: Path, name: str, message: str, hint: str) -> None:
    with pytest.raises(BagError) as caught:
        exported(tmp_path, LOG, ["GAIN", name])
    assert caught.value.code == "AMX6821"
    assert message in caught.value.message
    assert hint in caught.value.hint
    assert not (tmp_path / "out.csv").exists()


def failure(tmp_path: Path, log: list[tuple[str, Any]]) -> str:
    with pytest.raises(BagError) as caught:
        exported(tmp_path, log)
    return f"{caught.value.code} {caught.value.message}"


def test_recordings_without_common_memory(tmp_path: Path) -> None:
    assert failure(tmp_path, [("/a", Int16(1))]).startswith("AMX6820 has no common memory")


def test_values_without_a_table(tmp_path: Path) -> None:
    assert failure(tmp_path, LOG[1:]).startswith("AMX6820 has no common memory")


def test_the_table_may_stand_anywhere(tmp_path: Path) -> None:
    assert exported(tmp_path / "a", [*LOG[1:3], LOG[0], *LOG[3:]]) == exported(tmp_path / "b", LOG)


def test_a_gap_in_the_write_log(tmp_path: Path) -> None:
    assert failure(tmp_path, [*LOG[:3], LOG[5]]) == "AMX6823 writes 2 to 3 are missing before 0.01 s"


@pytest.mark.parametrize(
    ("other", "told"),
    [
        (TABLE._replace(run_id=1, stamp=2_500_000_000), "LINE1 (run 1, its table at 2.5 s)"),
        (TABLE._replace(rack="LINE2"), "LINE2 (run 77, its table at 0 s)"),
    ],
)
def test_two_runs_in_one_recording(tmp_path: Path, other: VariableTable, told: str) -> None:
    found = failure(tmp_path, [LOG[0], LOG[0], (VARIABLES, other)])
    assert found == f"AMX6822 holds more than one run: of LINE1 (run 77, its table at 0 s) and of {told}"


@pytest.mark.parametrize(
    "values", [Values((0,), (), (1.0,)), Values((0, 1), (0, 0), (1.0,)), Values((4,), (0,), (0.0,), ())]
)
def test_values_that_do_not_fit_together(tmp_path: Path, values: Values) -> None:
    log = [LOG[0], (BACKPLANE, write_of(1, MS, {})._replace(values=values))]
    assert failure(tmp_path, log).startswith("AMX6813 wrong values at 0.001 s")


@pytest.mark.parametrize(
    "variable",
    [
        Variable(9, "=CMD()", DataType.INTEGER.number),
        Variable(9, "REF%", DataType.INTEGER.number),
        Variable(0, "NEW%", DataType.INTEGER.number),
        Variable(9, "NEW%", 6),
    ],
)
def test_a_table_that_no_rack_writes(tmp_path: Path, variable: Variable) -> None:
    table = TABLE._replace(variables=(*TABLE.variables, variable))
    assert failure(tmp_path, [(VARIABLES, table)]).startswith("AMX6813 the table of variables is wrong")


def test_an_output_that_cannot_be_written(tmp_path: Path) -> None:
    bag = record(tmp_path / "bag", LOG)
    with pytest.raises(BagError, match="AMX6824"):
        write_csv(CommonTable(bag), tmp_path)


def test_memory_does_not_grow_with_the_recording(tmp_path: Path) -> None:
    peaks = []
    for name, seconds in (("warm", 1), ("short", 4), ("long", 16)):
        bag = sample_recording(tmp_path / name, seconds=seconds)
        tracemalloc.start()
        write_csv(CommonTable(bag), tmp_path / "out.csv")
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[2] < 1.2 * peaks[1]


def test_time_counts_from_the_start_of_a_run_on_the_wall_clock(tmp_path: Path) -> None:
    noon = 1_795_268_062 * 10**9
    later = [
        (VARIABLES, TABLE._replace(stamp=noon)),
        (SNAPSHOT, START._replace(stamp=noon)),
        (BACKPLANE, write_of(1, noon + 5 * MS, {REF: 7})),
    ]
    assert exported(tmp_path, later, ["REF%"]) == ["time_s,REF%", "0,0", "0.005,7"]
