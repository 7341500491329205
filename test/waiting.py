"""What tests of processes and threads wait for."""

import time
from collections.abc import Callable
from pathlib import Path

PATIENCE_S = 240.0
"""After this time a test gives up. It decides nothing where the program is sound: a start takes 2.5 s of a core, and
sixteen others may want that core too."""


def wait_until(condition: Callable[[], object], pause_s: float = 0.02) -> None:
    """Wait for a condition, looking at it again and again."""
    deadline = time.monotonic() + PATIENCE_S
    while not condition():
        assert time.monotonic() < deadline, "the condition never came true"
        time.sleep(pause_s)


def has_ended(pid: int) -> bool:
    """Whether a process has ended; whoever takes over orphans buries it when it finds the time."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] in "ZX"
    except (FileNotFoundError, ProcessLookupError):
        return True
