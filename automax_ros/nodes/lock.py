"""One rack of a name in one ROS domain on one host: a file lock that dies with its process."""

from __future__ import annotations

import fcntl
import os
import tempfile
from pathlib import Path
from types import TracebackType

from automax_ros.core.faults import Fault
from automax_ros.core.text import quoted
from automax_ros.nodes.environment import RosUnavailable

MAX_DOMAIN = 232
"""Beyond it the ports of DDS end."""


class LockError(Fault):
    """The lock cannot be taken."""


class RackAlreadyRuns(LockError):
    """Another process of this host runs a rack of the same name in the same ROS domain."""


def domain_id() -> int:
    """Return the ROS domain of this process.

    Raises:
        RosUnavailable: ROS_DOMAIN_ID is not one that ROS accepts.
    """
    text = os.environ.get("ROS_DOMAIN_ID", "").strip() or "0"
    if not (text.isascii() and text.isdigit() and len(text) <= 3 and int(text) <= MAX_DOMAIN):
        raise RosUnavailable(f"ROS_DOMAIN_ID={quoted(text)} is not a number from 0 to {MAX_DOMAIN}")
    return int(text)


class RackLock:
    """Holds the lock while the ``with`` block lasts; the kernel frees it when the process ends, however it ends."""

    def __init__(self, namespace: str, domain: int) -> None:
        """Name the lock; nothing is taken yet."""
        self._rack = f"rack /{namespace} in ROS domain {domain}"
        self._path = Path(tempfile.gettempdir()) / f"automax_ros_{os.getuid()}_{domain}_{namespace}.lock"
        self._file = -1

    def __enter__(self) -> RackLock:
        """Take the lock.

        Raises:
            RackAlreadyRuns: another process holds it.
            LockError: its file cannot be opened.
        """
        try:
            self._file = os.open(self._path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW, 0o600)
        except OSError as error:
            raise LockError(f"{self._rack}: cannot open the lock file {self._path}: {error.strerror}") from error
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            holder = os.pread(self._file, 32, 0).decode("ascii", "replace").strip()
            os.close(self._file)
            by = f" (process {holder})" if holder.isdigit() else ""
            raise RackAlreadyRuns(
                f"{self._rack} runs already{by}: stop it first, or set another ROS_DOMAIN_ID"
            ) from None
        os.ftruncate(self._file, 0)
        os.pwrite(self._file, f"{os.getpid()}\n".encode(), 0)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Free the lock; the file stays, since removing it would let two processes hold two files of one name."""
        os.close(self._file)
