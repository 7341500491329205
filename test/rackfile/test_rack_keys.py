"""Every key of docs/rack_yaml.md does something: two racks that differ in it alone behave differently."""

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from rack.helpers import rack_at

from automax_ros.messages.cdr.cdr import decode
from automax_ros.messages.stream.stream import RackStream
from automax_ros.rackfile.loader import load

PAGE = Path(__file__).parents[2] / "docs" / "rack_yaml.md"
OUTPUT = """\
10 COMMON COUNT%, LAMP@, LIGHTS%
20 LOCAL SEEN%
30 CALL SCAN_LOOP(TICKS=1)
40 CALL MOVE(INPUT1=5, OUTPUT1=LIGHTS%)
50 COUNT% = IOREAD%(5, 0) + IOREAD%(5, 1) * 100
60 END
"""
POINTS = """\
rack: LINE1
slots:
  0: {module: 57C435, tasks: {OUT: {priority: 5}}}
  5: {module: 57C408}
  6: {module: 57C408}
common:
  COUNT%:
  LIGHTS%: {slot: 5, register: 1}
  LAMP@: {slot: 5, register: 1, bit: 0}
"""
COUNTING = "10 COMMON COUNT%\n20 CALL SCAN_LOOP(TICKS=1)\n30 COUNT% = COUNT% + {step}\n40 END\n"
RACK = """\
rack: LINE1
slots:
  0: {module: 57C413}
  1: {module: 57C435, tick_ms: 5.5, tasks: {ONE: {priority: 5}, TWO: {priority: 6}}}
common:
  COUNT%: {ros: out, unit: ft, description: length}
"""


OPERATION = {"execution", "executive", "auto_run", "on_module_loss", "critical"}
PLANT = ("plant", "drive", "line", "load", "inertia", "couple", "feeds", "joint", "gear", "roll", "roller")
WEB = ("webs", "length_m", "stiffness_n", "modulus_mpa", "threaded", "breaks_above_n", "dancer")
NETWORK = {"network", "drop", "depth"}
UDC = {"drive", "plants", "motor", "motor_overload_ratio"}
"""Keys of UDC modules and what they drive; ``modules/test_udc_rules.py`` tries them."""


class Behaviour(NamedTuple):
    """What a rack did in 22 ms: its topics and messages in order, COUNT% at the end and after STOP ALL."""

    messages: list[tuple[str, Any]]
    count: object
    after_stop: object

    def on(self, topic: str) -> list[Any]:
        return [message for name, message in self.messages if name.endswith(f"/{topic}")]

    @property
    def variable(self) -> Any:
        return self.on("variables")[0].variables[0]


def behaviour(folder: Path, text: str) -> Behaviour:
    for name, step in (("ONE", 1), ("TWO", 10), ("other", 100)):
        (folder / f"{name}.BLK").write_text(COUNTING.format(step=step))
    (folder / "OUT.BLK").write_text(OUTPUT)
    path = folder / "rack.yaml"
    path.write_text(text)
    rack = rack_at(path)
    messages: list[tuple[str, Any]] = []
    stream = RackStream(rack, 1)
    stream.add_sink(lambda topic: lambda _, data: messages.append((topic.name, decode(topic.type_name, data))))
    stream.begin()
    rack.start()
    rack.run(0.022)
    count = rack.value("COUNT%")
    rack.operations.stop_all("test")
    return Behaviour(messages, count, rack.value("COUNT%"))


def tasks(found: Behaviour) -> list[str]:
    """The tasks of the first scans, in order."""
    return [scan.task for scan in found.on("scans") if scan.stamp == 0 and scan.scan == 1]


CHANGES: dict[str, tuple[tuple[str, str], Callable[[Behaviour], object], object, object]] = {
    "rack": (("LINE1", "MILL"), lambda found: found.messages[0][0], "/line1/variables", "/mill/variables"),
    "slots": (("1: {module", "3: {module"), lambda found: found.on("scans")[0].slot, 1, 3),
    "common": (
        ("common:\n", "common:\n  SPARE@:\n"),
        lambda found: len(found.on("variables")[0].variables),
        1,
        2,
    ),
    "tick_ms": (("5.5", "10"), lambda found: found.count, 44, 33),
    "tasks": (("ONE: {priority: 5}, ", ""), tasks, ["ONE", "TWO"], ["TWO"]),
    "priority": (("priority: 6", "priority: 4"), tasks, ["ONE", "TWO"], ["TWO", "ONE"]),
    "file": (("priority: 6", "priority: 6, file: other.BLK"), lambda found: found.count, 44, 404),
    "ros": (("ros: out, ", "ros: closed, "), lambda found: len(found.on("common/COUNT")), 10, 0),
    "rate_limit_hz": (("ros: out", "ros: out, rate_limit_hz: 10"), lambda found: len(found.on("common/COUNT")), 10, 1),
    "preset": (("ros: out", "ros: out, preset: 7"), lambda found: found.count, 44, 51),
    "non_volatile": (("ros: out", "ros: out, non_volatile: true"), lambda found: found.after_stop, 0, 44),
    "unit": (("ft", "m"), lambda found: found.variable.unit, "ft", "m"),
    "scale": (
        ("ros: out", "ros: out, scale: {counts: [0, 11], value: [0.0, 0.5]}"),
        lambda found: [message.data for message in found.on("common/COUNT")][:3],
        [0, 1, 11],
        [0.0, pytest.approx(0.5 / 11), 0.5],
    ),
    "description": (("length", "speed"), lambda found: found.variable.description, "length", "speed"),
}
"""For each key: the text that is replaced and by what, what is looked at, what it is before and after."""


@pytest.mark.parametrize("key", CHANGES)
def test_a_key_changes_what_the_rack_does(key, tmp_path):
    (old, new), look, before, after = CHANGES[key]
    assert old in RACK
    assert look(behaviour(tmp_path, RACK)) == before
    assert look(behaviour(tmp_path, RACK.replace(old, new, 1))) == after


@pytest.mark.parametrize(
    ("key", "old", "new", "before", "after"),
    [
        ("slot", "slot: 5, register: 1, bit", "slot: 6, register: 1, bit", True, False),
        ("register", "register: 1, bit", "register: 0, bit", True, False),
        ("bit", "bit: 0", "bit: 1", True, False),
    ],
)
def test_the_place_of_a_point_decides_what_it_shows(tmp_path, key, old, new, before, after):
    assert key in old
    for text, shown in ((POINTS, before), (POINTS.replace(old, new), after)):
        found = behaviour(tmp_path, text)
        assert found.count == 500
        assert [message.data for message in found.on("common/LAMP")][-2:-1] == ([shown] if shown else [])


def test_the_module_decides_how_many_registers_there_are(tmp_path):
    text = RACK + "  BIG!(40000):\n"
    (tmp_path / "rack.yaml").write_text(text)
    assert [item.code for item in load(tmp_path / "rack.yaml").diagnostics][-1:] == ["AMX6409"]
    behaviour(tmp_path, text.replace("57C413", "57C423"))


def test_every_documented_key_is_tried():
    """Some do nothing yet, and the page says so.

    What to watch is tried in ``test_settings.py``, alarms in ``sections/test_alarms.py``, what is meant so in
    ``checks/test_omissions.py``, those of operation in
    ``test_executive.py``, a UDC's and a network module's with it, a plant's in ``plants``, a web's in
    ``sections/test_webs.py``.
    """
    text = PAGE.read_text(encoding="utf-8")
    tables = re.findall(r"^\| (?:key|option) \| value .*\n\| --- .*\n((?:\|.*\n)+)", text, re.M)
    rows = [re.match(r"\| `(\w+)` \|", row) for table in tables for row in table.splitlines()]
    keys = {match[1] for match in rows if match}
    assert keys == {
        *CHANGES,
        *OPERATION,
        *UDC,
        *NETWORK,
        *PLANT,
        *WEB,
        "module",
        "operator",
        "watch",
        "alarms",
        "meant_so",
        "slot",
        "register",
        "bit",
    }
    assert "`on_module_loss` | `stop_all` or `hold` | `stop_all` | What a rack that is [distributed]" in text
