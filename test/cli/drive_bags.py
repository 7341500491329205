"""Recordings of drives for the tests of `automax report`, made message by message: nothing of the loop runs here."""

from pathlib import Path

from recordings.recordings import RUN

from automax_ros.core.kinds import WriteKind, WriterKind
from automax_ros.core.types import DataType, type_of_name
from automax_ros.messages.cdr.cdr import encode
from automax_ros.messages.types.messages import (
    NAMES,
    CommonImage,
    CommonWrite,
    Operation,
    PlantState,
    Scan,
    ScanError,
    Values,
    Variable,
    VariableTable,
    Writer,
)
from automax_ros.messages.types.topics import LATCHED, SCAN
from automax_ros.recordings.write.writer import BagWriter

S = 1_000_000_000
WRITERS = (
    Writer(1, "ros", WriterKind.ROS, 0),
    Writer(2, "operator", WriterKind.OPERATOR, 0),
    Writer(3, "T", WriterKind.TASK, 1),
)


class DriveBag:
    """A recording of a rack with a drive that is written step by step; times in s."""

    def __init__(self, folder: Path, rack: str, names: list[str], sources: dict[str, str], **options: object) -> None:
        self.folder, self._names, self._sequence = folder, names, 0
        self._writer = BagWriter(folder, **options)
        self._writer.attach("rack.yaml", "application/yaml", rack.encode())
        for name, text in sources.items():
            self._writer.attach(name, "text/plain", text.encode())
        variables = tuple(Variable(number, name, type_of_name(name).number) for number, name in enumerate(names))
        self._send("variables", VariableTable(0, "D1", RUN, variables, WRITERS), 0, LATCHED)
        zeros = [0.0 for name in names if type_of_name(name) is not DataType.STRING]
        values = Values(range(len(names)), [0] * len(names), zeros, ())
        self._send("backplane/snapshot", CommonImage(0, RUN, 0, values), 0, LATCHED)

    def __enter__(self) -> "DriveBag":
        return self

    def __exit__(self, *_: object) -> None:
        self._writer.close()

    def write(self, time_s: float, **changes: float) -> None:
        """Change commons; a name ends with I for %, B for @, so REF_I is REF%."""
        self._write(time_s, 3, WriteKind.COMMIT, changes)

    def outside(self, time_s: float, writer: str, **changes: float) -> None:
        """Let the operator, or somebody in ROS, change commons."""
        self._write(time_s, {"ros": 1, "operator": 2}[writer], WriteKind.OUTSIDE, changes)

    def _write(self, time_s: float, writer: int, kind: WriteKind, changes: dict[str, float]) -> None:
        self._sequence += 1
        marks = {"I": "%", "B": "@"}
        numbers = [self._names.index(f"{name[:-2]}{marks[name[-1]]}") for name in changes]
        values = Values(numbers, [0] * len(numbers), [float(value) for value in changes.values()], ())
        stamp = round(time_s * S)
        self._send("backplane", CommonWrite(stamp, RUN, writer, 1, kind, self._sequence, values), stamp, SCAN)

    def error(self, time_s: float, task: str, line: int, code: int) -> None:
        """Let a task log an error."""
        stamp = round(time_s * S)
        self._send("scans", Scan(stamp, 1, task, 1, errors=(ScanError(line, code),)), stamp, SCAN)

    def operation(self, time_s: float, what: str, detail: str, reason: str = "") -> None:
        """Let a person do something."""
        stamp = round(time_s * S)
        message = Operation(stamp, RUN, what, "", not reason, reason, detail)
        self._send("operations", message, stamp, SCAN)

    def plant(self, time_s: float, name: str = "UNWIND", **fields: object) -> None:
        """Let a plant tell how it stands."""
        stamp = round(time_s * S)
        still = dict.fromkeys(PlantState._fields, 0.0) | {"slot": 7, "drive": "", "bridge": 0, "contactor": False}
        still |= {"stamp": stamp, "plant": name, "faults": (), "line_hz": 60.0, "line_v": 460.0}
        self._send(f"plants/{name}", PlantState(**{**still, **fields}), stamp, SCAN)

    def _send(self, topic, message, stamp, quality) -> None:
        channel = self._writer.channel(f"/d1/{topic}", NAMES[type(message)], quality)
        self._writer.write(channel, stamp, encode(message))
