"""What `automax report` takes of two minutes of each example, recorded: the whole command, and of it the reading."""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path
from subprocess import DEVNULL, run

from automax_ros.replay.drive_report.rack_report import rack_report

CONFIG = Path(__file__).parent.parent / "config"
EXAMPLES = ("dc_drive", "section_drive", "web_line")
SECONDS = 120
WANTED_S = 2.0
REPEATS = 3


def automax(*words: object) -> float:
    """Run `automax` in a process of its own; return its seconds."""
    begun = time.perf_counter()
    run([sys.executable, "-m", "automax_ros.cli.main", *map(str, words)], check=True, stdout=DEVNULL, stderr=DEVNULL)
    return time.perf_counter() - begun


def reading(bag: Path) -> float:
    """Read a recording for the report, in this process; return its seconds."""
    begun = time.perf_counter()
    rack_report(bag)
    return time.perf_counter() - begun


def main() -> None:
    """Print the times of each example."""
    print(f"{SECONDS} s recorded, at most {WANTED_S:g} s are wanted")
    print(f"{'example':16}{'MB':>8}{'report s':>12}{'reading s':>12}")
    with tempfile.TemporaryDirectory() as folder:
        for name in EXAMPLES:
            bag = Path(folder) / name
            automax("run", CONFIG / name, "--simulated", "--duration", SECONDS, "--record", bag)
            size = sum(path.stat().st_size for path in bag.iterdir()) / 1e6
            whole = min(automax("report", bag) for _ in range(REPEATS))
            read = min(reading(bag) for _ in range(REPEATS))
            print(f"{name:16}{size:8.1f}{whole:12.2f}{read:12.2f}")


if __name__ == "__main__":
    main()
