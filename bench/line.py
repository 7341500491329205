"""Simulated seconds per processor second of drives with webs between them, and of as many drives without.

Each drive has its 57C406 and current minor loop: an unwinder, presses and a winder that hold the webs taut. Processor
time counts, in short runs of which the fastest counts: other work on the machine disturbs it little.
"""

from __future__ import annotations

import gc
import time

from drive import LIM_BAR, inputs_of

from automax_ros.drive.base.motor import __file__ as motor_file
from automax_ros.drive.base.nameplate import EXAMPLES, derive
from automax_ros.drive.current_loop.inputs import Inputs
from automax_ros.drive.current_loop.minor_loop import CurrentMinorLoop
from automax_ros.drive.current_loop.signals import PERMISSIVE
from automax_ros.drive.plant.controller import DriveController
from automax_ros.drive.plant.plant import DrivePlant, LoadData, PlantData
from automax_ros.drive.web.chain import build_chains
from automax_ros.drive.web.data import Roll, Roller, SurfaceData, WebData

PARAMETERS = derive(EXAMPLES["150hp"])
WANTED = 300
RUN_NS = 50_000_000
RUNS = 60
START_NS = 2_000_000_000
REFERENCES = {"UNWIND": -400, "PRESS": 500, "WINDER": 300, "PRESS_2": 200}
"""The current references, counts: the unwinder brakes, the others pull."""
SURFACES = {
    "UNWIND": SurfaceData(Roll(1.25, 0.15, 2.5, 90.0, 780.0), 4.0),
    "PRESS": SurfaceData(Roller(0.5), 5.25),
    "PRESS_2": SurfaceData(Roller(0.5), 5.25),
    "WINDER": SurfaceData(Roll(0.6, 0.15, 2.5, 90.0, 780.0), 4.0),
}
LINES = (("UNWIND", "PRESS"), ("UNWIND", "PRESS", "WINDER"), ("UNWIND", "PRESS", "PRESS_2", "WINDER"))


def rate(names: tuple[str, ...], *, webs: bool) -> float:
    """Return simulated s per processor s of drives that run at their references, with or without webs."""
    plants = {name: DrivePlant(PlantData(PARAMETERS, load=LoadData(friction_nm=5.0))) for name in names}
    if webs:
        web = WebData(4.0, 2e5)
        spans = {f"W{place}": (names[place], names[place + 1], web) for place in range(len(names) - 1)}
        build_chains(plants, SURFACES, spans, {})

    def drive(name: str) -> tuple[DriveController, CurrentMinorLoop, dict[bool, Inputs]]:
        inputs = inputs_of(REFERENCES[name])._replace(lim_bar=LIM_BAR)
        by_run = {on: inputs._replace(cml_run=on) for on in (False, True)}
        return DriveController(plants[name]), CurrentMinorLoop(), by_run

    drives = [drive(name) for name in names]
    due = [number * 900_000 for number in range(len(drives))]

    def run(until_ns: int, *, on: bool = True) -> None:
        while (now := min(due)) < until_ns:
            place = due.index(now)
            hardware, minor, inputs = drives[place]
            outcome = minor.scan(now, hardware.measure(now, PERMISSIVE), inputs[on])
            hardware.command(outcome.command, now)
            due[place] = now + outcome.command.next_ns

    run(300_000_000, on=False)
    run(START_NS)
    best = float("inf")
    gc.collect()
    gc.disable()
    for number in range(RUNS):
        began = time.process_time()
        run(START_NS + (number + 1) * RUN_NS)
        best = min(best, time.process_time() - began)
    gc.enable()
    return RUN_NS * 1e-9 / best


def main() -> None:
    """Print the figures."""
    print(f"compiled ahead of time: {'no' if motor_file.endswith('.py') else 'yes'}; wanted {WANTED} with three webs")
    print(f"{'simulated s per processor s':30}{'without webs':>14}{'with webs':>12}")
    for names in LINES:
        alone, together = rate(names, webs=False), rate(names, webs=True)
        print(f"{f'{len(names)} drives, {len(names) - 1} webs':30}{alone:>14.0f}{together:>12.0f}")


if __name__ == "__main__":
    main()
