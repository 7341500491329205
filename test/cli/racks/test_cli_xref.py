"""`automax xref`: text, JSON and page of one rack, names and patterns, kept forces, faulty racks."""

from __future__ import annotations

import json
import re
from html.parser import HTMLParser
from pathlib import Path

import pytest

RACK = """\
rack: PM1
slots:
  0: {module: 57C435, tasks: {SPEED: {priority: 5}, DRAW: {priority: 6}}}
  5: {module: 57C419}
common:
  REF%: {ros: in, unit: fpm, description: "<b>line & speed</b> \\"reference\\""}
  SPEED%: {}
  SPEED@: {}
  TABLE%(3): {}
  PB@: {slot: 5, register: 0, bit: 3}
"""
SPEED = """\
10 COMMON REF%, SPEED%, PB@
20 SPEED% = 1
100 CALL SCAN_LOOP(TICKS=2)
110 IF PB@ THEN SPEED% = REF% + SPEED%
900 END
"""
DRAW = "10 COMMON SPEED%, SPEED@\n100 CALL SCAN_LOOP(TICKS=2)\n110 SPEED@ = SPEED% > 5\n900 END\n"


@pytest.fixture
def plant(automax) -> Path:
    automax.write("SPEED.BLK", SPEED)
    automax.write("DRAW.BLK", DRAW)
    return automax.folder / automax.write("rack.yaml", RACK)


def test_all_commons_as_text(automax, plant):
    result = automax("xref", "rack.yaml")
    assert (result.code, result.err) == (0, "")
    assert result.out == (
        "REF%  INTEGER, common memory, ros: in\n"
        '    <b>line & speed</b> "reference" [fpm]\n'
        "    ROS 2 * ros: in\n"
        "    SPEED (SPEED.BLK)  110\n"
        "SPEED%  INTEGER, common memory, ros: out\n"
        "    SPEED (SPEED.BLK)  20*  110*\n"
        "    DRAW (DRAW.BLK)  110\n"
        "SPEED@  BOOLEAN, common memory, ros: out\n"
        "    DRAW (DRAW.BLK)  110*\n"
        "TABLE%  INTEGER (3), common memory, ros: closed\n"
        "    no task declares it\n"
        "PB@  BOOLEAN, slot 5 register 0 bit 3, ros: out\n"
        "    digital_io_5 * input\n"
        "    SPEED (SPEED.BLK)  110\n"
    )


@pytest.mark.parametrize(
    ("asked", "names"),
    [
        ("SPEED%", ["SPEED%"]),
        ("speed", ["SPEED%", "SPEED@"]),
        ("*@", ["SPEED@", "PB@"]),
        ("tab*", ["TABLE%"]),
        (" ref % ", ["REF%"]),
        (None, ["REF%", "SPEED%", "SPEED@", "TABLE%", "PB@"]),
    ],
)
def test_names_and_patterns(automax, plant, asked, names):
    result = automax("xref", plant.parent, *([asked] if asked else []), "--json")
    assert [item["name"] for item in json.loads(result.out)] == names


def test_a_name_that_is_none(automax, plant):
    result = automax("xref", "rack.yaml", "SPED%")
    assert (result.code, result.out) == (2, "")
    assert "the rack has no common variable 'SPED%'\n  hint: did you mean SPEED%?" in result.err


def test_one_as_json(automax, plant):
    (found,) = json.loads(automax("xref", "rack.yaml", "SPEED%", "--json").out)
    assert found["writers"] == [{"task": "SPEED", "file": "SPEED.BLK", "module": "processor_0", "lines": [20, 110]}]
    assert [(user["task"], user["lines"]) for user in found["readers"]] == [("SPEED", [110]), ("DRAW", [110])]
    assert (found["type"], found["place"], found["place_text"], found["line"]) == ("INTEGER", None, "common memory", 7)
    (point,) = json.loads(automax("xref", "rack.yaml", "PB@", "--json").out)
    assert point["place"] == {"slot": 5, "register": 0, "bit": 3}
    assert point["input_of"] == "digital_io_5"


class Cells(HTMLParser):
    """Collects the cells of tables, and all tags."""

    def __init__(self) -> None:
        super().__init__()
        self.rows: list[list[str]] = []
        self.tags: set[str] = set()
        self.attributes: list[tuple[str, str | None]] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.add(tag)
        self.attributes += attrs
        if tag == "tr":
            self.rows.append([])
        if tag in ("td", "th"):
            self.rows[-1].append("")

    def handle_data(self, data: str) -> None:
        if self.rows and self.rows[-1]:
            self.rows[-1][-1] += data.strip("\n")


def test_the_page_stands_alone_and_its_texts_are_no_markup(automax, plant):
    result = automax("xref", "rack.yaml", "--html", "x.html")
    assert (result.code, result.out, result.err) == (0, "", "")
    text = (automax.folder / "x.html").read_text()
    page = Cells()
    page.feed(text)
    assert page.rows[0] == ["common", "type", "place", "ROS 2", "description", "written by", "read by", "remarks"]
    assert page.rows[1] == [
        "REF%", "INTEGER", "common memory", "in", '<b>line & speed</b> "reference" [fpm]', "ROS 2: ros: in",
        "SPEED 110", "",
    ]  # fmt: skip
    assert page.rows[2][5:] == ["SPEED 20, 110", "SPEED 110; DRAW 110", ""]
    assert page.rows[4][5:] == ["", "", "no task declares it"]
    assert len(page.rows) == 6
    assert not page.tags & {"script", "b", "img", "link", "iframe"}
    assert not [name for name, _ in page.attributes if name in ("src", "href") or name.startswith("on")]
    assert not re.search(r"https?://", text)


def test_a_page_has_all_commons_of_a_large_rack(automax):
    many = "".join(f"  V{number}%: {{ros: closed}}\n" for number in range(1200))
    automax.write("rack.yaml", f"rack: PM1\nslots: {{0: {{module: 57C435}}}}\ncommon:\n{many}")
    assert automax("xref", "rack.yaml", "--html", "x.html").code == 0
    assert (automax.folder / "x.html").read_text().count("<tr>") == 1201


def test_page_and_json_at_once_and_no_page_over_the_rack(automax, plant):
    assert json.loads(automax("xref", "rack.yaml", "--json", "--html", "x.html").out)
    assert automax("xref", "rack.yaml", "--html", "rack.yaml").code == 2
    assert automax("xref", "rack.yaml", "--html", "none/x.html").code == 2
    assert plant.read_text() == RACK


def test_forces_of_the_state_that_the_rack_has_kept(automax, plant):
    force = automax.write("force.yaml", "- {at: 0.1, force: {SPEED%: 77}}\n")
    run = ("run", "rack.yaml", "--simulated", "--duration", "0.2", "--stimuli", force, "--state", "kept")
    assert automax(*run).code == 0
    told = automax("xref", "rack.yaml", "SPEED%", "--state", "kept")
    assert "    forced to 77\n" in told.out
    assert json.loads(automax("xref", "rack.yaml", "SPEED%", "--state", "kept", "--json").out)[0]["forced"] == 77
    assert "forced" not in automax("xref", "rack.yaml", "SPEED%").out
    (automax.folder / "kept" / "state.json").write_text("{}")
    damaged = automax("xref", "rack.yaml", "SPEED%", "--state", "kept")
    assert damaged.code == 2
    assert "AMX6711" in damaged.err


def test_what_is_wrong_is_told_and_the_rest_shown(automax, plant):
    automax.write("DRAW.BLK", DRAW.replace("> 5", ">"))
    result = automax("xref", "rack.yaml", "SPEED%")
    assert result.code == 1
    assert "DRAW.BLK:3:" in result.err
    lacks = "without task DRAW (DRAW.BLK), which has errors: it may write and read more\n"
    assert result.out == f"{lacks}SPEED%  INTEGER, common memory, ros: out\n    SPEED (SPEED.BLK)  20*  110*\n"
    paged = automax("xref", "rack.yaml", "SPEED%", "--html", "x.html")
    assert (paged.code, paged.out) == (1, "")
    assert paged.err.endswith(lacks)
    assert lacks.strip() in (automax.folder / "x.html").read_text()
    listed = automax("xref", "rack.yaml", "SPEED%", "--json")
    assert len(json.loads(listed.out)) == 1
    assert listed.err.endswith(lacks)
    automax.write("rack.yaml", "rack: PM1\nslots: {0: {module: 57C999}}\n")
    result = automax("xref", "rack.yaml")
    assert (result.code, result.out) == (1, "")
    assert "AMX6202" in result.err
    assert automax("xref", "none.yaml").code == 2


def test_feeds_of_a_plant_and_of_a_web_are_writers(automax):
    motor = "motor: dc_150hp_500v, gear: 4.0"
    roll = "{diameter_m: 1.0, core_m: 0.15, width_m: 2.5, caliper_um: 90, density_kg_m3: 780}"
    automax.write(
        "rack.yaml",
        "rack: PM1\nslots: {0: {module: 57C435}}\nplants:\n"
        f"  UNWIND: {{{motor}, roll: {roll}, feeds: {{RPM: {{signal: speed_rpm, every_ms: 2.5}}}}}}\n"
        f"  PRESS: {{{motor}, roller: {{diameter_m: 0.5}}}}\n"
        "webs:\n  W1: {from: UNWIND, to: PRESS, length_m: 4.0, stiffness_n: 2.0e5, "
        "feeds: {TENSION: {signal: tension_n}}}\ncommon: {RPM: , TENSION: }\n",
    )
    assert "    plant UNWIND * speed_rpm every 2.5 ms\n" in automax("xref", "rack.yaml", "RPM").out
    (found,) = json.loads(automax("xref", "rack.yaml", "TENSION", "--json").out)
    assert found["feeds"] == [{"web": "W1", "signal": "tension_n", "element": 0, "every_ms": 1.0}]


def test_the_page_has_every_remark_of_the_text(automax, plant):
    automax.write("rack.yaml", RACK.replace("rack: PM1\n", "rack: PM1\nmeant_so: [TABLE%]\n"))
    automax.write("DRAW.BLK", DRAW.replace("SPEED@\n", "SPEED@, REF%\n"))
    text = automax("xref", "rack.yaml", "--html", "x.html", "--json")
    assert text.code == 0
    page = Cells()
    page.feed((automax.folder / "x.html").read_text())
    remarks = {row[0]: row[7] for row in page.rows[1:]}
    assert remarks == {
        "REF%": "DRAW declares it only",
        "SPEED%": "",
        "SPEED@": "",
        "TABLE%": "no task declares it; meant so",
        "PB@": "",
    }


@pytest.mark.parametrize(
    ("pattern", "hint"),
    [("PEED*", "'*PEED*' finds SPEED%, SPEED@"), ("*Q?", "without a name all 5 commons are printed")],
)
def test_a_pattern_that_fits_nothing_has_a_wider_one_as_its_hint(automax, plant, pattern, hint):
    told = automax("xref", "rack.yaml", pattern)
    assert told.code == 2
    assert f"no common variable of the rack fits the pattern '{pattern}'\n  hint: {hint}\n" in told.err
