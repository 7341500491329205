"""Simulated seconds per wall second of the example rack, without and with recording, modeled, and in sweeps.

Prints, fails on none.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path

from automax_ros.bags.recorder import Recorder
from automax_ros.core.ticks import seconds_ns
from automax_ros.pieces.piece import Where
from automax_ros.rack.config import RackConfig, Timing
from automax_ros.rack.loader import load
from automax_ros.rack.rack import Rack, scans_per_second
from automax_ros.sweep.blueprint import Blueprint
from automax_ros.sweep.measures import read_measures
from automax_ros.sweep.points import grid, read_varied
from automax_ros.sweep.run import Plan, run_points
from automax_ros.sweep.sweeping import run_sweep
from automax_ros.wire.stream import RackStream

CONFIG = Path(__file__).parent.parent / "config" / "section_drive" / "rack.yaml"
SECONDS, LONG_SECONDS = 60, 300
PLAIN = "--plain"
"""The argument with which this runs itself for the figures of plain Python."""
REPEATS = 3
SWEEP_RUNS, SWEEP_SECONDS, MORE = 30, 2, 40


def run(config: RackConfig, folder: Path | None, seconds: float = SECONDS) -> float:
    """Run the rack and return the wall time in seconds, from the start of the rack to the closed bag."""
    rack = Rack(config)
    began = time.perf_counter()
    if folder is None:
        rack.start()
        rack.run(seconds)
    else:
        stream = RackStream(rack, rack.fingerprint)
        recorder = Recorder(rack, stream, folder)
        stream.begin()
        rack.start()
        rack.run(seconds)
        stream.end()
        recorder.close()
    return time.perf_counter() - began


def sweeps(config: RackConfig) -> None:
    """Print how many short runs of the rack a sweep makes in a second, next to racks that are built and run alone."""
    rack = Rack(config)
    varied = read_varied(rack, f"SPEED.KP_SPEED=5:80:{SWEEP_RUNS}")
    duration_ns = seconds_ns(SWEEP_SECONDS)
    measures = read_measures("rms(SPEED_ERR%) settle(SPEED_FDBK%, 2 %) max(CUR_REF%)", config, duration_ns)
    plan = Plan(Blueprint.of(rack), (varied.quantity,), measures, duration_ns)
    points = grid([varied])
    run_points(plan, points[:1])
    here = min(taken(partial(run_points, plan, [point])) for point in points * REPEATS)
    alone = min(taken(lambda: run(config, None, SWEEP_SECONDS)) for _ in range(3 * REPEATS))
    print(
        f"sweep: {1 / here:.0f} runs of {SWEEP_SECONDS} s a second, {alone / here:.1f} times as many as racks ", end=""
    )
    print(f"that are each compiled ({1 / alone:.0f}); {SWEEP_SECONDS / here:.0f} x real time")
    many = points * MORE
    pair = min(taken(lambda: run_sweep(plan, many, Where(2))) for _ in range(REPEATS)) / len(many)
    one = min(taken(lambda: run_sweep(plan, many, Where(1))) for _ in range(REPEATS)) / len(many)
    print(f"sweep with two jobs, their start counted: {one / pair:.2f} times one job")


def taken(work: Callable[[], object]) -> float:
    """Return the wall time of work, s."""
    began = time.perf_counter()
    work()
    return time.perf_counter() - began


def recorded_and_not(config: RackConfig, seconds: float) -> tuple[float, float]:
    """Return the wall times of a run with recording and of one without, s: each the best of several, in turn."""
    with tempfile.TemporaryDirectory() as temporary:
        pairs = [
            (run(config, Path(temporary) / f"bag{number}", seconds), run(config, None, seconds))
            for number in range(REPEATS)
        ]
    return min(pair[0] for pair in pairs), min(pair[1] for pair in pairs)


def forms(config: RackConfig) -> None:
    """Print what a long recording costs in the form that runs here, and in plain Python in a process of its own."""
    plain = json.loads(
        subprocess.run(
            [sys.executable, __file__, PLAIN],
            env={**os.environ, "AUTOMAX_COMPILED": "off"},
            check=True,
            capture_output=True,
            text=True,
        ).stdout
    )
    here = recorded_and_not(config, LONG_SECONDS)
    for word, (recorded, bare) in (("as installed", here), ("plain Python", plain)):
        print(
            f"{LONG_SECONDS} s, {word:12} {LONG_SECONDS / recorded:7.0f} x real time with recording, "
            f"{LONG_SECONDS / bare:5.0f} without; {recorded / bare:.1f} times as long"
        )
    print(f"as installed over plain Python, with recording: {plain[0] / here[0]:.2f} times as fast; wanted: 1000 x")


def main() -> None:
    """Print the figures."""
    config = load(CONFIG).config
    if config is None:
        raise SystemExit(f"{CONFIG} has errors: automax check {CONFIG}")
    if PLAIN in sys.argv[1:]:
        print(json.dumps(recorded_and_not(config, LONG_SECONDS)))
        return
    began = time.perf_counter()
    rate = scans_per_second(Rack(config))
    print(f"example rack: {rate:.0f} scans per second, compiled in {time.perf_counter() - began:.2f} s")
    plain = min(run(config, None) for _ in range(REPEATS))
    modeled = min(run(replace(config, execution=Timing.MODELED), None) for _ in range(REPEATS))
    with tempfile.TemporaryDirectory() as temporary:
        recorded = min(run(config, Path(temporary) / f"bag{number}") for number in range(REPEATS))
        size = sum(item.stat().st_size for item in (Path(temporary) / "bag0").iterdir())
    for word, taken, wanted in (("without recording", plain, 200), ("with recording", recorded, 60)):
        pace, scan_us = SECONDS / taken, taken / SECONDS / rate * 1e6
        print(f"{word:18} {pace:7.0f} x real time, {scan_us:6.1f} us per scan; wanted: at least {wanted}")
    scan_us = modeled / SECONDS / rate * 1e6
    print(f"modeled execution  {SECONDS / modeled:7.0f} x real time, {scan_us:6.1f} us per scan; ", end="")
    print(f"{modeled / plain:.2f} times as long as ideal; wanted: at most 3")
    print(f"bag: {size / 1e6:.2f} MB, {size / SECONDS / rate:.0f} bytes per scan")
    forms(config)
    sweeps(config)


if __name__ == "__main__":
    main()
