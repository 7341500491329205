"""SIGINT and SIGTERM at any moment from a program's first: no traceback, sound bags, nothing left in shared memory."""

import random
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from automax_ros.cli.main import main
from automax_ros.recordings.read.reader import BagReader
from automax_ros.recordings.read.soundness import verdict_of
from system.examples.test_python_page import IN_ROS
from system.running.test_stopping import READY, shared_memory
from system.support import COMMAND, PATIENCE_S, RACKS, ROOT, Automax, catches

OPERATED = RACKS / "operated" / "rack.yaml"
HORIZON_S = 2.5
"""By then all programs are at work on a quiet machine; most moments are chosen early, where most happens."""
SECOND_S = 0.05
NOTHING = "nothing of it can be replayed"
SIGNALS = (signal.SIGINT, signal.SIGTERM)

LIVE = ("run", str(OPERATED), "--state", "{tmp}/state", "--record", "{tmp}/bag")
NODE = ("node", str(OPERATED), "--module", "1", "--state", "{tmp}/state")
RECORD = ("record", "OPERATED", "--output", "{tmp}/bag")
PLAY = ("play", "{played}", "--namespace", "again", "--loop")
WATCH = ("ctl", "OPERATED", "watch", "COUNT!", "--every", "0.1")
GET = ("ctl", "OPERATED", "get", "COUNT!")
PYTHON = (sys.executable, "-c", IN_ROS.replace(" and len(seen) < 20", ""))


@pytest.fixture(scope="module")
def played(module_domain_id, tmp_path_factory) -> Path:
    bag = tmp_path_factory.mktemp("played") / "bag"
    assert main(["run", str(OPERATED), "--simulated", "--duration", "30", "--record", str(bag)]) == 0
    return bag


@pytest.fixture(scope="module")
def running(module_domain_id) -> Iterator[None]:
    """A rack that is recorded, watched and asked."""
    with Automax("run", OPERATED) as process:
        process.wait_for_line(READY)
        yield
        assert process.end(signal.SIGINT).code == 0


def end_at_a_random_moment(command: tuple[str, ...], seed: int) -> str:
    """Start a program, send it one signal or two, and look how it ends; return its output.

    ``ctl`` has the signal's exit code, ``record`` 1 where nothing that it recorded can be replayed.

    The first moment is that at which the program itself takes SIGTERM: before it the interpreter starts.
    """
    chance = random.Random(f"{command[:2]} {seed}")
    numbers = chance.choices(SIGNALS, k=1 + seed % 2)
    own = command[0] == sys.executable
    others = {str(path) for path in Path("/dev/shm").iterdir()}  # a program maps those of whom it listens to
    process = subprocess.Popen(
        command if own else (*COMMAND, *command), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=ROOT
    )
    try:
        deadline = time.monotonic() + PATIENCE_S
        while not catches(process.pid, signal.SIGTERM) and time.monotonic() < deadline:
            time.sleep(0.0005)
        delay = chance.random() ** 2 * HORIZON_S
        time.sleep(delay)
        mapped = shared_memory(process.pid) - others
        asked = time.monotonic()
        for number in numbers:
            process.send_signal(number)
            time.sleep(SECOND_S * (len(numbers) - 1))
        out, err = process.communicate(timeout=PATIENCE_S)
    finally:
        process.kill()
    told = f"{numbers} {delay:.3f} s after the first line: exit code {process.returncode}, {out!r}"
    print(f"{told}, ended after {time.monotonic() - asked:.2f} s")
    assert err == "", told
    good = {128 + number for number in numbers} if command[0] == "ctl" else {0}
    if own and len(numbers) > 1:  # rclpy.shutdown and Python give signals back: the second may then end it
        good |= {-number for number in numbers}
    if command == WATCH or (command == GET and out):  # what was asked for has been told
        good |= {0}
    if command[0] == "record" and ("nothing was recorded" in out or NOTHING in out):
        good = {1}
    assert process.returncode in good, told
    assert {name for name in mapped if Path(name).exists()} == set(), told
    return out


def check_bag(bag: Path, out: str) -> None:
    """A recording was closed and can be read, or was never begun; the program said so of one that is not sound."""
    if not bag.exists():
        return
    assert re.search(r"^\s+files:", (bag / "metadata.yaml").read_text(), re.MULTILINE)
    list(BagReader(bag).messages())
    fault = verdict_of(BagReader(bag)).fault
    assert (fault is None) == (NOTHING not in out and "nothing was recorded" not in out), (fault, out)
    assert fault is None or fault.code in {"AMX6820", "AMX6832"}, fault


def ends_in_order(command: tuple[str, ...], seeds: range, tmp_path: Path, played: Path | None = None) -> None:
    for seed in seeds:
        place = tmp_path / str(seed)
        place.mkdir()
        filled = tuple(word.replace("{tmp}", str(place)).replace("{played}", str(played)) for word in command)
        print(f"seed {seed}")
        out = end_at_a_random_moment(filled, seed)
        check_bag(place / "bag", out)


def moments(command: tuple[str, ...], few: int) -> list[object]:
    """Return the seeds of both kinds of run: 20 moments in all for `make test`, 300 for `make soak`."""
    soak = pytest.param(command, range(10, 60), marks=[pytest.mark.soak, pytest.mark.timeout(1800)])
    return [pytest.param(command, range(few)), soak]


@pytest.mark.parametrize(("command", "seeds"), [*moments(LIVE, 6), *moments(NODE, 2)])
def test_a_rack_ends_in_order(ros_domain_id, tmp_path, command, seeds):
    ends_in_order(command, seeds, tmp_path)


@pytest.mark.parametrize(("command", "seeds"), [*moments(RECORD, 4), *moments(WATCH, 2), *moments(GET, 2)])
def test_who_speaks_to_a_rack_ends_in_order(running, tmp_path, command, seeds):
    ends_in_order(command, seeds, tmp_path)


@pytest.mark.parametrize(("command", "seeds"), moments(PLAY, 2))
def test_a_player_ends_in_order(played, tmp_path, command, seeds):
    ends_in_order(command, seeds, tmp_path, played)


@pytest.mark.parametrize(("command", "seeds"), moments(PYTHON, 2))
def test_a_program_of_its_user_ends_in_order(ros_domain_id, tmp_path, command, seeds):
    """That of docs/python.md."""
    ends_in_order(command, seeds, tmp_path)
