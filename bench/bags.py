"""What recordings cost: encoding, writing, reading, exporting."""

from __future__ import annotations

import tempfile
import timeit
from collections.abc import Callable
from pathlib import Path

from automax_ros.bags.cdr import Message, decoder, encoder
from automax_ros.bags.export import export_csv
from automax_ros.bags.messages import (
    NAMES,
    Bool,
    CommonWrite,
    Int16,
    Scan,
    ScanError,
    Values,
    Variable,
    VariableTable,
    VariableType,
)
from automax_ros.bags.qos import LATCHED, SCAN
from automax_ros.bags.reader import BagReader
from automax_ros.bags.writer import BagWriter

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
    variables = tuple(Variable(number, f"VALUE_{number}", VariableType.REAL) for number in range(10))
    table = encoder(NAMES[VariableTable])(VariableTable(0, "LINE1", 1, variables))
    size = sum(map(len, payloads))
    bag, table_file = folder / "bag", folder / "out.csv"
    print_rate("write", timeit.timeit(lambda: record(bag, payloads, table), number=1), size)
    on_disk = sum(path.stat().st_size for path in bag.iterdir())
    print(f"{'on disk':28}{on_disk / MESSAGES:12.1f} bytes a message of {size / MESSAGES:.0f}")
    print_rate("read", timeit.timeit(lambda: sum(1 for _ in BagReader(bag).messages()), number=1), size)
    print_rate("export 10 variables to CSV", timeit.timeit(lambda: export_csv(bag, table_file), number=1), size)


if __name__ == "__main__":
    print_codec()
    with tempfile.TemporaryDirectory() as name:
        print_recording(Path(name))
