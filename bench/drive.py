"""Simulated seconds per wall second of line, bridge and motor: with a trivial controller, with CML, in a rack, by RK4.

The first table has both forms side by side, each in a separate process: compiled ahead of time (where it is built and
up to date), and plain Python. Then follow details of the form that this process runs.
"""

from __future__ import annotations

import gc
import sys
import tempfile
import time
from collections.abc import Callable, Generator
from contextlib import ExitStack
from functools import partial
from math import pi, sin, sqrt
from pathlib import Path

from _harness import ANSWER, Other, answer, wall_s

from automax_ros.drive.base.motor import Motor, MotorData
from automax_ros.drive.base.nameplate import EXAMPLES, derive
from automax_ros.drive.circuit.ac_line import AcLine
from automax_ros.drive.circuit.bridge import Bridge
from automax_ros.drive.circuit.circuit import Circuit
from automax_ros.drive.circuit.scr import mask_of
from automax_ros.drive.current_loop import proposals
from automax_ros.drive.current_loop.inputs import Inputs
from automax_ros.drive.current_loop.minor_loop import CurrentMinorLoop
from automax_ros.drive.current_loop.signals import PERMISSIVE
from automax_ros.drive.plant.controller import DriveController
from automax_ros.drive.plant.plant import DrivePlant, LoadData, PlantData
from automax_ros.messages.stream.stream import RackStream
from automax_ros.rack.rack import Rack
from automax_ros.rackfile.loader import load
from automax_ros.recordings.write.recorder import Recorder

PARAMETERS = derive(EXAMPLES["150hp"])
TORQUE = PARAMETERS.values["shaft_torque_n_m"].value
START_RAD_S = 170.0
SECONDS = 8.0
REPEATS = 8
FIRINGS_PER_S = 360
STEP_S = 20e-6
SOURCE_OHM = 0.003
CASES = (("rated torque, continuous current", 1.0, 1.0), ("5 % torque, discontinuous current", 0.05, 0.05))
"""The cases: load torque and current reference over rated."""
LOOP_CASES = (("60 % of LIM_BAR, continuous current", 2457), ("8 % of LIM_BAR, discontinuous current", 328))
"""The cases of the current minor loop: the reference in counts, at a held speed."""
SHORT_FIRINGS = 180
RACK_S = 1.0
"""Rack time of a measured run, s: a recording ends two chunks in it."""
BUDGET_S = 5.0
"""Wall time that each figure of the first table may take."""
TURNS = 5
"""Parts of this time in which both forms are measured in turn."""
WANTED = {"drive at rated torque": 1000, "drive with CML": 300}
RACK = Path(__file__).parent.parent / "config" / "dc_drive" / "rack.yaml"
PAIRS = [mask_of((number + 1, (number - 1) % 6 + 1)) for number in range(6)]
"""The pairs of SCRs fired one after the other, as by the 57C406."""
LIM_BAR = 150
HELD_RPM = 900.0


class Controller:
    """The simplest current controller: the firing delay moves in proportion to the error of the mean."""

    def __init__(self, reference: float) -> None:
        self.wanted = reference * PARAMETERS.amps
        self.alpha_us = 2000.0

    def next_ns(self, number: int, mean_a: float) -> int:
        """Return the instant of a firing, ns, with the delay adjusted by the mean current up to the last one."""
        self.alpha_us = min(max(self.alpha_us - 0.05 * (self.wanted - mean_a), 300.0), 5000.0)
        return number * 25_000_000 // 9 + int(self.alpha_us * 1000)


def circuit_of(torque: float) -> Circuit:
    """Return a circuit with a turning motor and a load torque over the rated one."""
    line = AcLine(PARAMETERS.line_v, inductance_h=PARAMETERS.source_h, resistance_ohm=SOURCE_OHM, angle_rad=-pi / 3)
    return Circuit(line, Bridge(), Motor(PARAMETERS.motor, load=torque * TORQUE, speed_rad_s=START_RAD_S))


def fastest(run: Callable[[], float]) -> float:
    """Return the least wall time (s) of many short runs: those disturbed by other work do not count."""
    end, best = time.perf_counter() + BUDGET_S / TURNS, float("inf")
    while time.perf_counter() < end:
        gc.collect()
        gc.disable()
        best = min(best, run())
        gc.enable()
    return best


Measured = Generator[float, None, None]
"""Yields simulated s per wall s, one measurement per request."""


def plant_rate() -> Measured:
    """Yield simulated s per wall s of the circuit at rated torque; nothing is timed within a run."""
    circuit, controller = circuit_of(1.0), Controller(1.0)
    number, mean = 0, 0.0

    def run() -> float:
        nonlocal number, mean
        began = time.perf_counter()
        for number in range(number, number + SHORT_FIRINGS):  # noqa: B020 - continues where the last run ended
            on_ns = controller.next_ns(number, mean)
            circuit.advance(on_ns)
            mean = circuit.sample().mean_current_a
            circuit.fire_mask(on_ns, on_ns + 60_000, PAIRS[number % 6])
        number += 1
        return time.perf_counter() - began

    while True:
        yield SHORT_FIRINGS / FIRINGS_PER_S / fastest(run)


def loop_rate() -> Measured:
    """Yield simulated s per wall s of plant, 57C406 and current minor loop in continuous current."""
    while True:
        yield 0.2 / fastest(lambda: loop(LOOP_CASES[0][1], 0.2)[0])


def rack_rate(*, recorded: bool = False) -> Measured:
    """Yield simulated s per wall s of the whole example rack with a drive, once its motor turns."""
    config = load(RACK).config
    assert config is not None
    rack = Rack(config)
    with tempfile.TemporaryDirectory() as temporary, ExitStack() as ends:
        if recorded:
            stream = RackStream(rack, rack.fingerprint)
            recording = Recorder(rack, stream, Path(temporary) / "bag")
            ends.callback(recording.close)
            stream.begin()
        rack.start()
        rack.run(5.0)
        while True:
            yield RACK_S / fastest(lambda: wall_s(lambda: rack.run(RACK_S)))


RATES: dict[str, Callable[[], Measured]] = {
    "drive at rated torque": plant_rate,
    "drive with CML": loop_rate,
    "config/dc_drive, the whole rack": rack_rate,
    "the same, recorded": partial(rack_rate, recorded=True),
}


def forms() -> None:
    """Print the rates in both forms, and how many times faster the compiled one is."""
    print(f"{'simulated s per wall s':34}{'compiled':>10}{'plain':>8}{'ratio':>8}{'wanted':>8}")
    with Other(__file__, {}) as ahead, Other(__file__, {"AUTOMAX_COMPILED": "off"}) as plain:
        for name in RATES:
            turns = [(ahead(name), plain(name)) for _ in range(TURNS)]
            best, slow = map(max, zip(*turns, strict=True))
            print(f"{name:34}{best:>10.0f}{slow:>8.0f}{best / slow:>8.1f}{WANTED.get(name, ''):>8}")


def asked(under_way: dict[str, Measured], name: str) -> float:
    """Return the next measurement of a rate; the rack of another rate is closed."""
    if name not in under_way:
        for measured in under_way.values():
            measured.close()
        under_way.clear()
        under_way[name] = RATES[name]()
    return next(under_way[name])


def drive(torque: float, reference: float, seconds: float) -> tuple[float, list[int], float]:
    """Run the closed-form circuit; return wall seconds, ns of each firing interval, and the final speed."""
    circuit = circuit_of(torque)
    controller = Controller(reference)
    mean = 0.0
    taken = []
    clock = time.perf_counter_ns
    gc.collect()
    gc.disable()
    began = before = clock()
    for number in range(int(seconds * FIRINGS_PER_S)):
        on_ns = controller.next_ns(number, mean)
        circuit.advance(on_ns)
        mean = circuit.sample().mean_current_a
        circuit.fire(on_ns, on_ns + 60_000, number % 6 + 1, (number - 1) % 6 + 1)
        now = clock()
        taken.append(now - before)
        before = now
    wall = (clock() - began) * 1e-9
    gc.enable()
    machine = circuit.machine
    assert isinstance(machine, Motor)
    return wall, taken, machine.speed_rad_s


def inputs_of(reference: int) -> Inputs:
    """Return inputs with the proposed gains."""
    circuit = proposals.circuit_of(PARAMETERS, LIM_BAR)
    return Inputs(
        io_cntl_slot=7, dig_io_slot=8, ac_line_freq=60, reference=reference, ref_rate=0.5, ref_lag=400.0,
        kp=proposals.kp(circuit), pi_w_lead=float(proposals.pi_w_lead(circuit)),
        ag_factor=proposals.ag_factor(circuit), cc_thresh=proposals.cc_thresh(circuit), cml_run=False,
        cml_coast_stop=False, mcr_select=False, max_m_dropout=0.1, cml_test=False, test_brpol=False, test_alpha=180,
        ioc_thresh=250, lim_bar=LIM_BAR, digital_tach=True, speed_fdbk=2000, tach_loss_stop=True, osv_fdbk=2000,
        osv_thresh=4505, nonstand_phrot=False, auto_phrot=False, fault_reset=False,
    )  # fmt: skip


def loop(reference: int, seconds: float) -> tuple[float, int, list[int]]:
    """Run plant, 57C406 and current minor loop; return wall seconds, I_FDBK at the end, and ns of each scan."""
    plant = DrivePlant(PlantData(PARAMETERS, load=LoadData(held_rpm=HELD_RPM)))
    hardware, minor = DriveController(plant), CurrentMinorLoop()
    inputs = inputs_of(reference)
    now_ns = began = before = 0
    taken = []
    clock = time.perf_counter_ns
    gc.collect()
    gc.disable()
    start_ns = 1_500_000_000
    end_ns = start_ns + round(seconds * 1e9)
    while now_ns < end_ns:
        outcome = minor.scan(now_ns, hardware.measure(now_ns, PERMISSIVE), inputs)
        hardware.command(outcome.command, now_ns)
        now_ns += outcome.command.next_ns
        if began:
            now = clock()
            taken.append(now - before)
            before = now
        elif now_ns > start_ns:
            began = before = clock()
        elif now_ns > start_ns // 3 and not inputs.cml_run:
            inputs = inputs._replace(cml_run=True)
    wall = (clock() - began) * 1e-9
    gc.enable()
    return wall, minor.control.i_fdbk, taken


def runge_kutta(rated: float, reference: float, seconds: float) -> tuple[float, float]:
    """Run the same circuit at a fixed step; return wall seconds and the final speed.

    Two or three SCRs conduct; firing, end of overlap and extinction are on the grid.
    """
    data: MotorData = PARAMETERS.motor
    peak, omega, ls, rs = sqrt(2) * PARAMETERS.line_v, 2 * pi * 60, PARAMETERS.source_h, SOURCE_OHM
    controller = Controller(reference)
    torque = rated * TORQUE
    overlap, number = False, -1

    def slope(t: float, current: float, share: float, speed: float) -> tuple[float, float, float]:
        """Return the rates of current, of the incoming SCR's current over half of it, and of speed."""
        volts, n, over = peak * sin(omega * t - (number - 1) * pi / 3), 2.0, 0.0
        if overlap:
            before = peak * sin(omega * t - (number - 2) * pi / 3)
            over = ((volts - before) / 2 - rs * share) / ls
            volts, n = (volts + before) / 2, 1.5
        drop = (data.resistance_ohm + n * rs) * current + data.k_v_s * speed
        turn = (data.k_v_s * current - torque - data.viscous_n_m_s * speed) / data.inertia_kg_m2
        return (volts - drop) / (data.inductance_h + n * ls), over, turn

    current, share, speed, half, conducts = 0.0, 0.0, START_RAD_S, STEP_S / 2, False
    total, steps = 0.0, 0
    gc.collect()
    gc.disable()
    began = time.perf_counter()
    fire_ns = controller.next_ns(0, 0.0)
    for step in range(int(seconds / STEP_S)):
        t = step * STEP_S
        if t * 1e9 >= fire_ns:
            number += 1
            overlap, share, conducts = current > 0.0, -current / 2, True
            fire_ns = controller.next_ns(number + 1, total / max(steps, 1))
            total, steps = 0.0, 0
        if conducts:
            a1, b1, c1 = slope(t, current, share, speed)
            a2, b2, c2 = slope(t + half, current + half * a1, share + half * b1, speed + half * c1)
            a3, b3, c3 = slope(t + half, current + half * a2, share + half * b2, speed + half * c2)
            a4, b4, c4 = slope(t + STEP_S, current + STEP_S * a3, share + STEP_S * b3, speed + STEP_S * c3)
            current += STEP_S / 6 * (a1 + 2 * (a2 + a3) + a4)
            share += STEP_S / 6 * (b1 + 2 * (b2 + b3) + b4)
            speed += STEP_S / 6 * (c1 + 2 * (c2 + c3) + c4)
            overlap = overlap and share < current / 2
            if current <= 0.0:
                current, conducts = 0.0, False
        else:
            speed -= STEP_S * (torque + data.viscous_n_m_s * speed) / data.inertia_kg_m2
        total, steps = total + current, steps + 1
    wall = time.perf_counter() - began
    gc.enable()
    return wall, speed


def main() -> None:
    """Print the figures."""
    if ANSWER in sys.argv:
        answer(partial(asked, {}))
        return
    forms()
    for title, torque, reference in CASES:
        runs, slow = [], []
        for number in range(REPEATS):
            runs.append(drive(torque, reference, SECONDS))
            if number % (REPEATS // 2) == 0:
                slow.append(runge_kutta(torque, reference, SECONDS))
        wall, speed = min(run[0] for run in runs), runs[0][2]
        times = sorted(min(samples) for samples in zip(*(run[1] for run in runs), strict=True))
        everything = sorted(sample for run in runs for sample in run[1])
        best = SECONDS / (sum(times) * 1e-9)
        print(f"{title}: {SECONDS / wall:.0f} simulated s per wall s, {best:.0f} undisturbed")
        print(f"  a firing interval: {_quantiles(everything)}; of each the best of {REPEATS} runs: {_quantiles(times)}")
        rate, error = SECONDS / min(run[0] for run in slow), slow[0][1] / speed - 1
        print(f"  RK4 at 20 us: {rate:.0f} simulated s per wall s, speed at the end off by {100 * error:+.3f} %")

    for title, reference in LOOP_CASES:
        found = [loop(reference, SECONDS) for _ in range(REPEATS)]
        wall = min(run[0] for run in found)
        times = sorted(min(samples) for samples in zip(*(run[2] for run in found), strict=True))
        everything = sorted(sample for run in found for sample in run[2])
        best = SECONDS / (sum(times) * 1e-9)
        print(f"plant and CML, {title}: {SECONDS / wall:.0f} simulated s per wall s, {best:.0f} undisturbed")
        print(f"  a scan: {_quantiles(everything)}; of each the best of {REPEATS} runs: {_quantiles(times)}")
        print(f"  I_FDBK at the end {found[0][1]}, wanted {reference}")


def _quantiles(ordered: list[int]) -> str:
    p50, p99 = ordered[len(ordered) // 2], ordered[len(ordered) * 99 // 100]
    return f"p50 {p50 / 1000:.1f}, p99 {p99 / 1000:.1f}, max {ordered[-1] / 1000:.1f} us"


if __name__ == "__main__":
    main()
