"""Figures of a rack in many processes on this machine: skipped scans, and write-to-latch from process to process.

`bench/distributed.py [SECONDS]`: 60 s of four Processors at 5.5 ms, a drive, a UDC and inputs in 7 processes; then 20 s
of a Processor that counts at 5.5 ms and one that reads the count each 0.5 ms. Latency is the rack time from the scan
that writes to the first scan of the other process that reads the new value.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

os.environ.setdefault("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
os.environ.setdefault("ROS_DOMAIN_ID", "88")

from automax_ros.messages.types.messages import NAMES, Scan
from automax_ros.recordings.read.reader import BagReader

LINE = Path(__file__).parents[1] / "test" / "system" / "racks" / "line4"
LATENCY_SECONDS = 20
TICK_US = 5500
RACK = """rack: BENCH2
slots:
  0: {module: 57C413}
  1: {module: 57C435, tick_ms: 5.5, tasks: {WRITES: {priority: 4}}}
  2: {module: 57C435, tick_ms: 0.5, tasks: {LOOKS: {priority: 4}}}
common: {N!: {}, SEEN!: {}}
"""
WRITES = "10 COMMON N!\n100 CALL SCAN_LOOP(TICKS=1)\n110 N! = N! + 1\n120 END\n"
LOOKS = "10 COMMON N!, SEEN!\n100 CALL SCAN_LOOP(TICKS=1)\n110 SEEN! = N!\n120 END\n"


def run(folder: Path, rack: Path, seconds: int, *options: str) -> dict:
    """Run a rack distributed; return its report."""
    report = folder / "report.json"
    command = [sys.executable, "-m", "automax_ros.cli.main", "run", str(rack), "--distributed", f"--duration={seconds}"]
    command += [f"--report={report}", f"--state={folder / 'state'}", *options]
    ended = subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, check=False)
    if not report.exists():
        raise SystemExit(ended.stderr or f"the rack ended with exit code {ended.returncode}")
    return json.loads(report.read_text())


def skipped(seconds: int) -> None:
    """Print how many scans each task of the seven processes has skipped."""
    with tempfile.TemporaryDirectory() as temporary:
        report = run(Path(temporary), LINE, seconds)
    print(f"{len(report['processes'])} processes, {seconds} s:")
    done = left_out = 0
    for name, task in report["tasks"].items():
        scans, late = task["scans"], task["skipped"]
        done, left_out = done + scans, left_out + late
        print(f"  {name:8} {scans:6} scans  {late:5} skipped  {100 * late / (scans + late):.3f} %")
    print(f"  {'all':8} {done:6} scans  {left_out:5} skipped  {100 * left_out / (done + left_out):.3f} %")


def latencies() -> list[float]:
    """Return the times in us from a write to the first scan of another process that reads the new value."""
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        (folder / "rack.yaml").write_text(RACK)
        (folder / "WRITES.BLK").write_text(WRITES)
        (folder / "LOOKS.BLK").write_text(LOOKS)
        run(folder, folder / "rack.yaml", LATENCY_SECONDS, f"--record={folder / 'bag'}")
        written: dict[int, int] = {}
        seen: dict[int, int] = {}
        for item in BagReader(folder / "bag").messages(types={NAMES[Scan]}):
            scan = item.message
            for view, value in zip(scan.written.variable, scan.written.value, strict=True):
                first = written if (scan.task, view) == ("WRITES", 0) else seen
                if (scan.task, view) in (("WRITES", 0), ("LOOKS", 1)):
                    first.setdefault(int(value), scan.stamp)
    reached = sorted(seen.items(), reverse=True)
    found, best = [], None
    # A read after several writes counts for all of them.
    for value in sorted(written, reverse=True):
        while reached and reached[0][0] >= value:
            best = reached.pop(0)[1]
        if best is not None:
            found.append((best - written[value]) / 1000)
    return found


def main() -> None:
    """Print the figures."""
    skipped(int(sys.argv[1]) if len(sys.argv) > 1 else 60)
    times = sorted(latencies())
    p50, p99 = times[len(times) // 2], times[int(len(times) * 0.99)]
    print(f"write to latch between processes, {len(times)} writes, us, in steps of 500:")
    print(f"  p50 {p50:8.1f}  p99 {p99:8.1f}  max {times[-1]:8.1f}   (a tick is {TICK_US})")


if __name__ == "__main__":
    main()
