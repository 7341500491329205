"""The common clock: who drives it, since when it runs, and what happens where two do."""

from __future__ import annotations

from automax_ros.core.types import DataType
from automax_ros.runtime.memory.common_clock import CommonClock
from automax_ros.runtime.memory.memory import CommonMemory
from automax_ros.runtime.memory.views import Place, ViewSpec
from automax_ros.runtime.time.scheduler import Scheduler

INT = DataType.INTEGER
SPECS = (
    ViewSpec("SLOT:3%", INT, 4, is_array=True),
    ViewSpec("SLOT:4%", INT, 4, is_array=True),
    ViewSpec("ON3@", DataType.BOOLEAN, place=Place(0, 2, 6)),
    ViewSpec("ISCR4%", INT, place=Place(1, 3)),
)


class Clock:
    """A clock with two modules, and what it has told."""

    def __init__(self) -> None:
        self.scheduler, self.memory = Scheduler(), CommonMemory(SPECS)
        self.faults: list[tuple[str, str]] = []
        self.changes: list[int | None] = []
        self.clock = CommonClock(self.scheduler, self.memory, self.fault)
        self.clock.watch(lambda: self.changes.append(self.clock.since_ns))
        self.clock.add_enable("udc_3", 0, 2)
        self.clock.add_enable("udc_4", 1, 3)

    def fault(self, reason: str, code: str) -> None:
        self.faults.append((reason, code))
        self.memory.clear()

    def write(self, name: str, value: bool | int) -> None:
        self.memory.write_from_outside(self.memory.view(name), value, 0)


def test_the_clock_runs_from_the_write_of_the_bit_until_it_is_cleared():
    own = Clock()
    own.scheduler.run_until(1_300_000)
    own.write("ON3@", True)
    assert not own.clock.runs
    own.scheduler.run_until(1_300_001)
    assert own.changes == [1_300_000]
    assert own.clock.next_ns == 1_800_000
    own.scheduler.run_until(1_800_000)
    assert own.clock.next_ns == 2_300_000
    own.write("ON3@", False)
    own.scheduler.run_until(2_000_000)
    assert own.changes == [1_300_000, None]
    assert own.faults == []


def test_other_bits_of_the_register_do_not_matter():
    own = Clock()
    own.write("ISCR4%", ~0x40)
    own.scheduler.run_until(1)
    assert own.changes == []
    own.write("ISCR4%", -1)
    own.scheduler.run_until(2)
    assert own.changes == [1]


def test_a_second_driver_is_code_38_and_the_clock_stops():
    own = Clock()
    own.write("ON3@", True)
    own.scheduler.run_until(500)
    own.write("ISCR4%", 0x40)
    own.scheduler.run_until(1000)
    assert own.faults == [("udc_3 and udc_4 both drive the common clock (AMX7072)", "38")]
    assert own.changes == [0, None]
    assert not own.clock.runs


def test_the_drive_may_pass_from_one_module_to_the_other_in_one_instant():
    own = Clock()
    own.write("ON3@", True)
    own.scheduler.run_until(500)
    own.write("ISCR4%", 0x40)
    own.write("ON3@", False)
    own.scheduler.run_until(1000)
    assert own.faults == []
    assert own.changes == [0]


def test_a_state_taken_over_before_the_look_still_leads_to_it():
    own, other = Clock(), Clock()
    own.write("ON3@", True)
    other.memory.load_image(own.memory.image())
    other.clock.resume(own.clock.since_ns)
    other.scheduler.run_until(10)
    assert other.changes == [0]
    last = Clock()
    last.scheduler.run_until(10)
    last.memory.load_image(other.memory.image())
    last.clock.resume(other.clock.since_ns)
    last.scheduler.run_until(20)
    assert last.changes == []
    assert last.clock.since_ns == 0
