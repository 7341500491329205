"""Modeled execution of random racks: without costs it is ideal execution; from any state it goes on bit for bit."""

from __future__ import annotations

import copy
import tempfile
from pathlib import Path

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from automax_ros.rack.rack import Rack
from automax_ros.rackfile.model.config import RackConfig
from automax_ros.runtime.scan.modeled_execution import ModeledExecution
from rack.helpers import Observer, config_at

HEAD = """\
10 COMMON A%, B%, C%, D!, X@, R, T%(5)
11 EVENT NAME=GO
12 LOCAL N%, M%, OUT%, L%(4), Q, S$
"""
STATEMENTS = [
    "A% = B% + 1",
    "B% = 30000 + A%",
    "T%(N%) = A%",
    "C% = T%(2) + T%(N%)",
    "N% = N% + 1",
    "IF N% > 4 THEN N% = 0",
    "L%(N%) = L%(1) + C%",
    "R = R + 0.5",
    "Q = R * 2.0 + Q",
    "IF X@ THEN B% = 0",
    "X@ = NOT X@",
    "SET GO",
    "PRINT A%, N%",
    "IF TST_ERRLOG@ THEN CLR_ERRLOG",
    "FOR M% = 0 TO 3\n{line1} T%(M%) = T%(M%) + L%(M%)\n{line2} NEXT M%",
    "CALL SUMMER(INPUT1=A%, INPUT2=1, OUTPUT=A%)",
    "CALL SUMMER(INPUT1=B%, INPUT2=N%, OUTPUT=C%)",
    "D! = D! + A%",
    "CALL AND(INPUT1=X@, INPUT2=-X@, OUTPUT=X@)",
    "CALL RAMP(INPUT=A%, ACCEL_RATE=10, OUTPUT=OUT%)",
    "CALL RUNNING_AVERAGE(INPUT=OUT%, REQUIRED_SAMPLES=3, OUTPUT=C%)",
]
BACKGROUND = """\
10 COMMON A%, T%(5), R
20 EVENT NAME=GO
25 LOCAL N%, V%
30 OPEN CHANNEL FOR INPUT AS FILE #1, TYPE=(I), DEPTH=2
40 FOR N% = 0 TO 20
50 V% = V% + A% - T%(3)
60 T%(3) = V% / 2
70 NEXT N%
80 DELAY 1 TICKS
90 R = R + 1.0
100 IF R < 4.0 THEN GOTO 40
110 WAIT ON GO
120 GOTO 40
130 END
"""


@st.composite
def control_tasks(draw) -> str:
    lines, number = [], 100
    for statement in draw(st.lists(st.sampled_from(STATEMENTS), min_size=1, max_size=7)):
        lines.append(f"{number} " + statement.format(line1=number + 1, line2=number + 2))
        number += 10
    ticks = draw(st.integers(4, 9))
    return f"{HEAD}50 CALL SCAN_LOOP(TICKS={ticks})\n" + "\n".join(lines) + "\n30000 END\n"


task_sets = st.lists(st.tuples(st.integers(1, 2), st.integers(4, 7), control_tasks()), min_size=1, max_size=4)
"""Slot, priority and text of each task."""
properties = settings(
    deadline=None,
    derandomize=True,
    max_examples=25,
    database=None,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large],
)


FOLDERS = tempfile.TemporaryDirectory()
"""Sources are read whenever a rack is built, so they stay until the tests have ended."""


def config_of(tasks, execution: str) -> RackConfig:
    folder = Path(tempfile.mkdtemp(dir=FOLDERS.name))
    listed: dict[int, list[str]] = {1: ["BACK: {priority: 11, file: BACK.BAS}"], 2: []}
    (folder / "BACK.BAS").write_text(BACKGROUND)
    for number, (slot, priority, text) in enumerate(tasks):
        (folder / f"T{number}.BLK").write_text(text)
        listed[slot].append(f"T{number}: {{priority: {priority}}}")
    path = folder / "rack.yaml"
    path.write_text(
        f"rack: R\nexecution: {execution}\nslots:\n  0: {{module: 57C413}}\n"
        f"  1: {{module: 57C435, tick_ms: 0.5, tasks: {{{', '.join(listed[1])}}}}}\n"
        f"  2: {{module: 57C431, tick_ms: 1.5, tasks: {{{', '.join(listed[2])}}}}}\n"
        "common:\n  A%: {}\n  B%: {}\n  C%: {}\n  D!: {}\n  X@: {}\n  R: {}\n  T%(5): {}\n"
    )
    return config_at(path)


class Notes(Observer):
    """All that observers of a rack are told."""

    def __init__(self, rack: Rack) -> None:
        self.entries: list[tuple[object, ...]] = []
        rack.observe(self)

    def scanned(self, task, record, writes) -> None:
        self.entries.append((task.name, copy.deepcopy(record)))
        self.written(writes)

    def written(self, writes) -> None:
        self.entries += [("write", *write[1:]) for group in writes for write in group.entries()]

    def operated(self, operation) -> None:
        self.entries.append(("operation", operation))


class Costless(Rack):
    """A rack with a Processor's time on which nothing takes any."""

    def _execution(self, module: str):
        return ModeledExecution(self.scheduler, module)


@given(task_sets)
@properties
def test_without_costs_modeled_execution_is_ideal_execution(tasks):
    """Records, writes, their instants and their order."""
    config = config_of(tasks, "ideal")
    racks = [Rack(config), Costless(config)]
    notes = [Notes(rack) for rack in racks]
    for rack in racks:
        rack.start()
        rack.scheduler.run_until(40_000_000)
    for entry in notes[1].entries:
        if len(entry) == 2 and hasattr(entry[1], "duration_ns"):
            assert entry[1].duration_ns == 0
    assert notes[1].entries == notes[0].entries
    assert racks[1].state() == racks[0].state()


@given(task_sets, st.integers(0, 30_000_000), st.booleans())
@properties
def test_a_state_in_the_middle_of_scans_goes_on_bit_for_bit(tasks, stop_ns, observed):
    """Also when somebody observes only from the state on."""
    config = config_of(tasks, "modeled")
    rack, twin = Rack(config), Rack(config)
    if observed:
        notes = Notes(rack), Notes(twin)
    rack.start()
    rack.scheduler.run_until(stop_ns)
    state = rack.state()
    twin.load(copy.deepcopy(state))
    assert twin.state() == state
    if observed:
        for note in notes:
            note.entries.clear()
    for one in (rack, twin):
        one.memory.keep_log()
        one.memory.drain()
        one.scheduler.run_until(stop_ns + 30_000_000)
    assert twin.state() == rack.state()
    assert [write[1:] for write in twin.memory.drain()] == [write[1:] for write in rack.memory.drain()]
    if observed:
        assert notes[1].entries == notes[0].entries


@given(task_sets, st.lists(st.integers(1, 40_000_000), max_size=12))
@properties
def test_time_may_pass_in_any_pieces(tasks, ends):
    config = config_of(tasks, "modeled")
    whole, cut = Rack(config), Rack(config)
    notes = Notes(whole), Notes(cut)
    for rack in (whole, cut):
        rack.start()
    for end in sorted(ends):
        cut.scheduler.run_until(end)
    for rack in (whole, cut):
        rack.scheduler.run_until(40_000_000)
    assert notes[1].entries == notes[0].entries
    assert cut.state() == whole.state()


@given(task_sets, st.lists(st.integers(1, 12_000_000), min_size=1, max_size=12))
@properties
def test_a_late_host_is_no_overlap(tasks, waits):
    """Where simulated time has none the wall clock has none, however late the host is; scans skipped are counted."""
    config = config_of(tasks, "modeled")
    simulated, live = Rack(config), Rack(config)
    for rack in (simulated, live):
        rack.start()
    now = 0
    for wait in waits:
        now += wait
        live.scheduler.run_due(now)
    simulated.scheduler.run_until(now + 1)
    if simulated.operations.stopped is None:
        assert live.operations.stopped is None
        for name, counts in live.statistics.items():
            if name != "BACK":
                in_time = simulated.statistics[name]
                assert abs(counts.scans + counts.skipped - in_time.scans) <= 1
