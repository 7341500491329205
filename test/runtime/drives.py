"""What the tests of current minor loop tasks share: a task, and a 57C406 of their own with a plant."""

from __future__ import annotations

from compile.support import OTHER, WRITER, program_of, views_of

from automax_ros.compile.base.cost import CostModel
from automax_ros.compile.compiler import compile_program
from automax_ros.core.types import Value
from automax_ros.drive.base.nameplate import EXAMPLES, derive
from automax_ros.drive.current_loop.signals import PERMISSIVE, Command, Measured
from automax_ros.drive.plant.controller import DriveController
from automax_ros.drive.plant.plant import DrivePlant, PlantData
from automax_ros.runtime.memory.memory import CommonMemory
from automax_ros.runtime.scan.drives import Drives
from automax_ros.runtime.tasks.cml_task import CmlTask
from automax_ros.runtime.time.scheduler import EventKey, PeriodicAction

REGISTERS = (109, 4, 2, 0)
CML = """10 COMMON REF%, RUN@, RESET@, SPEED%, OSV%, STATE@, LOCKED@, PERIOD%, CURRENT%, DELTA%, DIAG%(37,1)
20 LOCAL SCANS%, LAST_DELTA%
30 SCANS% = 0
1000 CALL DC_DRIVE_CML(IO_CNTL_SLOT=7, DIG_IO_SLOT=8, REFERENCE=REF%, REF_LAG=400.0, KP=0.2, PI_W_LEAD=50.0, &
 AG_FACTOR=20, CC_THRESH=680, CML_RUN=RUN@, IOC_THRESH=250, LIM_BAR=150, SPEED_FDBK=SPEED%, OSV_FDBK=OSV%, &
 OSV_THRESH=5000, FAULT_RESET=RESET@, DC_CML_STATE=STATE@, SYNC_LOCKED=LOCKED@, LINE_PERIOD=PERIOD%, &
 I_FDBK=CURRENT%, DELTA=DELTA%, DIAG_DATA=DIAG%)
1010 SCANS% = SCANS% + 1
1020 LAST_DELTA% = DELTA%
1030 END
"""


class PlantPort:
    """A 57C406 with a plant whose shaft hardly moves; the test itself says when it interrupts."""

    next_ns = None

    def __init__(self, status: int = PERMISSIVE) -> None:
        self.plant = DrivePlant(PlantData(derive(EXAMPLES["150hp"]), inertia=1000.0))
        self.controller = DriveController(self.plant)
        self.registers = REGISTERS
        self.status = status
        self.now_ns = 0
        self.measured: Measured | None = None
        self.commands: list[Command] = []
        self.calls: list[str] = []
        self.dig_slots: set[int] = set()

    def initialise(self) -> None:
        self.calls.append("initialise")
        self.registers = REGISTERS

    def watch_speed(self, counts: int) -> None:
        self.controller.overspeed.counts = counts

    def arm(self, first_ns: int, key: EventKey, due: PeriodicAction) -> None:  # noqa: ARG002
        self.calls.append("arm")

    def disarm(self) -> None:
        self.calls.append("disarm")

    def interrupt(self, now_ns: int) -> None:
        self.now_ns = now_ns
        self.measured = None

    def measure(self, dig_slot: int) -> Measured:
        self.dig_slots.add(dig_slot)
        if self.measured is None:
            self.measured = self.controller.measure(self.now_ns, self.status, self.registers)
        return self.measured

    def command(self, command: Command) -> None:
        self.commands.append(command)
        self.controller.command(command, self.now_ns, self.now_ns)


def cml_task(
    text: str = CML, *, port: PlantPort | None = None, cost_model: CostModel | None = None, **commons: Value
) -> tuple[CmlTask, CommonMemory, PlantPort]:
    """A task in a memory of its own commons, with a 57C406 in slot 7."""
    program = program_of(text)
    memory = CommonMemory(views_of(program))
    views = {spec.name: memory.view(spec.name) for spec in views_of(program)}
    for name, value in commons.items():
        memory.write_from_outside(views[name], value, OTHER)
    drives, port = Drives(), port or PlantPort()
    drives.attach(7, port)
    compiled = compile_program(program, views, cost_model)
    return CmlTask(compiled, memory, writer=WRITER, drives=drives), memory, port


def scans(task: CmlTask, port: PlantPort, until_ns: int, modeled: bool = False):
    """Scan at each interrupt up to an instant, the first at the port's present; yields the records."""
    now_ns = port.now_ns
    while now_ns < until_ns:
        port.interrupt(now_ns)
        if modeled:
            yield finished(task.scan_modeled(now_ns))
        else:
            yield task.scan(now_ns)
        if not port.commands:
            return
        now_ns += port.commands[-1].next_ns
    port.now_ns = now_ns


def finished(steps, times=()):
    """The record of a scan in steps; it is sent the times one after the other, then None."""
    sent = iter(times)
    try:
        next(steps)
        while True:
            steps.send(next(sent, None))
    except StopIteration as end:
        return end.value
