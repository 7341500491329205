"""Costs of recordings: encoding, writing, reading, exporting, comparing, and what recording takes of a run."""

from __future__ import annotations

import tempfile
import time
import timeit
from collections.abc import Callable
from pathlib import Path

from _harness import scans_per_second, seconds_in_turn

from automax_ros.comparison.comparison import compare
from automax_ros.core.types import DataType
from automax_ros.messages.cdr.cdr import Message, decoder, encoder
from automax_ros.messages.stream.stream import RackStream
from automax_ros.messages.types.messages import (
    NAMES,
    Bool,
    CommonWrite,
    Header,
    Int16,
    JointState,
    PlantState,
    Scan,
    ScanError,
    Values,
    Variable,
    VariableTable,
)
from automax_ros.messages.types.topics import LATCHED, SCAN
from automax_ros.rack.rack import Rack
from automax_ros.rackfile.loader import load
from automax_ros.recordings.read.reader import BagReader
from automax_ros.recordings.tables.export import CommonTable, write_csv
from automax_ros.recordings.write.data_file import COMPRESSIONS, StorageOptions
from automax_ros.recordings.write.recorder import Recorder, RecordingOptions
from automax_ros.recordings.write.writer import BagWriter

RACK = Path(__file__).parent.parent / "config" / "section_drive" / "rack.yaml"
SECONDS = 60
REPEATS = 5
MESSAGES = 100_000
STEP = 5_500_000
CHANGES = Values((1, 2, 3, 4, 5, 6), (0,) * 6, (1.0, 0.0, -300.0, 4.0, 1.0, 0.125))


def samples() -> list[Message]:
    latched = Values((1, 2, 3, 4, 5), (0,) * 5, (1.0, 0.0, -300.0, 4.0, 1.0))
    return [
        Int16(5),
        Bool(True),
        CommonWrite(STEP, 1, 3, 1, 1, 17, CHANGES),
        Scan(STEP, 1, "SPEED", 12, latched=latched, committed=CHANGES, errors=(ScanError(1030, 7001),)),
        PlantState(STEP, "UNWIND", 7, "", *[0.5] * 9, 1, True, 60.0, 460.0, ("lose_tach",), *[1e3] * 4),
        JointState(Header(STEP), ("UNWIND",), (0.5,), (183.0,), (610.0,)),
    ]


def microseconds(action: Callable[[], object], number: int = 20_000) -> float:
    return min(timeit.repeat(action, number=number, repeat=5)) / number * 1e6


def print_codec() -> None:
    print(f"{'message':14}{'bytes':>8}{'encode us':>12}{'decode us':>12}")
    for message in samples():
        name = NAMES[type(message)]
        encode, decode = encoder(name), decoder(name)
        data = encode(message)
        costs = microseconds(lambda e=encode, m=message: e(m)), microseconds(lambda d=decode, b=data: d(b))
        print(f"{type(message).__name__:14}{len(data):8}{costs[0]:12.2f}{costs[1]:12.2f}")


def record(folder: Path, payloads: list[bytes], table: bytes) -> None:
    with BagWriter(folder) as writer:
        writer.write(writer.channel("/line1/variables", NAMES[VariableTable], LATCHED), 0, table)
        channel = writer.channel("/line1/backplane", NAMES[CommonWrite], SCAN)
        for index, payload in enumerate(payloads):
            writer.write(channel, index * STEP, payload)


def print_rate(what: str, seconds: float, size: int) -> None:
    print(f"{what:28}{MESSAGES / seconds:12,.0f} messages/s{size / seconds / 1e6:10.1f} MB/s of messages")


def print_recording(folder: Path) -> None:
    encode = encoder(NAMES[CommonWrite])
    payloads = [
        encode(
            CommonWrite(i * STEP, 1, 3, 1, 1, i + 1, CHANGES._replace(value=(i % 30000, i % 2, i % 97, 4, 1, i / 8)))
        )
        for i in range(MESSAGES)
    ]
    variables = tuple(Variable(number, f"VALUE_{number}", DataType.REAL.number) for number in range(10))
    table = encoder(NAMES[VariableTable])(VariableTable(0, "LINE1", 1, variables))
    size = sum(map(len, payloads))
    bag, table_file = folder / "bag", folder / "out.csv"
    print_rate("write", timeit.timeit(lambda: record(bag, payloads, table), number=1), size)
    on_disk = sum(path.stat().st_size for path in bag.iterdir())
    print(f"{'on disk':28}{on_disk / MESSAGES:12.1f} bytes per message of {size / MESSAGES:.0f}")
    print_rate("read", timeit.timeit(lambda: sum(1 for _ in BagReader(bag).messages()), number=1), size)
    print_rate(
        "export 10 variables to CSV", timeit.timeit(lambda: write_csv(CommonTable(bag), table_file), number=1), size
    )


def run_seconds(folder: Path | None, compression: str = "zstd") -> float:
    """Return the wall time in seconds of a simulated run of the example rack, including the closing of the bag."""
    config = load(RACK).config
    assert config is not None
    rack = Rack(config)
    stream = RackStream(rack, rack.fingerprint)
    began = time.perf_counter()
    if folder is None:
        rack.start()
        rack.run(SECONDS)
    else:
        recorder = Recorder(rack, stream, folder, RecordingOptions(StorageOptions(compression)))
        stream.begin()
        rack.start()
        rack.run(SECONDS)
        stream.end()
        recorder.close()
    return time.perf_counter() - began


def print_share_of_a_rack(folder: Path) -> None:
    """Print the time that recording adds to a simulated run: the best of several runs each."""
    config = load(RACK).config
    assert config is not None
    scans = scans_per_second(Rack(config)) * SECONDS
    bags = {name: [folder / f"rack_{name}_{number}" for number in range(REPEATS)] for name in COMPRESSIONS}
    works = [lambda number, name=name: run_seconds(bags[name][number], name) for name in bags]
    plain, *times = seconds_in_turn([lambda _: run_seconds(None), *works], REPEATS)
    print(f"example rack, {SECONDS} simulated s: {plain / SECONDS * 1e3:.2f} ms per second without recording")
    for compression, taken in zip(COMPRESSIONS, times, strict=True):
        size = sum(path.stat().st_size for path in bags[compression][0].iterdir())
        print(
            f"  {compression:6}{taken / SECONDS * 1e3:6.2f} ms per second {scans / taken:10,.0f} scans/s"
            f"{size / scans:7.0f} bytes per scan{size / taken / 1e6:7.1f} MB/s"
            f"   recording takes {100 * (taken - plain) / taken:.0f} % of the time, wanted: under 20 %;"
            f" in real time {(taken - plain) / SECONDS * 100:.2f} % of a core"
        )


def print_comparison(folder: Path) -> None:
    """Print the time in which two recordings of the example rack are compared, with all that they have."""
    one, other = (folder / f"rack_zstd_{number}" for number in range(2))
    taken = min(timeit.repeat(lambda: compare(one, other), number=1, repeat=REPEATS))
    print(f"compare two recordings of {SECONDS} s: {taken:.2f} s; of 120 s wanted: under 2 s")


if __name__ == "__main__":
    print_codec()
    with tempfile.TemporaryDirectory() as name:
        print_recording(Path(name))
        print_share_of_a_rack(Path(name))
        print_comparison(Path(name))
