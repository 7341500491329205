"""A pipe in a recording's folder: every command that reads recordings refuses it at once and waits for no writer."""

import os
import shutil

import pytest
from recordings.independent import GOLDEN

from automax_ros.recordings.mcap.errors import BagError
from automax_ros.recordings.read.playback import survey

pytestmark = pytest.mark.usefixtures("no_waiting")
COMMANDS = {
    "info": ["bag", "info", "bag"],
    "check": ["bag", "info", "bag", "--check"],
    "repair": ["bag", "repair", "bag"],
    "replay": ["replay", "bag"],
    "export": ["export", "bag", "-o", "out.csv"],
    "plot": ["plot", "bag", "SPEED_FDBK%", "-o", "out.png"],
    "report": ["report", "bag", "-o", "out.html"],
    "compare": ["compare", "bag", "bag"],
}


@pytest.fixture(params=["scans_0.mcap", "metadata.yaml", "scans_0.mcap alone", "other.mcap"])
def bag(request, automax):
    """The example with one of its files replaced by a pipe, or with a pipe besides that metadata.yaml names."""
    folder = automax.folder / "bag"
    shutil.copytree(GOLDEN, folder)
    name, _, alone = request.param.partition(" ")
    if name == "other.mcap":
        told = (folder / "metadata.yaml").read_text()
        (folder / "metadata.yaml").write_text(told.replace("scans_0.mcap", name))
    (folder / name).unlink(missing_ok=True)
    if alone:
        (folder / "metadata.yaml").unlink()
    os.mkfifo(folder / name)
    return request.param


@pytest.mark.parametrize("command", COMMANDS)
def test_a_pipe_is_refused_at_once(automax, bag, command):
    result = automax(*COMMANDS[command])
    data_is_there = bag in ("metadata.yaml", "other.mcap")
    codes = {"info": 1, "check": 1, "repair": 0} if data_is_there else {}
    assert result.code == codes.get(command, 2)
    told = result.out + result.err
    assert any(text in told for text in ("is not a regular file", "holds no .mcap file", "has no metadata.yaml"))


def test_play_refuses_it_before_ros_is_needed(automax, bag):
    with pytest.raises(BagError, match=r"is not a regular file|has no metadata\.yaml"):
        survey(automax.folder / "bag")
