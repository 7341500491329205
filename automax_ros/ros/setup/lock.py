"""Locks for one rack of a name, or one process for each part of it, in a ROS domain of a host."""

from __future__ import annotations

import fcntl
import os
import tempfile
from contextlib import suppress
from pathlib import Path
from types import TracebackType

from automax_ros.core.text import quoted
from automax_ros.core.user_error import UserError
from automax_ros.ros.setup.environment import RosUnavailable

MAX_DOMAIN = 232
"""The highest ROS domain: above it DDS has no ports."""


class LockError(UserError):
    """The lock cannot be taken."""


class RackAlreadyRuns(LockError):
    """Another process of this host runs the rack, or this part of it, in the same ROS domain."""


def domain_id() -> int:
    """Return the ROS domain of this process.

    Raises:
        RosUnavailable: ROS_DOMAIN_ID is not one that ROS accepts.
    """
    text = os.environ.get("ROS_DOMAIN_ID", "").strip() or "0"
    if not (text.isascii() and text.isdigit() and len(text) <= 3 and int(text) <= MAX_DOMAIN):
        raise RosUnavailable(f"ROS_DOMAIN_ID={quoted(text)} is not a number from 0 to {MAX_DOMAIN}")
    return int(text)


class InstanceLock:
    """Holds the lock while the ``with`` block lasts; the kernel frees it when the process ends, however it ends.

    A process with the whole rack locks the rack exclusively. One ``process`` of a distributed rack shares the lock
    of the rack with the others, and locks its own name exclusively.
    """

    def __init__(self, namespace: str, domain: int, process: str | None = None) -> None:
        self._rack, self._process = f"rack /{namespace} in ROS domain {domain}", process
        name = f"automax_ros_{os.getuid()}_{domain}_{namespace.replace('/', '.')}"
        self._path = Path(tempfile.gettempdir()) / f"{name}.lock"
        self._files: list[tuple[int, Path]] = []

    def __enter__(self) -> InstanceLock:
        """Take the lock.

        Raises:
            RackAlreadyRuns: another process holds it.
            LockError: its file cannot be opened.
        """
        try:
            if self._process is None:
                self._take(self._path, self._rack, fcntl.LOCK_EX)
            else:
                self._take(self._path, self._rack, fcntl.LOCK_SH)
                self._take(
                    self._path.with_suffix(f".{self._process}.lock"), f"{self._process} of {self._rack}", fcntl.LOCK_EX
                )
        except LockError:
            self._free()
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._free()

    def _take(self, path: Path, what: str, how: int) -> None:
        file = self._lock_file(path, what, how)
        self._files.append((file, path))
        os.ftruncate(file, 0)
        if how == fcntl.LOCK_EX:
            os.pwrite(file, f"{os.getpid()}\n".encode(), 0)

    @staticmethod
    def _lock_file(path: Path, what: str, how: int) -> int:
        """Return the lock file, open and locked: the one at the path, not one that was removed meanwhile."""
        while True:
            try:
                file = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW, 0o600)
            except OSError as error:
                raise LockError(f"{what}: cannot open the lock file {path}: {error.strerror}") from error
            try:
                fcntl.flock(file, how | fcntl.LOCK_NB)
                if _stands_at(file, path):
                    return file
            except BlockingIOError:
                raise _held_error(file, what) from None
            except BaseException:
                os.close(file)
                raise
            os.close(file)

    def _free(self) -> None:
        """Remove the files that no other process holds, while they are locked, and close all."""
        for file, path in self._files:
            with suppress(OSError):  # others share it, or it is not ours to remove
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
                if _stands_at(file, path):
                    path.unlink()
            os.close(file)
        self._files.clear()


def _stands_at(file: int, path: Path) -> bool:
    try:
        return os.path.samestat(os.fstat(file), os.stat(path, follow_symlinks=False))
    except FileNotFoundError:
        return False


def _held_error(file: int, what: str) -> RackAlreadyRuns:
    """Return the error of a lock file that another process holds; the file is closed."""
    try:
        holder = os.pread(file, 32, 0).decode("ascii", "replace").strip()
    finally:
        os.close(file)
    # Processes that share a file leave it empty.
    by = f" (process {holder})" if holder.isdigit() else " (distributed over several processes)"
    return RackAlreadyRuns(f"{what} runs already{by}: stop it first, or set another ROS_DOMAIN_ID")
