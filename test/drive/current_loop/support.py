"""A drive on the bench: plant, 57C406 and current minor loop, with the inputs in a test's hand; no rack."""

from dataclasses import dataclass, replace

from automax_ros.drive.base.nameplate import EXAMPLES, derive
from automax_ros.drive.current_loop import proposals
from automax_ros.drive.current_loop.signals import Command, Measured
from automax_ros.drive.plant.plant import DrivePlant, PlantData
from drive.current_loop.protected import INPUTS, Drive

LIM_BAR = 150
HELD = 1e6
"""Inertia over the motor's own with which the speed is as good as held."""


def parameters_of(size="150hp", hertz=60):
    return derive(replace(EXAMPLES[size], line_hz=hertz))


def inputs_of(parameters, lim_bar=LIM_BAR, **changes):
    """Inputs with the gains that are proposed for a motor, and no reference."""
    circuit = proposals.circuit_of(parameters, lim_bar)
    return INPUTS._replace(
        ac_line_freq=round(parameters.line_hz),
        ref_lag=float(proposals.ref_lag(circuit)),
        kp=proposals.kp(circuit),
        pi_w_lead=float(proposals.pi_w_lead(circuit)),
        ag_factor=proposals.ag_factor(circuit),
        cc_thresh=proposals.cc_thresh(circuit),
        lim_bar=lim_bar,
        **changes,
    )


@dataclass
class Scan:
    """What one scan saw and did; ``feedback``, ``delta_us`` and ``bridge`` as they stood after it."""

    now_ns: int
    measured: Measured
    command: Command
    feedback: int
    wanted: float
    delta_us: float
    bridge: int
    problems: tuple[int, ...]


class Bench(Drive):
    """A drive that runs; ``scans`` keeps every scan."""

    def __init__(
        self,
        size="150hp",
        hertz=60,
        *,
        inertia=HELD,
        tests_scrs=False,
        energy=False,
        lim_bar=LIM_BAR,
        inductance_h=None,
        late_ns=0,
        **inputs,
    ):
        """``inductance_h`` replaces the armature's; commands come ``late_ns`` after their interrupts."""
        self.parameters = parameters_of(size, hertz)
        if inductance_h is not None:
            motor = replace(self.parameters.motor, inductance_h=inductance_h)
            self.parameters = replace(self.parameters, motor=motor)
        plant = DrivePlant(PlantData(self.parameters, inertia=inertia), energy=energy)
        super().__init__(plant=plant, tests_scrs=tests_scrs)
        self.late_ns = late_ns
        self.inputs = inputs_of(self.parameters, lim_bar, **inputs)
        self.scans = []

    def set(self, **inputs):
        """Change inputs."""
        self.inputs = self.inputs._replace(**inputs)

    def emf(self, volts):
        """Let the motor turn at the speed that makes an EMF."""
        self.plant.motor.speed_rad_s = volts / self.parameters.motor.k_v_s

    def scan(self):
        """Execute a scan and let time pass to the next interrupt."""
        now_ns = self.now_ns
        outcome = super().scan()
        control = self.loop.control
        made = Scan(
            now_ns, self.measured, outcome.command, control.i_fdbk, control.chain.lag_out, control.delta_us,
            control.bridge, outcome.problems,
        )  # fmt: skip
        self.scans.append(made)
        return made

    def start(self):
        """Lock, close the contactor, run."""
        self.run(0.5)
        self.set(cml_run=True)
        self.run(0.3)
        assert self.loop.sequence.running
