"""What the tests of the command line share: a task, a rack around it, and calls of `automax`."""

import csv
import io
from pathlib import Path
from typing import NamedTuple

import pytest

from automax_ros.cli.main import main

TASK = """\
100 COMMON REF%, RUN@, SCALED, COUNT!
110 LOCAL OUT%, TABLE%(10), GRID%(2,3), TEXT$:5
120 LOCAL GAIN [CURRENT=1.5, HIGH=10.0, LOW=0.0, STEP=0.1], STEPS% [CURRENT=3, HIGH=9]
200 CALL SCAN_LOOP(TICKS=2)
210 CALL SUMMER(INPUT1=REF%, INPUT2=TABLE%(3), OUTPUT=OUT%)
220 SCALED = OUT% * GAIN
230 COUNT! = COUNT! + STEPS%
240 END
"""
WRONG = "10 CALL SCAN_LOOP(TICKS=4)\n20 X% = 1\n30 END\n"


class Result(NamedTuple):
    code: int
    out: str
    err: str


class Automax:
    """Calls `automax` in this process and in a folder of its own."""

    def __init__(self, folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
        self.folder = folder
        self._capsys = capsys

    def __call__(self, *arguments: str | Path) -> Result:
        code = main([str(item) for item in arguments])
        return Result(code, *self._capsys.readouterr())

    def write(self, name: str, text: str | bytes) -> str:
        """Write a file and return its name; the tests run in its folder."""
        path = self.folder / name
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return name

    def trace(self, table: str | bytes, *options: str, task: str = TASK) -> Result:
        """Trace a task on a table, which need not set all its commons: that note is left out of what is returned."""
        result = self("trace", self.write("TASK.BLK", task), "--input", self.write("IN.csv", table), *options)
        told = [line for line in result.err.splitlines(keepends=True) if ": IN.csv does not set " not in line]
        return result._replace(err="".join(told))


def table_of(text: str) -> list[list[str]]:
    return list(csv.reader(io.StringIO(text)))


def columns_of(text: str) -> dict[str, list[str]]:
    """The columns of a table by their names."""
    header, *rows = table_of(text)
    return {name: [row[index] for row in rows] for index, name in enumerate(header)}
