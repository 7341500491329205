"""A drive on the bench: plant, 57C406 and current minor loop, with the inputs in a test's hand; no rack."""

from dataclasses import dataclass, replace

from automax_ros.drive.base.nameplate import EXAMPLES, derive
from automax_ros.drive.current_loop import proposals
from automax_ros.drive.current_loop.inputs import Inputs
from automax_ros.drive.current_loop.minor_loop import CurrentMinorLoop
from automax_ros.drive.current_loop.signals import PERMISSIVE, Command, Measured
from automax_ros.drive.plant.controller import DriveController
from automax_ros.drive.plant.plant import DrivePlant, PlantData

LIM_BAR = 150
HELD = 1e6
"""Inertia over the motor's own with which the speed is as good as held."""


def parameters_of(size="150hp", hertz=60):
    return derive(replace(EXAMPLES[size], line_hz=hertz))


def inputs_of(parameters, lim_bar=LIM_BAR, **changes):
    """Inputs with the gains that are proposed for a motor, and no reference."""
    circuit = proposals.circuit_of(parameters, lim_bar)
    given = {
        "io_cntl_slot": 7, "dig_io_slot": 8, "ac_line_freq": round(parameters.line_hz), "reference": 0, "ref_rate": 0.0,
        "ref_lag": float(proposals.ref_lag(circuit)), "kp": proposals.kp(circuit),
        "pi_w_lead": float(proposals.pi_w_lead(circuit)), "ag_factor": proposals.ag_factor(circuit),
        "cc_thresh": proposals.cc_thresh(circuit), "cml_run": False, "cml_coast_stop": False, "mcr_select": False,
        "max_m_dropout": 0.1, "cml_test": False, "test_brpol": False, "test_alpha": 180, "ioc_thresh": 250,
        "lim_bar": lim_bar, "digital_tach": True, "speed_fdbk": None, "tach_loss_stop": True, "osv_fdbk": None,
        "osv_thresh": 0, "nonstand_phrot": False, "auto_phrot": False, "fault_reset": False,
    }  # fmt: skip
    return Inputs(**given | changes)


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


class Bench:
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
        self.late_ns = late_ns
        self.plant = DrivePlant(PlantData(self.parameters, inertia=inertia), energy=energy)
        self.hardware = DriveController(self.plant)
        self.loop = CurrentMinorLoop(tests_scrs=tests_scrs)
        self.inputs = inputs_of(self.parameters, lim_bar, **inputs)
        self.status = PERMISSIVE
        self.registers = (109, 4, 2, 0)
        self.now_ns = 0
        self.scans = []
        self.outputs = ()

    def set(self, **inputs):
        """Change inputs."""
        self.inputs = self.inputs._replace(**inputs)

    def emf(self, volts):
        """Let the motor turn at the speed that makes an EMF."""
        self.plant.motor.speed_rad_s = volts / self.parameters.motor.k_v_s

    def scan(self):
        """Execute a scan and let time pass to the next interrupt."""
        measured = self.hardware.measure(self.now_ns, self.status, self.registers)
        outcome = self.loop.scan(self.now_ns, measured, self.inputs)
        self.hardware.command(outcome.command, self.now_ns, self.now_ns + self.late_ns)
        if outcome.outputs is not None:
            self.outputs = outcome.outputs
        control = self.loop.control
        made = Scan(
            self.now_ns, measured, outcome.command, control.i_fdbk, control.chain.lag_out, control.delta_us,
            control.bridge, outcome.problems,
        )  # fmt: skip
        self.scans.append(made)
        self.now_ns += outcome.command.next_ns
        return made

    def run(self, seconds):
        """Execute the scans of a time; return them."""
        before, end_ns = len(self.scans), self.now_ns + round(seconds * 1e9)
        while self.now_ns < end_ns:
            self.scan()
        return self.scans[before:]

    def start(self):
        """Lock, close the contactor, run."""
        self.run(0.5)
        self.set(cml_run=True)
        self.run(0.3)
        assert self.loop.sequence.running
