"""A file that is replaced is the old one or the new one, wherever the machine stops; links and permissions stay."""

import contextlib
import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from automax_ros.core import safe_file
from automax_ros.core.safe_file import atomic_write, replace_file

OLD, NEW = b"old" * 1000, b"new" * 2000


class Dead(BaseException):
    """The machine has stopped: nothing is carried out any more."""


class Machine:
    """Stops before one of the calls to the operating system, after which none has an effect."""

    def __init__(self, lives: int) -> None:
        self.lives, self.calls = lives, []

    def call(self, name, function):
        def counted(*arguments, **options):
            if self.lives == 0:
                raise Dead
            self.lives -= 1
            self.calls.append(name)
            return function(*arguments, **options)

        return counted


class File:
    """An open file of a machine that may stop; a write that is cut off leaves half of it."""

    def __init__(self, machine: Machine, descriptor: int) -> None:
        self._machine, self._descriptor = machine, descriptor

    def write(self, data: bytes) -> None:
        half = len(data) // 2
        for name, part in (("write", data[:half]), ("write", data[half:])):
            self._machine.call(name, os.write)(self._descriptor, part)

    def flush(self) -> None:
        pass

    def fileno(self) -> int:
        return self._descriptor

    def __enter__(self):
        return self

    def __exit__(self, *_):
        os.close(self._descriptor)


@pytest.fixture
def machine(monkeypatch):
    def made(lives: int) -> Machine:
        found = Machine(lives)
        for name in ("fsync", "replace", "unlink", "open"):
            monkeypatch.setattr(safe_file.os, name, found.call(name, getattr(os, name)))
        monkeypatch.setattr(safe_file.os, "fdopen", lambda descriptor, _: File(found, descriptor))
        return found

    yield made
    monkeypatch.undo()


def test_whole_and_durable_in_this_order(tmp_path, machine):
    path = tmp_path / "state.json"
    running = machine(100)
    replace_file(path, NEW)
    assert running.calls == ["open", "open", "write", "write", "fsync", "replace", "open", "fsync"]
    assert path.read_bytes() == NEW
    assert path.stat().st_mode & 0o777 == 0o600, "for its owner alone"


@pytest.mark.parametrize("lives", range(9))
@pytest.mark.parametrize("before", [OLD, None])
def test_wherever_it_stops_the_file_is_the_old_or_the_new_one(tmp_path, machine, monkeypatch, lives, before):
    path = tmp_path / "state.json"
    if before is not None:
        path.write_bytes(before)
    running = machine(lives)
    with contextlib.suppress(Dead):
        replace_file(path, NEW)
    monkeypatch.undo()
    found = path.read_bytes() if path.exists() else None
    assert found == (NEW if "replace" in running.calls else before)
    replace_file(path, OLD)
    assert path.read_bytes() == OLD, "what a crash has left is in nobody's way"


@pytest.mark.parametrize("failing", ["fsync", "replace"])
def test_what_cannot_be_written_leaves_the_old_file_and_nothing_else(tmp_path, monkeypatch, failing):
    path = tmp_path / "state.json"
    path.write_bytes(OLD)

    def fail(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(safe_file.os, failing, fail)
    with pytest.raises(OSError, match="No space left"):
        replace_file(path, NEW)
    assert (path.read_bytes(), os.listdir(tmp_path)) == (OLD, ["state.json"])


def test_a_folder_that_is_not_there_is_an_error(tmp_path: Path):
    with pytest.raises(FileNotFoundError):
        replace_file(tmp_path / "nowhere" / "state.json", NEW)


WRITER = """\
import sys
from pathlib import Path
from automax_ros.core.safe_file import replace_file
number = 0
while True:
    replace_file(Path(sys.argv[1]), str(number % 10).encode() * 300_000)
    number += 1
"""


def test_a_killed_writer_leaves_a_whole_file(tmp_path):
    path = tmp_path / "state.json"
    replace_file(path, b"0" * 300_000)
    for kill in range(8):
        with subprocess.Popen([sys.executable, "-c", WRITER, str(path)]) as writer:
            first = path.stat().st_ino
            while path.stat().st_ino == first:
                time.sleep(0.001)
            time.sleep(0.0017 * kill)
            writer.kill()
        data = path.read_bytes()
        assert len(data) == 300_000
        assert len(set(data)) == 1


def test_the_file_appears_at_the_end_with_its_suffix(tmp_path: Path) -> None:
    output = tmp_path / "OUT.svg"
    with atomic_write(output) as place:
        assert (place.parent, place.suffix, place != output) == (tmp_path, ".svg", True)
        place.write_text("whole")
        assert not output.exists()
    assert [(path.name, path.read_text()) for path in tmp_path.iterdir()] == [("OUT.svg", "whole")]


def test_links_and_permissions_stay(tmp_path: Path) -> None:
    target = tmp_path / "there" / "real.csv"
    target.parent.mkdir()
    target.write_text("old")
    target.chmod(0o640)
    link = tmp_path / "link.csv"
    link.symlink_to(target)
    with atomic_write(link) as place:
        place.write_text("new")
    assert link.is_symlink()
    assert (target.read_text(), target.stat().st_mode & 0o777) == ("new", 0o640)
    with atomic_write(tmp_path / "fresh.csv") as place:
        place.write_text("new")
    with (tmp_path / "usual").open("w"):
        pass
    assert (tmp_path / "fresh.csv").stat().st_mode == (tmp_path / "usual").stat().st_mode


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everything")
def test_a_file_that_must_not_be_written_is_not_replaced(tmp_path: Path) -> None:
    output = tmp_path / "OUT.csv"
    output.write_text("old")
    output.chmod(0o444)
    with pytest.raises(PermissionError), atomic_write(output):
        pass
    assert output.read_text() == "old"
