"""Work for pieces under test: functions of a module, so that workers find them."""

import os
import signal
import time
from pathlib import Path

marks: list[int] = []
"""What the process under test has put down: a copy of it has the same, a fresh interpreter has nothing."""


def marked(_: int) -> list[int]:
    return marks


def squared(number: int) -> int:
    return number * number


def divided(number: int) -> float:
    return 1 / number


def own_process(_: int) -> int:
    return os.getpid()


def unlike_any(_: int) -> object:
    return lambda: None


def killed(notes: str, number: int, times: int) -> int:
    """Kill the process that does it, the first ``times`` times; a line in the notes for each try."""
    file = Path(notes) / str(number)
    tries = len(file.read_text().splitlines()) if file.exists() else 0
    with file.open("a") as out:
        out.write(f"{os.getpid()}\n")
    if tries < times:
        os.kill(os.getpid(), signal.SIGKILL)
    return number


def long(notes: str, number: int) -> int:
    """Say that it has begun, and last until it is killed."""
    (Path(notes) / str(number)).write_text(str(os.getpid()))
    time.sleep(600)
    return number


def slow(number: int) -> int:
    time.sleep(0.05)
    return number


def noted(notes: str, number: int) -> int:
    with (Path(notes) / str(number)).open("a") as out:
        out.write(f"{os.getpid()}\n")
    time.sleep(0.2)
    return number
