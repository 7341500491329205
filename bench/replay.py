"""Cost of a replay: the example rack, and five speed regulators that scan every 5.5 ms. Prints figures, never fails."""

from __future__ import annotations

import re
import tempfile
import time
from collections.abc import Callable, Mapping
from pathlib import Path

from _harness import scans_per_second, seconds_in_turn, wall_s

from automax_ros.compile.native.run.forms import NativeForms, NativeMode
from automax_ros.core.diagnostics import SourceText
from automax_ros.core.ticks import NS_PER_S
from automax_ros.messages.stream.stream import RackStream
from automax_ros.parallel.job import Workers
from automax_ros.rack.rack import Rack
from automax_ros.rackfile.loader import load
from automax_ros.rackfile.model.config import RackConfig
from automax_ros.recordings.write.recorder import Recorder, RecordingOptions
from automax_ros.replay import side_by_side
from automax_ros.replay.engine import Replay, ReplayOptions
from automax_ros.replay.side_by_side import replay_side_by_side

EXAMPLE = Path(__file__).parent.parent / "config" / "section_drive"
SECONDS = 60
SPLIT_SECONDS = 14_400
"""Long enough that the start of a process, half a second, matters little where native scans are replayed."""
FILES = 16
REPEATS = 3
WANTED = 500
TASKS = 5
_DECLARED = re.compile(r"^\d+ COMMON (.*)$", re.MULTILINE)


def config_of(file: Path) -> RackConfig:
    result = load(file)
    if result.config is None:
        raise SystemExit(f"{file} has errors: {[item.message for item in result.diagnostics]}")
    return result.config


def five_regulators(folder: Path) -> RackConfig:
    """Return a rack with five of the example's speed regulator, each with its own commons, every tick of 5.5 ms."""
    text = (EXAMPLE / "SPEED.BLK").read_text().replace("SCAN_LOOP(TICKS=2)", "SCAN_LOOP(TICKS=1)")
    names = [name.strip() for line in _DECLARED.findall(text) for name in line.split(",")]
    lines = ["rack: BENCH", "slots:", "  0:", "    module: 57C435", "    tick_ms: 5.5", "    tasks:"]
    lines += [f"      SPEED{number}: {{priority: {4 + number}}}" for number in range(TASKS)]
    lines.append("common:")
    for number in range(TASKS):
        own = text
        for name in sorted(names, key=len, reverse=True):
            renamed = f"{name[:-1]}{number}{name[-1]}"
            own = re.sub(rf"(?<![A-Z_]){re.escape(name)}", renamed, own)
            lines.append(f"  {renamed}: {{}}")
        (folder / f"SPEED{number}.BLK").write_text(own)
    (folder / "rack.yaml").write_text("\n".join(lines) + "\n")
    return config_of(folder / "rack.yaml")


def plant(rack: Rack, step: int) -> None:
    """Change the inputs of all five regulators, so that every scan latches new values."""
    for number in range(TASKS):
        rack.write(f"RUN{number}@", True)
        rack.write(f"SECT_REF{number}%", (step * 7 + number * 300) % 3000)
        rack.write(f"TACH{number}%", (step * 7 + number * 300 - 40) % 3000)


def record(
    config: RackConfig,
    bag: Path,
    moves: Callable[[Rack, int], None] | None,
    seconds: int = SECONDS,
    options: RecordingOptions | None = None,
) -> float:
    """Record a run; return the scans per second of rack time."""
    rack = Rack(config)
    stream = RackStream(rack, rack.fingerprint)
    recorder = Recorder(rack, stream, bag, options)
    stream.begin()
    rack.start()
    steps = seconds * 20
    for step in range(steps):
        if moves is not None:
            moves(rack, step)
        rack.run(seconds / steps)
    stream.end()
    recorder.close()
    return scans_per_second(rack)


FORMS = (
    ("scan by scan", ReplayOptions(by_columns=False)),
    ("by columns, native", ReplayOptions(native=NativeForms(NativeMode.ON))),
)
"""The ways to execute a recording again; each gives the same report."""


def print_replay(what: str, bag: Path, rate: float, new: Mapping[str, SourceText]) -> None:
    replays = [Replay(bag, new, options) for _, options in FORMS]
    reports = [replay.run() for replay in replays]  # the first pass builds native tasks and the codec
    times = seconds_in_turn([lambda _, run=replay.run: wall_s(run) for replay in replays], REPEATS)
    for (form, _), report, best in zip(FORMS, reports, times, strict=True):
        result = "identical" if report.identical else f"{sum(task.different for task in report.tasks)} scans differ"
        print(
            f"{what:43} {form:23}{report.scans / best:10,.0f} of {rate:.0f} scans per second: "
            f"{SECONDS / best:7.1f} x real time, wanted {WANTED}; {times[0] / best:5.1f} x the first form; {result}"
        )


EDITS: dict[str, list[tuple[str, str]]] = {
    "one gain edited": [("CURRENT=26.7", "CURRENT=30.0")],
    "its filter edited": [("WLG=60.0", "WLG=20.0")],
    "more locals": [("CURRENT=26.7", "CURRENT=30.0"), ("LOCAL TACH_DELAY%", "LOCAL MORE%, TACH_DELAY%")],
    "a common more": [("COMMON TACH0%", "COMMON TACH1%, TACH0%"), ("LAG(INPUT=TACH0%", "LAG(INPUT=TACH1%")],
}
"""Edits of the first regulator; the last one is only for one of five."""


def print_both(what: str, bag: Path, rate: float, name: str, text: str) -> None:
    print_replay(what, bag, rate, {})
    for edit, changes in EDITS.items():
        edited = text
        for old, new in changes:
            edited = edited.replace(old, new)
        if edited != text:
            print_replay(f"{what}, {edit}", bag, rate, {name: SourceText(f"{name}.BLK", edited)})


def print_side_by_side(bag: Path, form: str, options: ReplayOptions) -> None:
    """Print the times of one job and of two, each including its start: processes started, tasks compiled."""
    replay = Replay(bag, {}, options)
    replay.run()

    def side_by_side_s(jobs: int) -> float:
        began = time.perf_counter()
        report = replay_side_by_side(replay, Workers(jobs))
        assert report.identical
        return time.perf_counter() - began

    one, two = seconds_in_turn([lambda _: side_by_side_s(1), lambda _: side_by_side_s(2)], REPEATS)
    what = f"five regulators, {SPLIT_SECONDS} s in {FILES} files"
    print(
        f"{what:42}{form:23}{SPLIT_SECONDS / one:7.1f} x real time, "
        f"{SPLIT_SECONDS / two:7.1f} x with two jobs: {one / two:5.2f} times one job, wanted 1.8"
    )


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        rate = record(config_of(EXAMPLE / "rack.yaml"), folder / "example", None)
        print_both("example rack", folder / "example", rate, "SPEED", (EXAMPLE / "SPEED.BLK").read_text())
        rate = record(five_regulators(folder), folder / "five", plant)
        print_both("five regulators, 5.5 ms", folder / "five", rate, "SPEED0", (folder / "SPEED0.BLK").read_text())
        side_by_side.LEAST_PART_BYTES = 1  # each file is a part
        split = RecordingOptions(split_ns=SPLIT_SECONDS * NS_PER_S // FILES)
        record(config_of(folder / "rack.yaml"), folder / "split", plant, SPLIT_SECONDS, split)
        for form, options in FORMS[1:]:
            print_side_by_side(folder / "split", form, options)
