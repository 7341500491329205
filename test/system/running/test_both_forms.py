"""Compiled ahead of time or plain Python: the same recording, byte for byte."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from automax_ros.core import compiled

ROOT = Path(__file__).parents[3]


def automax(switch, *arguments):
    code = "from automax_ros.cli.main import entry; entry()"
    environment = {**os.environ, compiled.VARIABLE: switch, "PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-c", code, *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=True, env=environment, cwd=ROOT).stdout


@pytest.mark.parametrize("rack", ["dc_drive", "section_drive"])
def test_recordings_are_the_same(tmp_path, rack):
    if "compiled: " not in automax("", "--version"):
        pytest.skip("nothing is compiled ahead of time here, or a source has changed since")
    assert "compiled: " not in automax("off", "--version")
    for switch in ("auto", "off"):
        bag = tmp_path / switch / "bag"
        bag.parent.mkdir()
        automax(switch, "run", "--simulated", "--duration", 2, "--record", bag, ROOT / "config" / rack / "rack.yaml")
    files = sorted(path.name for path in (tmp_path / "off" / "bag").iterdir())
    assert files == sorted(path.name for path in (tmp_path / "auto" / "bag").iterdir())
    assert any(name.endswith(".mcap") for name in files)
    for name in files:
        assert (tmp_path / "auto" / "bag" / name).read_bytes() == (tmp_path / "off" / "bag" / name).read_bytes()
