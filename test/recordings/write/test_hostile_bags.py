"""Damaged and hostile recordings: every command that reads them ends with a message, in bounded time and memory."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections import Counter
from pathlib import Path

import pytest
from soaking import in_soak

from automax_ros.core.ticks import NS_PER_MS
from automax_ros.messages.stream.stream import RackStream
from automax_ros.recordings.write.data_file import StorageOptions
from automax_ros.recordings.write.recorder import Recorder, RecordingOptions
from recordings.live_racks import build

ROOT = Path(__file__).parents[3]
MUTANTS = 110
MEMORY_MB = 500
COMMANDS = {"export", "bag repair", "bag info", "replay"}


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A small recording of many chunks."""
    folder = tmp_path_factory.mktemp("sound")
    rack = build(folder)
    stream = RackStream(rack, rack.fingerprint)
    options = RecordingOptions(StorageOptions(chunk_ns=50 * NS_PER_MS))
    recorder = Recorder(rack, stream, folder / "bag", options)
    stream.begin()
    rack.start()
    for number in range(10):
        rack.write("REF%", number * 700)
        rack.write("NOTE$", f"n{number}")
        rack.run(0.03)
    stream.end()
    recorder.close()
    return folder / "bag"


@pytest.mark.parametrize(
    ("count", "seed"), [(MUTANTS, 1), *(in_soak(500, seed, timeout_s=3600) for seed in range(2, 12))]
)
def test_hostile_recordings(sound: Path, tmp_path: Path, count: int, seed: int) -> None:
    """Let all commands read this many mutants in a process of their own."""
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(ROOT), str(ROOT / "test")])}
    driver = [sys.executable, str(Path(__file__).with_name("hostile_driver.py"))]
    ended = subprocess.run(
        [*driver, str(sound), str(tmp_path), str(count), str(seed)],
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert ended.returncode == 0, ended.stderr[-2000:]
    results, memory = json.loads(ended.stdout)
    assert len(results) == count * len(COMMANDS)
    came_out = [(name, command, result) for name, command, result, _ in results if result not in {0, 1, 2}]
    assert not came_out, "\n".join(map(str, came_out[:5]))
    assert memory < MEMORY_MB
    codes = {name: Counter() for name in COMMANDS}
    for _, command, code, _ in results:
        codes[" ".join(command) if command[0] == "bag" else command[0]][code] += 1
    for name, counted in codes.items():
        assert counted[1] + counted[2], f"{name} refuses none: the mutants are not hostile"
        assert counted[0], f"{name} reads none: the mutants are not near enough to a recording"
