"""The data by which a drive's set-up is judged, and the findings of the rules."""

from __future__ import annotations

import enum
from collections.abc import Mapping
from dataclasses import dataclass, field
from math import pi

from automax_ros.drive.assess.limits import DEFAULT_PERIOD_STEP_US, DEFAULT_PHASE_STEP_US, DEFAULT_THRESHOLD_DEG
from automax_ros.drive.base.nameplate import DriveParameters
from automax_ros.drive.web.data import Roll


class Rating(enum.Enum):
    """Result of a rule for a drive."""

    FINE = "fine"
    ATTENTION = "attention"
    """To be checked by a person: it depends on data that are not known here."""
    WRONG = "wrong"
    """The drive will not run, will trip, or is not safe."""


@dataclass(frozen=True)
class GivenValue:
    """A programmed input: its value, None where that is not known, and its origin in words."""

    value: float | None
    text: str


@dataclass(frozen=True)
class Computing:
    """The time that a scan computes until the 57C406 has its DELTA.

    Attributes:
        modeled: whether the rack's execution takes that time; in ideal execution it takes none.
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
class RollCase:
    """The roll of a drive, its web, and the scales of what its tasks read.

    Attributes:
        roll: the roll.
        gear: turns of the motor per turn of the roll.
        full_m: diameter of the full roll: what an unwinder begins with, or what a winder ends with.
        stiffness_n: of its web, N; None without a web.
        length_m: of its web.
        counts_rpm: counts of the motor's speed per rpm; None where no feed of it has a scale.
        counts_n: counts of the web's tension per N; None where no feed of it has a scale.
    """

    roll: Roll
    gear: float
    full_m: float
    stiffness_n: float | None = None
    length_m: float = 1.0
    counts_rpm: float | None = None
    counts_n: float | None = None


@dataclass(frozen=True)
class DriveCase:
    """The known data of a drive.

    Attributes:
        name: name of its plant.
        where: the module that fires it, in words.
        parameters: the motor and its line.
        inertia: inertia of motor and load over the motor's own.
        source_ohm: resistance of a phase of the line, ohm.
        task: the task with its current minor loop, "" where no task has it.
        inputs: the inputs of DC_DRIVE_CML by keyword, those not programmed left out.
        threshold: register 4136.
        phase_step: register 4137.
        period_step: register 4138.
        fast_change: bit 0 of register 4146; value None where it may be either.
        voltage: whether the armature voltage is wired to a 57C405.
        registers: whether it is driven by a 57C406, with registers and a loop in a task.
        computing: how long the scans of that task compute, None without one.
        roll: the roll that the motor turns, None without one.
    """

    name: str
    where: str
    parameters: DriveParameters
    inertia: float = 1.0
    source_ohm: float = 0.0
    task: str = ""
    inputs: Mapping[str, GivenValue] = field(default_factory=dict)
    threshold: GivenValue = GivenValue(DEFAULT_THRESHOLD_DEG, "default")
    phase_step: GivenValue = GivenValue(DEFAULT_PHASE_STEP_US, "default")
    period_step: GivenValue = GivenValue(DEFAULT_PERIOD_STEP_US, "default")
    fast_change: GivenValue = GivenValue(0, "default")
    voltage: bool = False
    registers: bool = True
    computing: Computing | None = None
    roll: RollCase | None = None

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
        """Torque of the armature at its rated current with the full field, N m, friction not subtracted."""
        return self.parameters.motor.k_v_s * self.parameters.amps

    @property
    def loop_inductance_h(self) -> float:
        """Inductance of the armature and two phases of the source, H."""
        return self.parameters.motor.inductance_h + 2 * self.parameters.source_h

    def value(self, keyword: str) -> float | None:
        """Return the value of an input; None where it is not programmed or not known."""
        given = self.inputs.get(keyword)
        return None if given is None else given.value

    def text(self, keyword: str) -> str:
        """Return an input and its origin in words."""
        given = self.inputs.get(keyword)
        return "not known" if given is None else given.text


@dataclass(frozen=True)
class Finding:
    """The finding of one rule.

    Attributes:
        rule: the subject of the rule, in a few words.
        verdict: the result.
        result: what was found, in a sentence.
        formula: the manual's formula and its section.
        numbers: the formula with numbers; "" where one is not known.
        values: values for programs, by name with unit.
    """

    rule: str
    verdict: Rating
    result: str
    formula: str
    numbers: str = ""
    values: Mapping[str, float | None] = field(default_factory=dict)


@dataclass(frozen=True)
class Unjudged:
    """A drive for which nothing can be computed: its name, its module, and the reason."""

    name: str
    where: str
    reason: str


@dataclass(frozen=True)
class DriveFindings:
    """All findings for one drive; ``case`` is None where nothing could be computed."""

    name: str
    where: str
    case: DriveCase | None
    findings: tuple[Finding, ...]

    @property
    def verdict(self) -> Rating:
        """The worst one."""
        return max((item.verdict for item in self.findings), key=list(Rating).index, default=Rating.FINE)
