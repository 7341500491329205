"""Simulated seconds per wall second of the example rack, without and with recording, modeled, and in sweeps.

Prints figures, never fails.
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path

from _harness import ANSWER, Other, answer, scans_per_second, seconds_in_turn, wall_s

from automax_ros.compile.native.run.forms import IN_PYTHON, NativeForms, NativeMode
from automax_ros.core.ticks import seconds_ns
from automax_ros.messages.stream.stream import RackStream
from automax_ros.parallel.job import Workers
from automax_ros.rack.rack import Rack
from automax_ros.rackfile.loader import load
from automax_ros.rackfile.model.config import RackConfig, Timing
from automax_ros.recordings.write.recorder import Recorder
from automax_ros.sweep.measures import read_measures
from automax_ros.sweep.points import Point, grid, read_varied
from automax_ros.sweep.run import Plan, RackTemplate, run_points, run_sweep

CONFIG = Path(__file__).parent.parent / "config" / "section_drive" / "rack.yaml"
SECONDS, LONG_SECONDS, HOUR_S = 60, 300, 3600
REPEATS = 3
SWEEP_RUNS, SWEEP_SECONDS, MORE = 30, 2, 40


def run(config: RackConfig, folder: Path | None, seconds: float = SECONDS, native: NativeForms = IN_PYTHON) -> float:
    """Run the rack and return the wall time in seconds, from the start of the rack to the closed bag."""
    rack = Rack(config, native=native)
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
    """Print how many short runs of the rack a sweep makes per second, and racks that are built and run one by one."""
    rack = Rack(config)
    varied = read_varied(rack, f"SPEED.KP_SPEED=5:80:{SWEEP_RUNS}")
    duration_ns = seconds_ns(SWEEP_SECONDS)
    measures = read_measures("rms(SPEED_ERR%) settle(SPEED_FDBK%, 2 %) max(CUR_REF%)", config, duration_ns)
    plan = Plan(RackTemplate.of(rack), (varied.quantity,), measures, duration_ns)
    points = grid([varied])
    run_points(plan, points[:1])
    one_each = [partial(run_points, plan, [point]) for point in points]
    compiled_each = [partial(run, config, None, SWEEP_SECONDS)] * 3
    works = [lambda _, runs=runs: min(map(wall_s, runs)) for runs in (one_each, compiled_each)]
    here, alone = seconds_in_turn(works, REPEATS)
    print(
        f"sweep: {1 / here:.0f} runs of {SWEEP_SECONDS} s a second, {alone / here:.1f} times as many as racks ", end=""
    )
    print(f"that are each compiled ({1 / alone:.0f}); {SWEEP_SECONDS / here:.0f} x real time")
    many = points * MORE
    pair, one = seconds_in_turn([partial(sweep_s, plan, many, jobs) for jobs in (2, 1)], REPEATS)
    print(f"sweep with two jobs, their start counted: {one / pair:.2f} times one job")


def sweep_s(plan: Plan, points: list[Point], jobs: int, _: int) -> float:
    """Return the wall time of a sweep including its start, s."""
    return wall_s(lambda: run_sweep(plan, points, Workers(jobs)))


def asked(config: RackConfig, question: str) -> float:
    """Return the wall time of a long run, "recorded" or "bare", s."""
    with tempfile.TemporaryDirectory() as temporary:
        return run(config, Path(temporary, "bag") if question == "recorded" else None, LONG_SECONDS)


def an_hour(config: RackConfig) -> None:
    """Print the time of an hour run like ``automax run --simulated --record``, with cached native scans, and bare."""
    native = NativeForms(NativeMode.AUTO, seconds_ns(HOUR_S))
    Rack(config, native=replace(native, mode=NativeMode.ON))
    with tempfile.TemporaryDirectory() as temporary:
        works = (
            lambda number: run(config, Path(temporary) / f"bag{number}", HOUR_S, native),
            lambda _: run(config, None, HOUR_S, native),
        )
        recorded, bare = seconds_in_turn(works, REPEATS)
    print(
        f"an hour, native scans found in the cache: {HOUR_S / recorded:.0f} x real time with recording, "
        f"{HOUR_S / bare:.0f} without; wanted: 1000 x"
    )


def forms(config: RackConfig) -> None:
    """Print the cost of a long recording in the form that runs here, and in plain Python in a separate process."""
    with Other(__file__, {"AUTOMAX_COMPILED": "off"}) as plain:
        ways: tuple[Callable[[str], float], ...] = (partial(asked, config), plain)
        works = [lambda _, ask=ask, what=what: ask(what) for ask in ways for what in ("recorded", "bare")]
        found = seconds_in_turn(works, REPEATS)
    for word, recorded, bare in (("as installed", *found[:2]), ("plain Python", *found[2:])):
        print(
            f"{LONG_SECONDS} s, {word:12} {LONG_SECONDS / recorded:7.0f} x real time with recording, "
            f"{LONG_SECONDS / bare:5.0f} without; {recorded / bare:.1f} times as long"
        )
    print(f"as installed over plain Python, with recording: {found[2] / found[0]:.2f} times as fast")


def main() -> None:
    """Print the figures."""
    config = load(CONFIG).config
    if config is None:
        raise SystemExit(f"{CONFIG} has errors: automax check {CONFIG}")
    if ANSWER in sys.argv[1:]:
        answer(partial(asked, config))
        return
    began = time.perf_counter()
    rate = scans_per_second(Rack(config))
    print(f"example rack: {rate:.0f} scans per second, compiled in {time.perf_counter() - began:.2f} s")
    in_model = replace(config, execution=Timing.MODELED)
    with tempfile.TemporaryDirectory() as temporary:
        works = (
            lambda _: run(config, None),
            lambda _: run(in_model, None),
            lambda number: run(config, Path(temporary) / f"bag{number}"),
        )
        plain, modeled, recorded = seconds_in_turn(works, REPEATS)
        size = sum(item.stat().st_size for item in (Path(temporary) / "bag0").iterdir())
    for word, wall, wanted in (("without recording", plain, 200), ("with recording", recorded, 60)):
        pace, scan_us = SECONDS / wall, wall / SECONDS / rate * 1e6
        print(f"{word:18} {pace:7.0f} x real time, {scan_us:6.1f} us per scan; wanted: at least {wanted}")
    scan_us = modeled / SECONDS / rate * 1e6
    print(f"modeled execution  {SECONDS / modeled:7.0f} x real time, {scan_us:6.1f} us per scan; ", end="")
    print(f"{modeled / plain:.2f} times as long as ideal; wanted: at most 3")
    print(f"bag: {size / 1e6:.2f} MB, {size / SECONDS / rate:.0f} bytes per scan")
    an_hour(config)
    forms(config)
    sweeps(config)


if __name__ == "__main__":
    main()
