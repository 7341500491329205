"""The verb `table` against numpy and a model that holds rows, and everything that a table can have wrong."""

import os
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rack.helpers import rack_from
from rack.test_playing import MS, Log

from automax_ros.core.numbers import stored_real
from automax_ros.core.types import DataType
from automax_ros.rack.rack import Rack
from automax_ros.scenario.stimuli import table as verb
from automax_ros.scenario.stimuli.reader import read_for_rack
from automax_ros.scenario.stimuli.waves import Course
from scenario.stimuli.helpers import RACK, SPEED, playing, rack_in, read

PROPERTY = settings(deadline=None, derandomize=True, database=None, max_examples=200)
ENTRY = "- {{at: 0.001, table: {{file: shift.csv, columns: {{{columns}}}{more}}}}}\n"
SCALED = RACK.replace(
    "  REF%: {}\n", "  REF%: {ros: in, scale: {counts: [0, 4095], value: [0.0, 10.0]}}\n  PLAIN%: {unit: fpm}\n"
)


def entry(columns: str, more: str = "") -> str:
    return ENTRY.format(columns=columns, more=f", {more}" if more else "")


def played(folder: Path, csv: str, text: str, seconds: float, rack_text: str = RACK) -> tuple[Rack, Log]:
    rack = rack_in(folder, rack_text)
    (folder / "shift.csv").write_text(csv, encoding="utf-8")
    log = Log(rack)
    stimulation = playing(rack, folder, text)
    rack.run(seconds)
    assert stimulation.refused == 0
    return rack, log


def test_rows_hold_and_are_written_at_their_time_to_the_nanosecond(tmp_path):
    csv = "time_s,a,b,n\n100,5,1,hello\n100.0000005,6,,\n100.002,6,0,\n100.003,7,,bye\n"
    rack, log = played(tmp_path, csv, entry("REF%: a, RUN@: b, NOTE$: n"), 0.01)
    assert log.of("REF%") == [(MS, 5), (MS + 500, 6), (4 * MS, 7)]
    assert log.of("RUN@") == [(MS, True), (3 * MS, False)]
    assert log.of("NOTE$") == [(MS, "hello"), (4 * MS, "bye")]
    assert rack.value("REF%") == 7, "the last row stays"


def test_of_rows_of_one_time_the_last_counts(tmp_path):
    _, log = played(tmp_path, "time_s,a\n0,1\n0,2\n0.001,3\n0.001,4\n", entry("REF%: a"), 0.01)
    assert log.of("REF%") == [(MS, 2), (2 * MS, 4)]


def test_a_column_that_begins_late_leaves_its_variable_until_then(tmp_path):
    csv = "time_s,a,b\n0,,1\n0.002,7,\n0.004,9,3\n"
    _, log = played(tmp_path, csv, "- {at: 0, set: {REF%: -5}}\n" + entry("REF%: a", "hold: linear"), 0.01)
    assert log.of("REF%") == [(0, -5), (3 * MS, 7), (4 * MS, 8), (5 * MS, 9)]


def test_numbers_go_in_lines_and_booleans_hold(tmp_path):
    csv = "time_s;a;b;g\n0;0;1;0,5\n0,010;100;0;1,5\n"
    rack, log = played(tmp_path, csv, entry("REF%: a, RUN@: b, GAIN: g", "hold: linear"), 0.02)
    assert log.of("REF%") == [(MS + number * MS, 10 * number) for number in range(1, 11)]
    assert log.of("RUN@") == [(MS, True), (11 * MS, False)]
    assert [value for _, value in log.of("GAIN")] == [stored_real(0.5 + number / 10)[0] for number in range(11)]
    assert rack.value("GAIN") == 1.5


POINTS = st.lists(st.tuples(st.integers(1, 10**12), st.integers(-30000, 30000)), min_size=1, max_size=8)


@given(points=POINTS, data=st.data())
@PROPERTY
def test_a_course_is_that_of_numpy(points, data):
    times = np.cumsum([0, *(step for step, _ in points[1:])]).tolist()
    values = [value for _, value in points]
    elapsed = data.draw(st.integers(0, times[-1] + 10))
    wanted = np.interp(elapsed, times, values)
    whole = Course(DataType.INTEGER, times, values).value(elapsed, 0)
    assert abs(whole - wanted) <= 0.5 + 1e-9 * max(map(abs, values), default=0)
    real = Course(DataType.REAL, times, [float(value) for value in values]).value(elapsed, 0.0)
    assert real == pytest.approx(wanted, rel=1e-6, abs=1e-2)


@given(steps=st.lists(st.tuples(st.integers(0, 5000), st.integers(-9, 9)), min_size=1, max_size=12))
@settings(deadline=None, derandomize=True, database=None, max_examples=25)
def test_what_is_held_at_any_scan_is_the_last_row_before_it(tmp_path_factory, steps):
    """A model of its own: for each ms the last row whose time has come; SPEED latches at each ms."""
    folder = tmp_path_factory.mktemp("held")
    at_us = np.cumsum([0, *(step for step, _ in steps[1:])]).tolist()
    csv = "time_s,a\n" + "".join(f"{time / 1e6:.6f},{value}\n" for time, (_, value) in zip(at_us, steps, strict=True))
    _, log = played(folder, csv, entry("REF%: a"), 0.02)
    assert len(log.latched) > 15
    for time_ns, latched in log.latched[1:]:
        due = [value for time, (_, value) in zip(at_us, steps, strict=True) if time * 1000 + MS <= time_ns]
        assert latched[0] == (due[-1] if due else 0)


def test_means_are_rounded_to_the_nearest(tmp_path):
    _, log = played(tmp_path, "time_s,a\n0,1.4\n0.001,2.5\n0.002,-2.6\n", entry("REF%: a"), 0.01)
    assert [value for _, value in log.of("REF%")] == [1, 3, -3]


def test_values_in_the_engineers_unit_become_counts_by_the_scale(tmp_path):
    """4095 counts are 10.0: 5.0 is 2047.5, the nearest count 2048; beyond the scale an instrument shows its end."""
    csv = "t,a,b\n0,5.0,5.0\n0.001,10.2,6.0\n0.002,-1,7.0\n"
    text = entry("REF%: a, PLAIN%: b", "time: t, values: unit")
    _, log = played(tmp_path, csv, text, 0.01, SCALED)
    assert [value for _, value in log.of("REF%")] == [2048, 4095, 0]
    assert [value for _, value in log.of("PLAIN%")] == [5, 6, 7], "without a scale counts are the unit"
    _, log = played(tmp_path, csv, text.replace("unit", "counts"), 0.01, SCALED)
    assert [value for _, value in log.of("REF%")] == [5, 10, -1]


def test_what_comes_later_ends_a_column(tmp_path):
    csv = "time_s,a,b\n0,1,1\n0.002,2,2\n0.004,3,3\n"
    text = entry("REF%: a, SUM!: b") + "- {at: 0.004, set: {REF%: 50}}\n"
    _, log = played(tmp_path, csv, text, 0.01)
    assert [value for _, value in log.of("REF%")] == [1, 2, 50]
    rack = rack_in(tmp_path)
    stimulation = playing(rack, tmp_path, text)
    rack.run(0.0045)
    assert not stimulation.is_over, "SUM! still has a row to come"
    rack.run(0.001)
    assert stimulation.is_over


def test_a_force_holds_against_a_table(tmp_path):
    text = "- {at: 0, force: {REF%: 99}}\n" + entry("REF%: a")
    rack, log = played(tmp_path, "time_s,a\n0,1\n0.002,2\n", text, 0.01)
    assert rack.value("REF%") == 99
    assert log.of("REF%") in ([], [(0, 99)])


def test_the_same_table_gives_the_same_writes(tmp_path):
    rng = np.random.default_rng(7)
    csv = "time_s,a,b\n" + "".join(f"{n * 0.0013:.4f},{rng.integers(-99, 99)},{n % 2}\n" for n in range(40))
    first, second = (played(tmp_path, csv, entry("REF%: a, RUN@: b", "hold: linear"), 0.06)[1].writes for _ in "ab")
    assert first == second
    assert len(first) > 60


def faults(rack: Rack, folder: Path, text: str) -> list[str]:
    found = read(rack, folder, text).diagnostics
    return [f"{item.code} {item.span.line}:{item.span.column} {item.message}" for item in found]


@pytest.mark.parametrize(
    ("csv", "columns", "message"),
    [
        ("time_s,a\n0,1\n1,x\n", "REF%: a", ":3: column 'a': 'x' cannot be used: REF% takes a number from -32768 to"),
        ("time_s,a\n0,32768\n", "REF%: a", ":2: column 'a': '32768' cannot be used"),
        ("time_s,a\n0,nan\n", "GAIN: a", ":2: column 'a': 'nan' cannot be used: GAIN takes a number"),
        ("time_s,a\n0,2\n", "RUN@: a", ":2: column 'a': '2' cannot be used: RUN@ takes 0 or 1, FALSE or TRUE"),
        ("time_s,a\n0,far too long\n", "NOTE$: a", ":2: column 'a': 'far too long' cannot be used"),
        ("time_s,a\n1,1\n2,1\n1.5,1\n", "REF%: a", ":4: column 'time_s': 1.5 s is earlier than the row before"),
        ("time_s,a\nnoon,1\n", "REF%: a", ":2: column 'time_s': time_s = noon, it must be a time in s, 0 or more"),
        ("time_s,a\n,1\n", "REF%: a", ":2: column 'time_s': time_s = , it must be a time in s"),
        ("time_s,a\n0,1\n2000000,1\n", "REF%: a", ":3: column 'time_s': 2000000 s is days after the first row"),
        ("time_s,a\n0,1\n", "REF%: b", ":1: the table has no column 'b'"),
        ("when,a\n0,1\n", "REF%: a", ":1: the table has no column 'time_s'"),
        ("time_s,a,a\n0,1,2\n", "REF%: a", ":1: two columns are called 'a'"),
        ("time_s,time_s,a\n0,0,1\n", "REF%: a", ":1: two columns are called 'time_s'"),
        ("time_s,a\n0,1,2\n", "REF%: a", ":2: the row has 3 cells, the header 2"),
        ('time_s,a\n0,"1\n', "REF%: a", ":2: not CSV"),
        ("time_s,a\n", "REF%: a", "has no rows"),
        ("", "REF%: a", ":1: the first line must name the columns"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_told_with_line_and_column_before_the_run(tmp_path, csv, columns, message):
    (tmp_path / "shift.csv").write_text(csv)
    (told,) = faults(rack_in(tmp_path), tmp_path, entry(columns))
    assert told.startswith("AMX6745 1:23 ")
    assert f"shift.csv{message}" in told if message[0] == ":" else message in told


def test_a_table_that_is_not_there_or_no_file(tmp_path):
    rack = rack_in(tmp_path)
    (tmp_path / "shit.csv").write_text("time_s,a\n0,1\n")
    file = read(rack, tmp_path, entry("REF%: a"))
    assert [(item.code, item.hint) for item in file.diagnostics] == [("AMX6745", "did you mean shit.csv?")]
    os.mkfifo(tmp_path / "shift.csv")
    assert "is not a regular file" in faults(rack, tmp_path, entry("REF%: a"))[0], "nobody waits for a pipe"


def test_a_table_lies_in_the_folder_of_the_stimuli_or_of_the_rack(tmp_path):
    (tmp_path / "rack").mkdir()
    (tmp_path / "stimuli").mkdir()
    rack = rack_in(tmp_path / "rack")
    (tmp_path / "outside.csv").write_text("time_s,a\n0,1\n")
    (tmp_path / "stimuli" / "link.csv").symlink_to(tmp_path / "outside.csv")
    for name in ("../outside.csv", "link.csv", str(tmp_path / "outside.csv")):
        text = f"- {{at: 0, table: {{file: {name}, columns: {{REF%: a}}}}}}\n"
        (told,) = faults(rack, tmp_path / "stimuli", text)
        assert "lies outside the folders" in told or "'link.csv' does not exist" in told, "none is in the rack's folder"
        path = tmp_path / "stimuli" / "stimuli.yaml"
        assert read_for_rack(path, rack, allow_outside=True).diagnostics == []
    (tmp_path / "rack" / "near.csv").write_text("time_s,a\n0,1\n")
    text = "- {at: 0, table: {file: near.csv, columns: {REF%: a}}}\n"
    assert faults(rack, tmp_path / "stimuli", text) == []


def test_a_huge_table_is_refused_before_it_is_read(tmp_path, monkeypatch):
    rack = rack_in(tmp_path)
    with (tmp_path / "shift.csv").open("wb") as file:
        file.write(b"time_s,a\n0,1\n")
        file.truncate(verb.MOST_BYTES + 1)
    assert f"has more than {verb.MOST_BYTES} bytes" in faults(rack, tmp_path, entry("REF%: a"))[0]
    (tmp_path / "shift.csv").write_text("time_s,a\n" + "".join(f"{number},1\n" for number in range(12)))
    monkeypatch.setattr(verb, "MOST_CELLS", 10)
    assert "shift.csv:12: the table has more than 10 cells" in faults(rack, tmp_path, entry("REF%: a"))[0]


def test_an_hour_of_seconds_is_read_and_played_quickly(tmp_path):
    """3600 rows of 20 columns: 72,000 cells, each written once."""
    names = [f"V{number}%" for number in range(20)]
    yaml = "rack: PM1\nslots: {0: {module: 57C435, tasks: {SPEED: {priority: 5}}}}\n"
    yaml += "common:\n  REF%: {}\n  RUN@: {}\n  SUM!: {}\n"
    rack = rack_from(tmp_path, yaml + "".join(f"  {name}: {{}}\n" for name in names), SPEED=SPEED)
    rows = "".join(f"{second},{','.join(str((second * k) % 1000) for k in range(20))}\n" for second in range(3600))
    (tmp_path / "shift.csv").write_text(f"time_s,{','.join(names)}\n{rows}")
    columns = ", ".join(f"{name}: {name}" for name in names)
    stimulation = playing(rack, tmp_path, f"- {{at: 0, table: {{file: shift.csv, columns: {{{columns}}}}}}}\n")
    rack.run(2.5)
    assert [rack.value(name) for name in names] == [2 * k for k in range(20)]
    assert not stimulation.is_over


def test_the_page_has_a_fault_and_its_cure(tmp_path):
    from core.problem_pages import read_page

    page = read_page("AMX6745")
    rack = rack_in(tmp_path, RACK.replace("  REF%: {}\n", "  REF%: {}\n  TACH%: {}\n"))
    assert [told.split()[0] for told in faults(rack, tmp_path, page.example.text)] == ["AMX6745"]
    (tmp_path / "shift.csv").write_text("time_s,tach\n0,1\n")
    assert faults(rack, tmp_path, page.cure.text) == []


def test_every_error_of_a_table_is_told_and_a_word_that_comes_again_once(tmp_path):
    csv = "time_s,a,b\n0,Bad Input,1\n1,40000,2\n2,Bad Input,x\n1,1,1\n3,Bad Input,1\n"
    (tmp_path / "shift.csv").write_text(csv)
    file = read(rack_in(tmp_path), tmp_path, entry("REF%: a, RUN@: b"))
    told = [item.message.partition("shift.csv")[2] for item in file.diagnostics]
    assert [text[:3] for text in told] == [":2:", ":3:", ":3:", ":4:", ":5:"]
    assert told[0].endswith("; the same in 2 more rows, the last in line 6")
    assert [item.hint for item in file.diagnostics][:2] == ["leave the cell empty where there is no value", None]
    (tmp_path / "shift.csv").write_text("time_s,a\n" + "".join(f"{row},{row}x\n" for row in range(99)))
    assert len(faults(rack_in(tmp_path), tmp_path, entry("REF%: a"))) == verb.MOST_TOLD + 1
    (tmp_path / "shift.csv").write_text("when,c\n0,1\n")
    assert len(faults(rack_in(tmp_path), tmp_path, entry("REF%: a, RUN@: b"))) == 3, "all columns that it lacks"


def test_a_date_has_the_page_that_turns_it_into_seconds_as_its_hint(tmp_path):
    (tmp_path / "shift.csv").write_text("time_s,a\n2026-03-02 06:00:00,1\n")
    (told,) = read(rack_in(tmp_path), tmp_path, entry("REF%: a")).diagnostics
    assert told.hint == "seconds, not dates: docs/howto/week.md turns dates into seconds"
    (tmp_path / "shift.csv").write_text("")
    (told,) = read(rack_in(tmp_path), tmp_path, entry("REF%: a")).diagnostics
    assert told.hint == "such as time_s,tach"


@pytest.mark.parametrize(("first", "second", "signs"), [("1,5", "1.500", "comma dot"), ("1.500", "1,5", "dot comma")])
def test_two_decimal_signs_in_one_table_are_refused(tmp_path, first, second, signs):
    before, here = signs.split()
    (tmp_path / "shift.csv").write_text(f"time_s;a\n0.5;{first}\n1.0;{second}\n")
    (told,) = faults(rack_in(tmp_path), tmp_path, entry("GAIN: a"))
    assert f":3: column 'a': '{second}' cannot be used: the decimal sign is a {before} in line 2" in told
    assert told.endswith(f"and here a {here}")


def test_a_unit_of_what_has_none_is_refused(tmp_path):
    (tmp_path / "shift.csv").write_text("time_s,a\n0,1\n")
    rack = rack_in(tmp_path, SCALED.replace("{unit: fpm}", "{}"))
    (told,) = faults(rack, tmp_path, entry("REF%: a, PLAIN%: a, GAIN: a, RUN@: a", "values: unit"))
    assert "PLAIN% has neither a scale nor a unit" in told
