"""What an operator reads by names and patterns, with units, and what a reload takes away."""

from __future__ import annotations

import pytest
from recordings.live_racks import build

from automax_ros.rack.base.stop_cause import OperationRefused
from automax_ros.rack.operator.requests import OperatorRequests
from automax_ros.rack.rack import Rack

YAML = """\
rack: LINE1
slots:
  0: {module: 57C413}
  1: {module: 57C435, tick_ms: 5.5, tasks: {SPEED: {priority: 4}}}
  6: {module: 57C409}
common:
  F_ONE@: {}
  F_TWO@: {preset: true}
  REF%: {preset: 100, unit: fpm}
  LEVEL%: {slot: 6, register: 0, ros: in, scale: {counts: [0, 4095], value: [0.0, 10.0]}, unit: bar}
  TABLE%(2): {}
"""
SPEED = """\
20 LOCAL TRIM% [CURRENT=1, HIGH=10, LOW=0], KP [CURRENT=0.5, HIGH=2.0, LOW=0.0, STEP=0.1], COUNT%
100 CALL SCAN_LOOP(TICKS=1)
110 COUNT% = 4
120 END
"""


@pytest.fixture
def rack(tmp_path) -> Rack:
    made = build(tmp_path, YAML, SPEED=SPEED)
    made.start()
    made.run(0.02)
    return made


@pytest.fixture
def orders(rack) -> OperatorRequests:
    return OperatorRequests(rack)


def test_patterns_mean_commons_elements_and_what_a_task_has(orders):
    assert orders.get(["f_*"]) == [("F_ONE@", "FALSE"), ("F_TWO@", "TRUE")]
    assert [name for name, _ in orders.get(["TABLE%(*)"])] == ["TABLE%(0)", "TABLE%(1)", "TABLE%(2)"]
    assert next(name for name, _ in orders.get(["RE?%", "*"])) == "REF%"
    assert orders.get(["SPEED.*"]) == [("SPEED.TRIM%", "1"), ("SPEED.KP", "0.5"), ("SPEED.COUNT%", "4")]
    assert [name for name, _ in orders.get(["F_TWO@", "F_*"])] == ["F_TWO@", "F_ONE@"], "each once"


@pytest.mark.parametrize(
    ("pattern", "reason"),
    [
        ("F_ONX*", "the rack has no common variable like 'F_ONX*': did you mean F_ONE@?"),
        ("SPEED.X*", "task SPEED has no variable like 'X*': it has TRIM%, KP, COUNT%"),
        ("NIL.*", "the rack has no task 'NIL': it has SPEED"),
        ("REF%(*)", "the rack has no common variable like 'REF%(*)'"),
    ],
)
def test_a_pattern_that_means_nothing_is_refused_with_names(orders, pattern, reason):
    with pytest.raises(OperationRefused) as refused:
        orders.get([pattern])
    assert str(refused.value).startswith(reason)


def test_values_are_shown_in_their_units(rack, orders):
    rack.write("LEVEL%", 2048)
    shown = {item.name: (item.value, item.shown) for item in orders.read(["LEVEL%", "REF%", "F_ONE@"])}
    assert shown == {"LEVEL%": ("2048", "5.00122 bar"), "REF%": ("100", "100 fpm"), "F_ONE@": ("FALSE", "")}


def test_a_reload_says_which_tuned_values_it_takes(orders):
    orders.tune("SPEED.KP", "1.5")
    name, source = orders.reloads.admit("SPEED", SPEED)
    kept = orders.reloads.install(orders.reloads.prepare(name, source), keep_state=True)
    assert (kept, orders.get(["SPEED.KP"])) == ("", [("SPEED.KP", "1.5")])
    lost = orders.reloads.install(orders.reloads.prepare(name, source))
    assert lost == "KP was tuned to 1.5 and is 0.5 again"
    assert orders.reloads.install(orders.reloads.prepare(name, source)) == "", "nothing was tuned since"


@pytest.mark.parametrize("pattern", ["*" * 99 + "X", "*A" * 45 + "!", "?*" * 40 + "!", "[*", "*]"])
def test_no_pattern_takes_long(orders, pattern):
    """Tried one after the other, ways to spread the stars over a name would be more than 10**15."""
    with pytest.raises(OperationRefused, match="no common variable like"):
        orders.get([pattern])
