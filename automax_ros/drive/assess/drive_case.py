"""A drive as its set-up is judged: what is known of it, and what came out of one rule."""

from __future__ import annotations

import enum
from collections.abc import Mapping
from dataclasses import dataclass, field
from math import pi

from automax_ros.drive.assess.limits import DEFAULT_PERIOD_STEP_US, DEFAULT_PHASE_STEP_US, DEFAULT_THRESHOLD_DEG
from automax_ros.drive.base.nameplate import DriveParameters


class Verdict(enum.Enum):
    """How a drive stands to a rule."""

    FINE = "fine"
    ATTENTION = "attention"
    """A person should look at it: it depends on what is not known here."""
    WRONG = "wrong"
    """The drive will not run, trip, or is not safe."""


@dataclass(frozen=True)
class Given:
    """What is programmed: its value, None where that is not known, and in words where it comes from."""

    value: float | None
    text: str


@dataclass(frozen=True)
class Computing:
    """How long a scan computes until the 57C406 has its DELTA.

    Attributes:
        modeled: whether the rack's execution takes that time; in ideal execution it is none.
        model: the Processor that runs the task.
        delay_us: the time on that Processor, us.
        slowest: the slowest Processor that may run it.
        slowest_us: the time there, us.
        sixth_us: the time from scan to scan, a sixth of a line cycle, us.
    """

    modeled: bool
    model: str
    delay_us: float
    slowest: str
    slowest_us: float
    sixth_us: float

    @property
    def execution(self) -> str:
        """The rack's mode of execution."""
        return "modeled" if self.modeled else "ideal"


@dataclass(frozen=True)
class DriveCase:
    """A drive, as far as it is known.

    Attributes:
        name: its plant.
        where: the module that fires it, in words.
        parameters: the motor and its line.
        inertia: inertia of motor and load over the motor's own.
        source_ohm: resistance of a phase of the line, ohm.
        task: the task with its current minor loop, "" where that is not a task's.
        inputs: the inputs of DC_DRIVE_CML by keyword, those not programmed left out.
        threshold: register 4136.
        phase_step: register 4137.
        period_step: register 4138.
        fast_change: bit 0 of register 4146; value None where it may be either.
        voltage: whether the armature voltage is wired to a 57C405.
        registers: whether it is driven by a 57C406, with registers and a loop in a task.
        computing: how long the scans of that task compute, None without one.
    """

    name: str
    where: str
    parameters: DriveParameters
    inertia: float = 1.0
    source_ohm: float = 0.0
    task: str = ""
    inputs: Mapping[str, Given] = field(default_factory=dict)
    threshold: Given = Given(DEFAULT_THRESHOLD_DEG, "default")
    phase_step: Given = Given(DEFAULT_PHASE_STEP_US, "default")
    period_step: Given = Given(DEFAULT_PERIOD_STEP_US, "default")
    fast_change: Given = Given(0, "default")
    voltage: bool = False
    registers: bool = True
    computing: Computing | None = None

    @property
    def armature_v(self) -> float:
        """Rated armature voltage, V."""
        values = self.parameters.values
        return values["emf_v"].value + values["resistance_ohm"].value * self.parameters.amps

    @property
    def base_rpm(self) -> float:
        """Base speed, rpm."""
        return self.parameters.values["base_speed_rad_s"].value * 30 / pi

    @property
    def rated_n_m(self) -> float:
        """Rated torque at the shaft, N m."""
        return self.parameters.values["shaft_torque_n_m"].value

    @property
    def most_n_m(self) -> float:
        """Torque that the armature makes of its rated current with the whole field, N m, friction not taken off."""
        return self.parameters.motor.k_v_s * self.parameters.amps

    @property
    def loop_inductance_h(self) -> float:
        """Armature and two phases of the source, H."""
        return self.parameters.motor.inductance_h + 2 * self.parameters.source_h

    def value(self, keyword: str) -> float | None:
        """Return the value of an input; None where it is not programmed or not known."""
        given = self.inputs.get(keyword)
        return None if given is None else given.value

    def text(self, keyword: str) -> str:
        """Return what is known of an input, in words."""
        given = self.inputs.get(keyword)
        return "not known" if given is None else given.text


@dataclass(frozen=True)
class Finding:
    """What came out of one rule.

    Attributes:
        rule: what was looked at, in a few words.
        verdict: how it stands.
        result: what was found, in a sentence.
        formula: the manual's formula and where it stands.
        numbers: the same with numbers; "" where one is not known.
        values: what a program may want to know, by name with its unit.
    """

    rule: str
    verdict: Verdict
    result: str
    formula: str
    numbers: str = ""
    values: Mapping[str, float | None] = field(default_factory=dict)


@dataclass(frozen=True)
class Unjudged:
    """A drive that nothing can be computed of: its name, its module, and why."""

    name: str
    where: str
    reason: str


@dataclass(frozen=True)
class DriveFindings:
    """All that was found of one drive; ``case`` is None where nothing could be computed."""

    name: str
    where: str
    case: DriveCase | None
    findings: tuple[Finding, ...]

    @property
    def verdict(self) -> Verdict:
        """The worst one."""
        return max((item.verdict for item in self.findings), key=list(Verdict).index, default=Verdict.FINE)
