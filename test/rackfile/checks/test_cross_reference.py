"""The cross reference against what the sources say, and against a search of the words in them."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from rack.helpers import config_at, written_in

from automax_ros.language.program import Program
from automax_ros.rackfile.checks.cross_reference import CommonUse, cross_reference
from automax_ros.rackfile.checks.tasks import check_tasks
from automax_ros.rackfile.model.config import RackConfig

CONFIG = Path(__file__).parents[3] / "config"
RACK = """\
rack: LINE1
meant_so: [SPARE%]
slots:
  0: {module: 57C413}
  1: {module: 57C435, tasks: {ONE: {priority: 5}}}
  2: {module: 57C435, tasks: {LOG: {priority: 7, file: LOG.BAS}}}
  5: {module: 57C419}
  7: {module: 57C406, plant: ROLL}
  9: {module: 57C404, network: NET1, drop: 3, depth: 1}
plants:
  ROLL:
    motor: dc_150hp_500v
    feeds: {RPM: {signal: speed_rpm, every_ms: 2.5}}
    joint: {velocity: {common: WANTED}}
common:
  A%: {unit: counts, description: "what <ONE> makes"}
  T%(5): {}
  PB@: {slot: 5, register: 1, bit: 3, ros: in}
  FAR%: {slot: 9, drop: 3, register: 5}
  RPM: {}
  WANTED: {ros: in}
  FORCINGSTATUS@: {}
  SPARE%: {}
"""
ONE = """\
10 COMMON A%, T%(5), PB@, FORCINGSTATUS@, RPM
20 LOCAL N%
30 A% = 1
100 CALL SCAN_LOOP(TICKS=2)
110 IF PB@ THEN T%(A%) = A% + 1
120 CALL LIMIT(INPUT=A%, LIMIT_PLUS=100, OUTPUT=A%)
130 FOR N% = 0 TO 2
140 A% = A% + T%(N%)
150 NEXT N%
900 END
"""
LOG = "10 COMMON A%, FAR%\n20 FAR% = A%\n30 DELAY 1 SECONDS\n40 GOTO 20\n50 END\n"


def programs_of(config: RackConfig) -> list[Program]:
    return [item.result.program for item in check_tasks(config) if item.result.program is not None]


@pytest.fixture
def found(tmp_path) -> dict[str, CommonUse]:
    (tmp_path / "LOG.BAS").write_text(LOG)
    config = config_at(written_in(tmp_path, RACK, ONE=ONE))
    programs = programs_of(config)
    assert [program.name for program in programs] == ["ONE", "LOG"]
    return {item.name: item for item in cross_reference(config, programs)}


def lines(item: CommonUse) -> dict[str, tuple[tuple[int, ...], tuple[int, ...]]]:
    return {use.task: (use.writes, use.reads) for use in item.tasks}


def test_every_line_that_writes_and_reads(found):
    assert list(found) == ["A%", "T%", "PB@", "FAR%", "RPM", "WANTED", "FORCINGSTATUS@", "SPARE%"]
    assert lines(found["A%"]) == {"ONE": ((30, 120, 140), (110, 120, 140)), "LOG": ((), (20,))}
    assert lines(found["T%"]) == {"ONE": ((110,), (140,))}
    assert lines(found["PB@"]) == {"ONE": ((), (110,))}
    assert lines(found["FAR%"]) == {"LOG": ((20,), ())}
    assert lines(found["FORCINGSTATUS@"]) == {"ONE": ((), ())}, "declared only"
    assert [use.module for use in found["A%"].tasks] == ["processor_1", "processor_2"]
    assert [use.file for use in found["A%"].writers] == ["ONE.BLK"]


def test_places_and_writers_outside_of_tasks(found):
    assert [found[name].place for name in ("A%", "PB@", "FAR%")] == [
        "common memory",
        "slot 5 register 1 bit 3",
        "slot 9 drop 3 register 5",
    ]
    assert (found["PB@"].input_of, found["PB@"].from_ros) == ("digital_io_5", True)
    assert [(feed.plant, feed.signal, feed.every_ns) for feed in found["RPM"].feeds] == [
        ("ROLL", "speed_rpm", 2_500_000)
    ]
    assert [(item.joint, item.interface) for item in found["WANTED"].commands] == [("ROLL", "velocity")]
    assert [name for name, item in found.items() if item.by_rack] == ["FORCINGSTATUS@"]
    assert [name for name, item in found.items() if item.meant_so] == ["SPARE%"]


def statements(source: str) -> dict[int, str]:
    """The text of each BASIC line without remarks and strings; a line with & goes on with the next."""
    joined = re.sub(r"&[^\n]*\n", " ", re.sub(r"(?<!\w)![^\n]*", "", re.sub(r'"[^"\n]*"', "", source)))
    joined = re.sub(r"\bREM\b[^\n]*", "", joined)
    rows: dict[int, str] = {}
    number = 0
    for line in joined.split("\n"):
        match = re.match(r"\s*([0-9]+)(.*)", line)
        number, text = (int(match[1]), match[2]) if match else (number, line)
        rows[number] = rows.get(number, "") + " " + text
    return rows


@pytest.mark.parametrize("path", sorted(CONFIG.rglob("rack.yaml")), ids=lambda path: path.parent.name)
def test_in_the_example_racks_it_is_where_a_search_finds_the_name(path):
    """Each line that the reference gives has the name in its text, and each line with the name is given."""
    config = config_at(path)
    programs = programs_of(config)
    reference = cross_reference(config, programs)
    checked = 0
    for task in (task for _, task in config.placed_tasks if task.name in {program.name for program in programs}):
        rows = statements(task.file.read_text(encoding="latin-1"))
        for item in reference:
            use = next((use for use in item.tasks if use.task == task.name), None)
            name = re.compile(rf"(?<![\w]){re.escape(item.name)}(?![\w%!@$])")
            lines = {number for number, text in rows.items() if name.search(text) and " COMMON " not in f"{text} "}
            given = set() if use is None else {*use.writes, *use.reads}
            assert given == lines, (task.name, item.name)
            checked += len(given)
    assert checked > 5
