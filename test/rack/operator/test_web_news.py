"""What is told of webs that part, as it happens: by `WebNews`, which console and panel use, and by messages."""

from __future__ import annotations

from pathlib import Path

import pytest

from automax_ros.cli.main import main
from automax_ros.messages.cdr.cdr import decode
from automax_ros.messages.stream.stream import RackStream
from automax_ros.messages.types.messages import NAMES, RollState, WebState
from automax_ros.messages.types.webs_followed import WebsFollowed
from automax_ros.rack.operator.switches import SwitchOperations
from automax_ros.rack.operator.web_news import WebNews
from automax_ros.rack.rack import Rack
from rack.helpers import rack_at, written_in

# 1.2 m of board are on the roll: at 2 m/s the tail goes after 0.6 s, whichever way the motor turns.
LINE = """\
rack: LINE1
slots:
  0: {{module: 57C435}}
plants:
  UNWIND:
    motor: dc_150hp_500v
    gear: 4.0
    roll: {{{stock}, core_m: 0.15, width_m: 2.5, caliper_um: 2000, density_kg_m3: 780}}
    load: {{speed_rpm: {unwind}}}
  PRESS: {{motor: dc_150hp_500v, gear: 4.0, roller: {{diameter_m: 0.5}}, load: {{speed_rpm: {press}}}}}
webs:
  W1: {{from: UNWIND, to: PRESS, length_m: 4.0, stiffness_n: 2.0e5{more}}}
"""
SMALL = "diameter_m: 0.16"
FULL = "diameter_m: 1.25"


def line(folder: Path, stock: str, unwind: float, press: float, more: str = "") -> Rack:
    return rack_at(written_in(folder, LINE.format(stock=stock, unwind=unwind, press=press, more=more)))


def told_of(rack: Rack, seconds: float = 1.5) -> list[tuple[int, str]]:
    told: list[tuple[int, str]] = []
    WebNews(rack, lambda at_ns, text: told.append((at_ns, text)))
    rack.start()
    rack.run(seconds)
    return told


def test_a_roll_that_ran_out_is_told_at_its_sample(tmp_path):
    rack = line(tmp_path, SMALL, 990, 306)
    ((at_ns, text),) = told_of(rack)
    assert text == "web W1 ran out: UNWIND is empty"
    assert at_ns == pytest.approx(0.61e9, abs=0.05e9)
    assert at_ns % 10_000_000 == 0


def test_a_web_that_tears_broke(tmp_path):
    (told,) = told_of(line(tmp_path, FULL, 100, 260, ", breaks_above_n: 500"))
    assert told[1] == "web W1 broke"


def test_a_winder_that_begins_with_its_core_has_not_run_out(tmp_path):
    """The web comes onto the bare core of its end, and tears in the first instants."""
    winder = LINE.replace("from: UNWIND, to: PRESS", "from: PRESS, to: UNWIND").format(
        stock="diameter_m: 0.15", unwind=990, press=200, more=", breaks_above_n: 100"
    )
    (told,) = told_of(rack_at(written_in(tmp_path, winder)), 0.2)
    assert told[1] == "web W1 broke"


def test_what_an_operator_breaks_is_told_again_after_it_was_threaded_and_nothing_of_the_start(tmp_path):
    rack = line(tmp_path, FULL, 0, 0, ", threaded: false")
    told = told_of(rack, 0.1)
    assert told == []
    for control in ("thread", "break", "thread", "break"):
        SwitchOperations(rack).web("W1", control)
        rack.run(0.05)
    assert [text for _, text in told] == ["web W1 is threaded again", "web W1 broke"] * 2


def test_a_rack_without_webs_is_not_looked_at(tmp_path):
    plain = "rack: LINE1\nslots:\n  0: {module: 57C435}\nplants:\n  FAN: {motor: dc_150hp_500v}\n"
    rack = rack_at(written_in(tmp_path, plain))
    WebNews(rack, lambda *_: None)
    assert rack.sampling._looks == []


def test_its_messages_tell_the_same(tmp_path):
    rack = line(tmp_path, SMALL, 990, 306)
    stream, told = RackStream(rack, 7), list[str]()
    followed = WebsFollowed(rack.config.plants)

    def sink(topic):
        if topic.type_name not in (NAMES[RollState], NAMES[WebState]):
            return lambda _, __: None
        return lambda _, data: told.append(followed.take(decode(topic.type_name, data)))

    stream.add_sink(sink)
    stream.begin()
    rack.start()
    rack.run(1.0)
    stream.end()
    assert list(filter(None, told)) == ["web W1 ran out: UNWIND is empty"]


def test_the_console_of_a_run_tells_it(tmp_path, capsys):
    line(tmp_path, SMALL, 990, 306)
    assert main(["run", str(tmp_path / "rack.yaml"), "--simulated", "--duration", "1"]) == 0
    (shown,) = [text for text in capsys.readouterr().out.splitlines() if "W1" in text]
    assert shown.startswith("web W1 ran out: UNWIND is empty at 0.6")
    assert shown.endswith(" s")
