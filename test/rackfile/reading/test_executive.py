"""What a rack of an older Programming Executive could not do yet, and the keys of operation."""

import pytest
from rack.helpers import codes, good, loaded

from automax_ros.core.diagnostics import Severity
from automax_ros.rack.base.stop_cause import OperationRefused
from automax_ros.rack.rack import Rack
from automax_ros.rackfile.model.config import ModuleLoss
from automax_ros.runtime.memory.views import MemoryValueError

SLOTS = "slots:\n  0: {{module: {model}, tick_ms: {tick}}}\n"


def text(version: str, model: str = "57C431", tick: str = "5.5") -> str:
    return f"rack: LINE1\nexecutive: {version}\n" + SLOTS.format(model=model, tick=tick)


@pytest.mark.parametrize(
    ("version", "tenths"), [("2.0", 20), ("2", 20), ("2.1", 21), ("3.8", 38), ("4", 40), ("4.2", 42)]
)
def test_a_version_is_kept_in_tenths(tmp_path, version, tenths):
    assert good(tmp_path, text(version)).executive == tenths


@pytest.mark.parametrize(
    ("version", "code"),
    [("1.9", "AMX6701"), ("4.3", "AMX6701"), ("0", "AMX6701"), ("9.9", "AMX6701"), ("4.25", "AMX6008"),
     ("'3.1'", "AMX6008"), ("V3.1", "AMX6008"), ("-3.1", "AMX6008"), ("", "AMX6008"), ("[3.1]", "AMX6008"),
     ("3,1", "AMX6008"), ("true", "AMX6008"), ("31", "AMX6008"), ("3.", "AMX6008"), ("\u0663.1", "AMX6008")],
)  # fmt: skip
def test_what_is_no_version_is_told_at_its_place(tmp_path, version, code):
    found = loaded(tmp_path, text(version)).diagnostics
    assert [(item.code, item.span.line, item.severity) for item in found] == [(code, 2, Severity.ERROR)]
    assert "executive" in found[0].message


@pytest.mark.parametrize(
    ("version", "model", "tick", "expected"),
    [
        ("3.0", "57C431", "5.0", ["AMX6702"]),
        ("2.0", "57C430A", "0.5", ["AMX6702"]),
        ("3.0", "57C431", "5.5", []),
        ("3.1", "57C431", "0.5", []),
        ("2.1", "57C435", "5.5", ["AMX6703"]),
        ("2.1", "57C435", "2.0", ["AMX6703", "AMX6702"]),
        ("3.0", "57C435", "5.5", []),
        ("2.0", "57C430A", "5.5", []),
    ],
)
def test_an_old_executive_has_one_tick_and_fewer_modules(tmp_path, version, model, tick, expected):
    assert sorted(codes(tmp_path, text(version, model, tick))) == sorted(expected)


def test_an_old_executive_may_stand_below_the_slots(tmp_path):
    slots = SLOTS.format(model="57C431", tick="2.0")
    assert codes(tmp_path, f"rack: LINE1\n{slots}executive: 3.0\n") == ["AMX6702"]


def commons(count: int) -> str:
    return "common:\n" + "".join(f"  V{number}%:\n" for number in range(count))


@pytest.mark.parametrize(("version", "most"), [("3.9", 16), ("4.0", 64)])
def test_as_many_variables_are_forced_as_the_executive_allows(tmp_path, version, most):
    rack = Rack(good(tmp_path, text(version) + commons(70)))
    rack.start()
    for number in range(most):
        rack.force(f"V{number}%", number)
    with pytest.raises(MemoryValueError, match=f"V69% cannot be forced: {most} variables are forced, the most with "):
        rack.force("V69%", 1)
    rack.force("V3%", 7)
    assert [(item.name, item.value) for item in rack.forces()][3:5] == [("V3%", 7), ("V4%", 4)]
    assert len(rack.forces()) == most
    rack.unforce("V0%")
    rack.force("V69%", 1)
    assert [item.name for item in rack.forces()][-1] == "V69%"


@pytest.mark.parametrize("value", [True, False])
def test_auto_run_is_shown(tmp_path, value):
    config = good(tmp_path, f"auto_run: {str(value).lower()}\n{text('4.2')}common:\n  AUTORUNSTATUS@:\n")
    rack = Rack(config)
    rack.start()
    assert rack.value("AUTORUNSTATUS@") is value
    rack.operations.stop_all("test")
    assert rack.value("AUTORUNSTATUS@") is value
    with pytest.raises(MemoryValueError, match="the rack itself writes it"):
        rack.force("AUTORUNSTATUS@", not value)


def test_the_loss_of_a_module_stops_all_or_holds(tmp_path):
    assert good(tmp_path, text("4.2")).on_module_loss is ModuleLoss.STOP_ALL
    assert good(tmp_path, f"on_module_loss: hold\n{text('4.2')}").on_module_loss is ModuleLoss.HOLD
    found = loaded(tmp_path, f"on_module_loss: stop-all\n{text('4.2')}").diagnostics
    assert [(item.code, item.hint) for item in found] == [("AMX6704", "did you mean stop_all?")]


def test_a_critical_task_does_not_stop_alone(tmp_path):
    tasks = "rack: LINE1\nslots:\n  0: {module: 57C435, tasks: {LINE: {priority: 5, critical: true}}}\n"
    rack = Rack(good(tmp_path, tasks))
    rack.start()
    with pytest.raises(OperationRefused, match=r"LINE is critical.*STOP ALL"):
        rack.operations.stop("LINE")
    rack.run(0.05)
    assert rack.statistics["LINE"].scans == 10
    rack.operations.stop_all("operator")
    rack.run(0.05)
    assert rack.statistics["LINE"].scans == 10


@pytest.mark.parametrize("key", ["auto_run: 2", "auto_run: 'true'", "on_module_loss:", "on_module_loss: [hold]"])
def test_wrong_kinds_of_values_are_told(tmp_path, key):
    assert codes(tmp_path, f"{key}\n{text('4.2')}") == ["AMX6008"]
