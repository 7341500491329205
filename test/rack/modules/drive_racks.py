"""A rack with a drive, and a loop by hand in the place of a CML task: it does what the task does with the module."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from automax_ros.drive.current_loop.inputs import Inputs
from automax_ros.drive.current_loop.minor_loop import CurrentMinorLoop
from automax_ros.drive.current_loop.signals import Command, Measured
from automax_ros.rack.modules.drive import DriveControllerModule
from automax_ros.rack.rack import Rack
from automax_ros.runtime.time.scheduler import EventClass, EventKey
from rack.helpers import rack_from, run_for

YAML = """\
rack: PM1
slots:
  0: {module: 57C435, tasks: {IDLE: {priority: 8}}}
  7: {module: 57C406, plant: UNWIND}
  8: {module: 57C408}
  9: {module: 57C405, drive: 7}
plants:
  UNWIND: {motor: dc_150hp_500v, inertia: 3.0, PLANT}
common:
  TLD%: {slot: 7, register: 4136}
  PLLP%: {slot: 7, register: 4137}
  PLLT%: {slot: 7, register: 4138}
  FAST@: {slot: 7, register: 4146, bit: 0}
  PERMIT@: {slot: 8, register: 0, bit: 0, ros: in}
  IET@: {slot: 8, register: 0, bit: 1, ros: in}
  FMCR@: {slot: 8, register: 1, bit: 0}
  RMCR@: {slot: 8, register: 1, bit: 1}
  OK@: {slot: 8, register: 1, bit: 2}
  LAMP@: {slot: 8, register: 1, bit: 7}
  ARM_V%: {slot: 9, register: 0}
"""
IDLE = "10 COMMON LAMP@\n100 CALL SCAN_LOOP(TICKS=1)\n110 END\n"
CYCLE_NS = 1_000_000_000 / 360
"""A sixth of a cycle at 60 Hz."""
INPUTS = Inputs(
    io_cntl_slot=7, dig_io_slot=8, ac_line_freq=60, reference=0, ref_rate=0.0, ref_lag=400.0, kp=0.2, pi_w_lead=50.0,
    ag_factor=20, cc_thresh=680, cml_run=False, cml_coast_stop=False, mcr_select=False, max_m_dropout=0.1,
    cml_test=False, test_brpol=False, test_alpha=180, ioc_thresh=250, lim_bar=150, digital_tach=True, speed_fdbk=None,
    tach_loss_stop=True, osv_fdbk=None, osv_thresh=0, nonstand_phrot=False, auto_phrot=False, fault_reset=False,
)  # fmt: skip


def built(folder: Path, *, yaml: str = YAML, plant: str = "", task: str = IDLE) -> Rack:
    """Return a rack that was not started."""
    return rack_from(folder, yaml.replace(", PLANT", f", {plant}" if plant else ""), IDLE=task)


def controller(rack: Rack, slot: int = 7) -> DriveControllerModule:
    """Return the 57C406 of a slot."""
    module = next(item for item in rack.modules if item.config.slot == slot)
    assert isinstance(module, DriveControllerModule)
    return module


class Hand:
    """A current minor loop that scans at each interrupt; ``set`` changes its inputs."""

    def __init__(self, rack: Rack, **inputs: Any) -> None:
        """Begin with a loop at rest."""
        self.rack, self.port = rack, rack.drives.port(7)
        self.loop = CurrentMinorLoop()
        self.inputs = INPUTS._replace(**inputs)
        self.seen: list[tuple[int, Measured, Command]] = []

    def arm(self, first_ns: int) -> Hand:
        """Let the module interrupt."""
        self.port.arm(first_ns, EventKey(EventClass.SCAN, 4, "CML"), self.due)
        return self

    def set(self, **inputs: Any) -> None:
        """Change inputs."""
        self.inputs = self.inputs._replace(**inputs)

    def due(self, now_ns: int, _: int) -> None:
        """Scan."""
        measured = self.port.measure(self.inputs.dig_io_slot)
        outcome = self.loop.scan(now_ns, measured, self.inputs)
        if outcome.initialised:
            self.port.initialise()
        self.port.command(outcome.command)
        self.seen.append((now_ns, measured, outcome.command))

    @property
    def running(self) -> bool:
        """DC_CML_STATE."""
        return bool(self.loop.sequence.running)


def turning(folder: Path, seconds: float = 1.0, **inputs: Any) -> tuple[Rack, Hand]:
    """Return a rack whose drive has been started and turns its motor for some time."""
    rack = run_for(built(folder))
    hand = Hand(rack, **inputs).arm(0)
    rack.write("PERMIT@", True)
    rack.run(0.6)
    hand.set(cml_run=True)
    rack.run(0.5)
    assert hand.running
    hand.set(reference=1500)
    rack.run(seconds)
    return rack, hand
