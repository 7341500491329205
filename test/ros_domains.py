"""ROS domains for tests: in each one test alone, and no other program."""

import fcntl
import itertools
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

FIRST_PORT, PORTS = 7400, 250
"""Fast DDS takes the UDP ports from 7400 + 250 * domain on."""
DOMAINS = range(1, 81)
"""Those above, up to 101, are left to what is started by hand, to bench/ and tools/; beyond 101 their ports run into
Linux's ephemeral ports."""
SOCKETS = (Path("/proc/net/udp"), Path("/proc/net/udp6"))
LOCKS = Path(tempfile.gettempdir()) / f"automax_ros_domains_{os.getuid()}"
_turns = itertools.count()


def inhabited(tables: tuple[Path, ...] = SOCKETS) -> set[int]:
    """The domains whose ports somebody holds: a rack that a person runs, or one that an earlier test has left."""
    found = set()
    for table in tables:
        for line in table.read_text().splitlines()[1:] if table.exists() else ():
            port = int(line.split()[1].rpartition(":")[2], 16)
            found.add((port - FIRST_PORT) // PORTS)
    return found


@contextmanager
def free_domain(start: int | None = None) -> Iterator[int]:
    """A ROS domain that no other test on this machine uses while the block lasts, and in which nobody is.

    A lock file guards it, so pytest processes side by side do not hear each other. Whoever else is in a domain knows
    nothing of the lock: a second rack of the same name would answer what a test asks of its own. ``start`` is which one
    is looked at first.
    """
    LOCKS.mkdir(exist_ok=True)
    first = os.getpid() * 7 + next(_turns) if start is None else start - DOMAINS.start
    for offset in range(len(DOMAINS)):
        domain = DOMAINS[(first + offset) % len(DOMAINS)]
        with (LOCKS / str(domain)).open("w") as lock:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                continue
            if domain in inhabited():
                continue
            yield domain
            return
    pytest.fail("all ROS domains are taken by other tests or programs")
