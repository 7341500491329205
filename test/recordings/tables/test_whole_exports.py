"""Tables are there whole or not at all; special files are written themselves."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator, Mapping
from pathlib import Path

import pytest
from waiting import wait_until

from automax_ros.recordings.mcap.errors import BagError
from automax_ros.recordings.read.common_log import Cell
from automax_ros.recordings.tables.export import CommonTable, Table, write_csv
from automax_ros.recordings.tables.export_npz import write_npz
from recordings.recordings import sample_recording


class Breaking:
    """A table that breaks off after its third row."""

    def __init__(self, table: Table) -> None:
        self._table = table
        self.columns = table.columns

    def rows(self) -> Iterator[tuple[int, Mapping[int, Cell | None]]]:
        for number, row in enumerate(self._table.rows()):
            if number == 3:
                raise BagError("AMX6813", "bag", "broken")
            yield row


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return sample_recording(tmp_path_factory.mktemp("bags") / "sample", seconds=0.2)


@pytest.mark.parametrize("name", ["OUT.csv", "OUT.npz"])
@pytest.mark.parametrize("before", [None, b"what was there"])
def test_a_broken_export_changes_nothing(tmp_path: Path, bag: Path, name: str, before: bytes | None) -> None:
    output = tmp_path / name
    if before is not None:
        output.write_bytes(before)
    table = Breaking(CommonTable(bag, ["REF%"]))
    with pytest.raises(BagError, match="AMX6813"):
        write_npz(bag, table, output) if name.endswith("npz") else write_csv(table, output)
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == ({} if before is None else {name: before})


def test_a_pipe_is_written_itself(tmp_path: Path, bag: Path) -> None:
    write_csv(CommonTable(bag), tmp_path / "OUT.csv")
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    read: list[str] = []
    reader = threading.Thread(target=lambda: read.append(pipe.read_text()), daemon=True)
    reader.start()
    write_csv(CommonTable(bag), pipe)
    reader.join(240)
    assert read == [(tmp_path / "OUT.csv").read_text()]
    assert pipe.is_fifo()
    write_csv(CommonTable(bag), Path("/dev/null"))
    assert Path("/dev/null").is_char_device()


def test_standard_output_is_written_even_where_it_is_a_file(tmp_path: Path, bag: Path) -> None:
    """What the shell has opened has to get the table: a file put in its place would lose what others add."""
    write_csv(CommonTable(bag), tmp_path / "OUT.csv")
    with (tmp_path / "log").open("wb") as stdout:
        command = [sys.executable, "-m", "automax_ros.cli.main", "export", str(bag), "-o", "/dev/stdout"]
        subprocess.run(command, stdout=stdout, check=True, timeout=240)
        assert os.fstat(stdout.fileno()).st_ino == (tmp_path / "log").stat().st_ino
    assert (tmp_path / "log").read_text() == (tmp_path / "OUT.csv").read_text()


ENDLESS = """\
import sys
from automax_ros.recordings.tables.export import CommonTable
from automax_ros.cli.main import main

def rows(self):
    while True:
        yield 0, {}

CommonTable.rows = rows
sys.exit(main(sys.argv[1:]))
"""


@pytest.mark.parametrize(("number", "code"), [(signal.SIGTERM, 143), (signal.SIGHUP, 129), (signal.SIGINT, 130)])
def test_a_signal_takes_the_half_file_away(tmp_path: Path, bag: Path, number: signal.Signals, code: int) -> None:
    # A signal that whoever runs the tests ignores, as nohup does, would be ignored by the program too.
    handler = "default_int_handler" if number == signal.SIGINT else "SIG_DFL"
    heard = f"import signal\nsignal.signal({int(number)}, signal.{handler})"
    command = [sys.executable, "-c", f"{heard}\n{ENDLESS}", "export", str(bag), "-o", str(tmp_path / "OUT.csv")]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
    try:
        wait_until(lambda: any(path.stat().st_size for path in tmp_path.iterdir()))
        assert not (tmp_path / "OUT.csv").exists()
        process.send_signal(number)
        assert (process.wait(240), list(tmp_path.iterdir())) == (code, [])
    finally:
        process.kill()
        process.communicate()
