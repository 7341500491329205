"""Random tasks on a modeled Processor: commit times and overlaps, as table 4 and a simulator of its own say."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path

import pytest
from compile.support import repeatable
from hypothesis import given
from hypothesis import strategies as st

from automax_ros.rack.rack import Rack
from rack.helpers import Observer, rack_at

BLOCKS = {
    "SUMMER(INPUT1=A%, INPUT2=1, OUTPUT=B%)": (11_280, 44_000),
    "DIFFERENCE(INPUT1=A%, INPUT2=B%, OUTPUT=B%)": (10_800, 44_000),
    "LIMIT(INPUT=A%, LIMIT_PLUS=5, LIMIT_MINUS=0, OUTPUT=B%)": (18_200, 69_000),
    "AND(INPUT1=X@, INPUT2=-Y@, OUTPUT=Y@)": (10_800 + 2 * 1_880, 41_000 + 2 * 8_300),
    "OR(INPUT1=X@, INPUT2=-Y@, INPUT3=Y@, OUTPUT=Y@)": (10_240 + 3 * 1_880, 41_000 + 3 * 8_300),
    "RAMP(INPUT=A%, ACCEL_RATE=10, DECEL_RATE=10, OUTPUT=B%)": (27_720, 122_000),
    "LAG(INPUT=A%, WLG=2.0, OUTPUT=B%)": (26_520, 118_000),
    "LATCH(SET=X@, RESET=Y@, OUTPUT=Y@)": (15_040, 68_000),
    "TRANSITION(INPUT=X@, OUTPUT=Y@)": (11_360, 48_000),
    "PROP_INT(INPUT=A%, KP=1.5, WLD=2.0, RESET=X@, OUTPUT=B%)": (40_320, 193_000),
    "AMPLIFIER(INPUT1=A%, GAIN1=2, INPUT2=B%, GAIN2=3, OUTPUT=B%)": (13_160 + 2 * 3_120, 62_000 + 2 * 13_800),
    "SWITCH(INPUT1=A%, INPUT2=B%, SELECT=X@, OUTPUT=B%)": (11_520, 47_000),
    "MULTIPLY_DIVIDE(INPUT1=A%, INPUT2=3, INPUT3=2, OUTPUT=B%)": (13_760, 71_000),
    "COUNTER(INPUT_PLUS=A%, INPUT_MINUS=3, OUTPUT=B%)": (15_640, 61_000),
    "MOVE(ENABLE=X@, INPUT1=A%, OUTPUT1=B%, INPUT2=B%, OUTPUT2=A%)": (10_400 + 2 * 2_320, 39_000 + 2 * 11_000),
    "ALARM(INPUT=A%, HIGH_LIMIT=100, ALARM_HIGH=Y@)": (11_160 + 2_480, 44_000 + 11_000),
    "": (9_880, 40_000),
}
"""Blocks, and a remark as none, with their times on a 7010 and on a 6010, ns."""
AROUND = ((80_000 + 13_820, 326_000 + 60_000), (1_600 + 2_000, 2_400 + 3_200))
"""SCAN_LOOP and END together: themselves, and for each common."""
OF_TYPE = {
    "%": (2_500 + 1_600, 4_400 + 2_800),
    "@": (3_800 + 2_200, 6_800 + 4_300),
    "!": (4_100 + 2_500, 7_200 + 4_900),
}
MODULES = ("57C435", "57C431")
END_NS = 60_000_000


@dataclass(frozen=True)
class Written:
    """A task as it is written: ``others`` are the types of the commons that it declares next to its own."""

    name: str
    priority: int
    ticks: int
    others: str
    blocks: tuple[str, ...]

    def text(self) -> str:
        commons = ", ".join([f"{self.name}%", *(f"C{place}{kind}" for place, kind in enumerate(self.others))])
        calls = [f"CALL {block}" if block else "! A REMARK" for block in self.blocks]
        body = "".join(f"{100 + 10 * place} {call}\n" for place, call in enumerate(calls))
        own = f"30 CALL SUMMER(INPUT1={self.name}%, INPUT2=1, OUTPUT={self.name}%)\n"
        locals_ = "15 LOCAL A%, B%, X@, Y@\n"
        return f"10 COMMON {commons}\n{locals_}20 CALL SCAN_LOOP(TICKS={self.ticks})\n{own}{body}900 END\n"

    def scan_ns(self, column: int) -> int:
        """The sum of its times: each common counts once for being one, once for its type."""
        kinds = "%" + self.others
        commons = sum(AROUND[1][column] + OF_TYPE[kind][column] for kind in kinds)
        return (
            AROUND[0][column] + commons + (11_280, 44_000)[column] + sum(BLOCKS[item][column] for item in self.blocks)
        )


class Commits(Observer):
    """Notes when a scan wrote what it changed, and whose it was."""

    def __init__(self, rack: Rack) -> None:
        self.found: list[tuple[int, str]] = []
        rack.observe(self)

    def scanned(self, task, record, writes) -> None:  # noqa: ARG002
        self.found += [(item.time_ns, task.name) for item in writes if item.writer == task.writer]


@st.composite
def written(draw) -> list[Written]:
    count = draw(st.integers(1, 5))
    blocks = st.lists(st.sampled_from(sorted(BLOCKS)), max_size=25).map(tuple)
    others = st.text("%@!", max_size=6).map(lambda text: "".join(sorted(text)))
    names = draw(st.permutations(["AA", "BB", "CC", "DD", "EE"]))[:count]
    return [
        Written(name, draw(st.integers(4, 7)), draw(st.integers(1, 5)), draw(others), draw(blocks)) for name in names
    ]


def simulated(tasks: list[Written], tick_ns: int, column: int) -> tuple[list[tuple[int, str]], tuple[int, str] | None]:
    """When each scan ends, and the overlap that ends it all: goes from instant to instant, with what is left of each.

    What is ready runs by priority; of equals the one that has begun, then by name. What ends at an instant has ended
    when a scan is due there.
    """
    left: dict[str, int] = {}
    begun: set[str] = set()
    by_name = {task.name: task for task in tasks}
    periods = {task.name: task.ticks * tick_ns for task in tasks}
    order = sorted(tasks, key=lambda task: (task.priority, task.name))
    ends: list[tuple[int, str]] = []
    now = 0
    while now < END_NS:
        for task in order:
            if now % periods[task.name] == 0:
                if task.name in left:
                    return ends, (now, task.name)
                left[task.name] = task.scan_ns(column)
                if min(left, key=lambda name: (by_name[name].priority, name not in begun, name)) == task.name:
                    begun.add(task.name)
        due = min((now // period + 1) * period for period in periods.values())
        while left and now < due:
            first = min(left, key=lambda name: (by_name[name].priority, name not in begun, name))
            begun.add(first)
            step = min(left[first], due - now)
            now, left[first] = now + step, left[first] - step
            if not left[first]:
                del left[first]
                begun.discard(first)
                ends.append((now, first))
        if left:  # what begins right when another has ended has begun before what becomes due then
            begun.add(min(left, key=lambda name: (by_name[name].priority, name not in begun, name)))
        now = due
    return [end for end in ends if end[0] < END_NS], None


def built(tasks: list[Written], tick_ms: str, column: int, folder: Path) -> Rack:
    kinds = sorted({f"C{place}{kind}" for task in tasks for place, kind in enumerate(task.others)})
    commons = "".join(f"  {name}: {{}}\n" for name in [*(f"{task.name}%" for task in tasks), *kinds])
    listed = "".join(f"      {task.name}: {{priority: {task.priority}}}\n" for task in tasks)
    head = f"rack: R\nexecution: modeled\nslots:\n  0:\n    module: {MODULES[column]}\n    tick_ms: {tick_ms}\n"
    (folder / "rack.yaml").write_text(f"{head}    tasks:\n{listed}common:\n{commons}")
    for task in tasks:
        (folder / f"{task.name}.BLK").write_text(task.text())
    return rack_at(folder / "rack.yaml")


def commits_as_simulated(tasks: list[Written], tick_ms: str, column: int) -> None:
    with tempfile.TemporaryDirectory() as name:
        rack = built(tasks, tick_ms, column, Path(name))
    seen = Commits(rack)
    rack.start()
    rack.run(END_NS / 1e9)
    ends, overlap = simulated(tasks, round(float(tick_ms) * 1e6), column)
    stopped = rack.operations.stopped
    assert (None if stopped is None else (stopped.time_ns, stopped.task, stopped.code)) == (
        None if overlap is None else (*overlap, "14")
    )
    assert seen.found == ends


@pytest.mark.parametrize("column", [0, 1], ids=MODULES)
@given(written(), st.sampled_from(["0.5", "1.0", "2.5", "5.5"]))
@repeatable(25)
def test_random_tasks_commit_when_a_simulator_says(column, tasks, tick_ms):
    commits_as_simulated(tasks, tick_ms, column)


@pytest.mark.soak
@pytest.mark.timeout(1200)
@pytest.mark.parametrize("column", [0, 1], ids=MODULES)
@given(written(), st.sampled_from(["0.5", "1.0", "1.5", "2.5", "5.5"]))
@repeatable(1500)
def test_random_tasks_commit_when_a_simulator_says_long(column, tasks, tick_ms):
    commits_as_simulated(tasks, tick_ms, column)
