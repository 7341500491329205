"""What survives what (2.4.5, J2-3106-1 p. 10-6), cell by cell: each kind of data against each way of losing it."""

from collections.abc import Callable
from pathlib import Path

import pytest

from automax_ros.core.types import Value
from automax_ros.rack.operator.retention import Retention
from automax_ros.rack.rack import Rack
from automax_ros.runtime.tasks.task import Status
from rack.helpers import rack_at, rack_from

YAML = """\
rack: KEEP
slots:
  0: {module: 57C413}
  1: {module: 57C435, tasks: {LINE: {priority: 5}, BREAK: {priority: 6}}}
  4: {module: 57C423}
  5: {module: 57C419}
  6: {module: 57C403}
  7: {module: 57C403}
  10: {module: 57552, tasks: {DRIVE: {drive: A}}}
common:
  V_INT%: {preset: 7}
  V_DOUBLE!:
  V_REAL:
  V_BOOL@:
  V_TEXT$:8:
  V_TABLE%(2):
  N_INT%: {non_volatile: true, preset: 7}
  N_DOUBLE!: {non_volatile: true}
  N_REAL: {non_volatile: true}
  N_BOOL@: {non_volatile: true}
  N_TEXT$:8: {non_volatile: true}
  N_TABLE%(2): {non_volatile: true}
  F_INT%:
  F_KEPT%: {non_volatile: true}
  F_OUT%: {slot: 6, register: 0}
  OUT%: {slot: 7, register: 0}
  IN_BIT@: {slot: 5, register: 0, bit: 3}
  IN_WORD%: {slot: 5, register: 1}
  USER%: {slot: 4, register: 8}
  FAULT@: {ros: in}
  SWITCH%: {slot: 10, register: 1000, ros: in}
  STATUS%: {slot: 10, register: 80, ros: in}
  COMMAND%: {slot: 10, register: 100}
  FEEDBACK%: {slot: 10, register: 200, ros: in}
  EVERY%: {slot: 10, register: 300}
  NTH%: {slot: 10, register: 1300}
  ISCR%: {slot: 10, register: 2000}
  SCANS%: {slot: 10, register: 2001}
  AUTORUNSTATUS@:
  FORCINGSTATUS@:
  BATTERYSTATUS0@:
  BATTERYSTATUS1@:
"""
LINE = """\
10 COMMON V_INT%
20 LOCAL N%, D!, X, B@, T$:8, A%(2), NIL%, K% [CURRENT=3, LOW=0, HIGH=9], G [CURRENT=0.5, LOW=0.0, HIGH=1.0]
30 LOCAL BEGUN%
40 BEGUN% = BEGUN% + 1
60 D! = 70000 \\ X = 0.25 \\ B@ = TRUE \\ T$ = "KEPT" \\ A%(2) = 9
100 CALL SCAN_LOOP(TICKS=1)
110 N% = N% + 1
120 IF N% = 2 THEN NIL% = 1 / NIL%
130 END
"""
BREAK = """\
10 COMMON FAULT@
20 LOCAL I%
100 CALL SCAN_LOOP(TICKS=1)
110 FOR I% = 0 TO 1
120 IF FAULT@ THEN I% = 0
130 NEXT I%
140 END
"""
DRIVE = """\
10 LOCAL L%, K% [CURRENT=3, LOW=0, HIGH=9], NIL%
20 L% = 5
30 NIL% = 1 / NIL%
100 CALL SCAN_LOOP(TICKS=10)
110 END
"""
GIVEN: dict[str, Value] = {
    "V_INT%": -5,
    "V_DOUBLE!": 70000,
    "V_REAL": 0.5,
    "V_BOOL@": True,
    "V_TEXT$": "TEXT",
    "N_INT%": -5,
    "N_DOUBLE!": 70000,
    "N_REAL": 0.5,
    "N_BOOL@": True,
    "N_TEXT$": "TEXT",
    "IN_BIT@": True,
    "IN_WORD%": 77,
    "USER%": 55,
    "SWITCH%": 2,
    "STATUS%": 3,
    "COMMAND%": 4,
    "FEEDBACK%": 5,
    "EVERY%": 6,
    "NTH%": 7,
    "ISCR%": 64,
    "SCANS%": 8,
}
"""What commons hold before."""


def stop_all(rack: Rack) -> None:
    rack.operations.stop_all("operator")


def fault(rack: Rack) -> None:
    rack.write("FAULT@", True)
    rack.run(0.006)
    assert rack.operations.stopped is not None
    assert rack.operations.stopped.task == "BREAK"


def power(rack: Rack) -> None:
    rack.operations.power_off()
    rack.operations.power_on()


def power_without_battery(rack: Rack) -> None:
    rack.operations.power_off()
    rack.operations.power_on(battery=False)


WAYS: dict[str, Callable[[Rack], None]] = {
    "STOP ALL": stop_all,
    "fault": fault,
    "power": power,
    "battery": power_without_battery,
}


def common(name: str, element: int = 0) -> Callable[[Rack], object]:
    return lambda rack: rack.value(name, element)


def local(name: str) -> Callable[[Rack], object]:
    return lambda rack: rack.task("LINE").value(name)


def udc(name: str) -> Callable[[Rack], object]:
    return lambda rack: rack.task("DRIVE").value(name)


def log(task: str) -> Callable[[Rack], object]:
    return lambda rack: [entry.line for entry in rack.task(task).errors.entries]


def status(rack: Rack) -> object:
    return rack.task("LINE").status


def pending(rack: Rack) -> object:
    return rack.events.pending


def forced(rack: Rack) -> object:
    return [(item.name, item.value) for item in rack.forces()]


FORCES = [("F_INT%", 11), ("F_KEPT%", 12), ("F_OUT%", 13)]
CELLS: dict[str, tuple[Callable[[Rack], object], object, object, object, object, object]] = {
    # what: how it is read; before; after STOP ALL, a fault, power, power without a battery
    "tunable INTEGER": (local("K%"), 8, 8, 8, 8, 3),
    "tunable REAL": (local("G"), 0.75, 0.75, 0.75, 0.75, 0.5),
    "local INTEGER": (local("N%"), 4, 4, 5, 4, 0),
    "local DOUBLE INTEGER": (local("D!"), 70000, 70000, 70000, 70000, 0),
    "local REAL": (local("X"), 0.25, 0.25, 0.25, 0.25, 0.0),
    "local BOOLEAN": (local("B@"), True, True, True, True, False),
    "local STRING": (local("T$"), "KEPT", "KEPT", "KEPT", "KEPT", ""),
    "local array": (local("A%"), [0, 0, 9], [0, 0, 9], [0, 0, 9], [0, 0, 9], [0, 0, 0]),
    "error log": (log("LINE"), [120, 120], [120, 120], [120, 120], [120, 120], []),
    "tunable of a UDC": (udc("K%"), 8, 8, 8, 8, 3),
    "UDC local": (udc("L%"), 5, 0, 0, 0, 0),
    "error log of a UDC": (log("DRIVE"), [30, 30], [30, 30], [30, 30], [30, 30], []),
    "UDC test switch": (common("SWITCH%"), 2, 2, 2, 2, 2),
    "UDC communication status": (common("STATUS%"), 3, 3, 3, 3, 3),
    "UDC command register": (common("COMMAND%"), 4, 0, 0, 0, 0),
    "UDC feedback register": (common("FEEDBACK%"), 5, 5, 5, 5, 5),
    "UDC register of every scan": (common("EVERY%"), 6, 0, 0, 0, 0),
    "UDC register of every Nth scan": (common("NTH%"), 7, 0, 0, 0, 0),
    "UDC ISCR": (common("ISCR%"), 64, 0, 0, 0, 0),
    "UDC scans per interrupt": (common("SCANS%"), 8, 0, 0, 0, 0),
    "volatile INTEGER": (common("V_INT%"), -5, 0, 0, 0, 0),
    "volatile DOUBLE INTEGER": (common("V_DOUBLE!"), 70000, 0, 0, 0, 0),
    "volatile REAL": (common("V_REAL"), 0.5, 0.0, 0.0, 0.0, 0.0),
    "volatile BOOLEAN": (common("V_BOOL@"), True, False, False, False, False),
    "volatile STRING": (common("V_TEXT$"), "TEXT", "", "", "", ""),
    "volatile element": (common("V_TABLE%", 2), 6, 0, 0, 0, 0),
    "non-volatile INTEGER": (common("N_INT%"), -5, -5, -5, -5, 0),
    "non-volatile DOUBLE INTEGER": (common("N_DOUBLE!"), 70000, 70000, 70000, 70000, 0),
    "non-volatile REAL": (common("N_REAL"), 0.5, 0.5, 0.5, 0.5, 0.0),
    "non-volatile BOOLEAN": (common("N_BOOL@"), True, True, True, True, False),
    "non-volatile STRING": (common("N_TEXT$"), "TEXT", "TEXT", "TEXT", "TEXT", ""),
    "non-volatile element": (common("N_TABLE%", 2), 6, 6, 6, 6, 0),
    "forced volatile": (common("F_INT%"), 11, 11, 11, 11, 0),
    "forced non-volatile": (common("F_KEPT%"), 12, 12, 12, 12, 0),
    "forced output": (common("F_OUT%"), 13, 13, 13, 13, 0),
    "force table": (forced, FORCES, FORCES, FORCES, FORCES, []),
    "input bit": (common("IN_BIT@"), True, True, True, True, True),
    "input word": (common("IN_WORD%"), 77, 77, 77, 77, 77),
    "output word": (common("OUT%"), 21, 0, 0, 0, 0),
    "user data": (common("USER%"), 55, 0, 0, 0, 0),
    "event that was set": (pending, ("GO",), (), (), (), ()),
    "FORCINGSTATUS@": (common("FORCINGSTATUS@"), True, True, True, True, False),
    "BATTERYSTATUS0@": (common("BATTERYSTATUS0@"), True, True, True, True, False),
    "BATTERYSTATUS1@": (common("BATTERYSTATUS1@"), True, True, True, True, False),
    "AUTORUNSTATUS@": (common("AUTORUNSTATUS@"), False, False, False, False, False),
    "task in RUN": (status, Status.RUNNING, *([Status.STOPPED] * 4)),
}


def made(folder: Path) -> tuple[Rack, Retention]:
    rack = rack_from(folder, YAML, LINE=LINE, BREAK=BREAK, DRIVE=DRIVE)
    retention = Retention(rack, folder / "state")
    rack.start()
    rack.run(0.021)
    for name, value in GIVEN.items():
        rack.write(name, value)
    for name in ("V_TABLE%", "N_TABLE%"):
        rack.write(name, 6, element=2)
    rack.write("OUT%", 21)
    for name, value in FORCES:
        rack.force(name, value)
    rack.tune(rack.task("LINE"), "K%", 8)
    rack.tune(rack.task("LINE"), "G", 0.75)
    rack.tune(rack.task("DRIVE"), "K%", 8)
    rack.events.event("GO").set(rack.now_ns)
    return rack, retention


@pytest.fixture(scope="module", params=WAYS)
def lost(request, tmp_path_factory) -> tuple[int, dict[str, object], dict[str, object]]:
    """One way of losing data, by its column: what every cell held before and after."""
    rack, _ = made(tmp_path_factory.mktemp("rack"))
    before = {what: cell[0](rack) for what, cell in CELLS.items()}
    WAYS[request.param](rack)
    return list(WAYS).index(request.param), before, {what: cell[0](rack) for what, cell in CELLS.items()}


@pytest.mark.parametrize("what", CELLS)
def test_cell(lost, what):
    column, before, after = lost
    _, held, *left = CELLS[what]
    assert before[what] == held
    assert after[what] == left[column]


@pytest.mark.parametrize("way", WAYS)
def test_all_of_it_survives_the_process_as_it_survives_power(tmp_path, way):
    """The state of a run that ended, in another rack, is what a power cycle leaves."""
    rack, retention = made(tmp_path)
    WAYS[way](rack)
    assert retention.save()
    again = rack_at(tmp_path / "rack.yaml")
    again.start(Retention(again, tmp_path / "state").restore().settings)
    index = list(WAYS).index(way)
    for what, (read, _, *after) in CELLS.items():
        kind = what.split()[0]
        if kind in ("tunable", "forced", "non-volatile", "force") or what in ("error log", "UDC test switch"):
            assert read(again) == after[index], what
    begun = rack.task("LINE").value("BEGUN%")
    assert again.task("LINE").value("BEGUN%") == begun + 1, (
        "its start-up part ran once more, on the locals that were kept"
    )
