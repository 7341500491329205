"""Simulated seconds per wall second of the example rack, without and with recording, and in modeled execution.

Prints, fails on none.
"""

from __future__ import annotations

import tempfile
import time
from dataclasses import replace
from pathlib import Path

from automax_ros.bags.recorder import Recorder
from automax_ros.rack.config import RackConfig, Timing
from automax_ros.rack.loader import load
from automax_ros.rack.rack import Rack, scans_per_second
from automax_ros.wire.stream import RackStream

CONFIG = Path(__file__).parent.parent / "config" / "section_drive" / "rack.yaml"
SECONDS = 60
REPEATS = 3


def run(config: RackConfig, folder: Path | None) -> float:
    """Run the rack and return the wall time in seconds, from the start of the rack to the closed bag."""
    rack = Rack(config)
    began = time.perf_counter()
    if folder is None:
        rack.start()
        rack.run(SECONDS)
    else:
        stream = RackStream(rack, rack.fingerprint)
        recorder = Recorder(rack, stream, folder)
        stream.begin()
        rack.start()
        rack.run(SECONDS)
        stream.end()
        recorder.close()
    return time.perf_counter() - began


def main() -> None:
    """Print the figures."""
    config = load(CONFIG).config
    if config is None:
        raise SystemExit(f"{CONFIG} has errors: automax check {CONFIG}")
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


if __name__ == "__main__":
    main()
