"""A drive on the bench whose plant, line and inputs a test breaks; outputs are told by name, as the block has them."""

from automax_ros.core.problems import PROBLEMS
from automax_ros.drive.base.nameplate import EXAMPLES, derive
from automax_ros.drive.current_loop.inputs import AT_REST
from automax_ros.drive.current_loop.minor_loop import CurrentMinorLoop
from automax_ros.drive.current_loop.outputs import OUTPUTS
from automax_ros.drive.current_loop.signals import PERMISSIVE
from automax_ros.drive.plant.controller import DriveController
from automax_ros.drive.plant.plant import DrivePlant, PlantData

INPUTS = AT_REST._replace(
    io_cntl_slot=7, dig_io_slot=8, ref_lag=400.0, kp=0.2, pi_w_lead=50.0, ag_factor=20, cc_thresh=680, ioc_thresh=250,
    lim_bar=150,
)  # fmt: skip
LOCKED_S = 0.5
"""Long enough for the line sync to lock."""
CLOSED_S = 0.06
"""Long enough from the edge of CML_RUN to the run, without a test of the SCRs."""


def inputs(**changes):
    """The inputs of a 150 hp drive, with changes."""
    return INPUTS._replace(**changes)


class Drive:
    """Plant, 57C406 and loop; ``log`` has the codes of what was logged, with their instants."""

    def __init__(self, size="150hp", *, inertia=1000.0, tests_scrs=False, plant=None, **changes):
        self.plant = plant or DrivePlant(PlantData(derive(EXAMPLES[size]), inertia=inertia))
        self.hardware = DriveController(self.plant)
        self.loop = CurrentMinorLoop(tests_scrs=tests_scrs)
        self.inputs = inputs(**changes)
        self.status = PERMISSIVE
        self.registers = (109, 4, 2, 0)
        self.now_ns = self.late_ns = 0
        self.rows = []
        self.records = []
        self.log = []

    def scan(self):
        """Execute a scan, let time pass to the next interrupt, return the outcome."""
        self.measured = self.hardware.measure(self.now_ns, self.status, self.registers)
        outcome = self.loop.scan(self.now_ns, self.measured, self.inputs)
        self.hardware.command(outcome.command, self.now_ns, self.now_ns + self.late_ns)
        if outcome.outputs is not None:
            self.rows.append((self.now_ns, dict(zip(OUTPUTS, outcome.outputs, strict=True))))
        if outcome.record is not None:
            self.records.append((self.now_ns, outcome.record))
        for number in outcome.problems:
            assert f"AMX{number}" in PROBLEMS
            self.log.append((self.now_ns, f"AMX{number}"))
        self.now_ns += outcome.command.next_ns
        return outcome

    def run(self, seconds, **changes):
        """Change inputs, then execute the scans of a time; return the outcomes."""
        self.inputs = self.inputs._replace(**changes)
        end_ns = self.now_ns + round(seconds * 1e9)
        outcomes = []
        while self.now_ns < end_ns:
            outcomes.append(self.scan())
        return outcomes

    def start(self, **changes):
        """Lock, then run with these inputs."""
        self.run(LOCKED_S, cml_run=False)
        self.run(CLOSED_S, cml_run=True, **changes)
        assert self["DC_CML_STATE"]
        return self

    def __getitem__(self, output):
        """An output as the last tick wrote it."""
        return self.rows[-1][1][output]

    @property
    def codes(self):
        """The codes that were logged."""
        return [code for _, code in self.log]

    @property
    def faults(self):
        """The fault outputs that are TRUE."""
        return {name for name, value in self.rows[-1][1].items() if name in CODES and value}

    @property
    def relay(self):
        """Whether the contactor's relay is on."""
        return self.loop.sequence.relays != 0


CODES = {
    "IOC_OUT": "AMX7110", "SYNC_LOSS_OUT": "AMX7111", "TACH_LOSS_OUT": "AMX7112", "OSV_OUT": "AMX7113",
    "EXT_IET_OUT": "AMX7114", "PHROT_FLT_OUT": "AMX7115", "BAD_SCR_OUT": "AMX7116",
}  # fmt: skip
"""The outputs of the drive faults, and what each is logged as."""


def tripped(drive, output):
    """Whether one fault is there alone, logged once, and the drive coasts."""
    return (
        drive.faults == {output}
        and drive.codes == [CODES[output]]
        and not drive["DC_CML_STATE"]
        and not drive.relay
        and drive.loop.sequence.phase == 0
    )


def resets(drive):
    """Whether FAULT_RESET takes the faults away."""
    drive.run(0.03, fault_reset=True)
    gone = not drive.faults
    drive.run(0.03, fault_reset=False)
    return gone


def starts_again(drive):
    """Whether the drive starts with an edge, and not before."""
    drive.run(0.5)
    waited = not drive.relay
    drive.run(0.02, cml_run=False)
    drive.run(0.2, cml_run=True)
    return waited and drive["DC_CML_STATE"]
