"""Writes files whole: under another name in the same folder, renamed at the end; pipes and devices directly."""

from __future__ import annotations

import contextlib
import errno
import os
import stat
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

_LONGEST_SUFFIX = 16
_PAUSE_S = 0.01
_MOST_PAUSES = 100
"""A pipe may be without a reader for a second, for a reader that is started at the same time (decision)."""


@contextmanager
def atomic_write(path: Path, mode: int = 0o666) -> Iterator[Path]:
    """Yield the path to write to, in the same folder and with the same suffix; it replaces ``path`` after the block.

    If the block ends with an exception the new file is removed, and ``path`` is unchanged. A file that is replaced
    keeps its permissions, a new one gets those of ``mode``, less the umask. For a pipe, /dev/stdout and anything else
    that is not a regular file, ``path`` itself is yielded, open until the block ends.

    Raises:
        OSError: the folder or the file in it cannot be written, or it is a pipe without a reader.
    """
    if is_direct(path):
        with held_open(path):
            yield path
        return
    target = Path(os.path.realpath(path))  # a link stays a link
    present = _mode_of(target)
    temporary = _new_file_next_to(target, path.suffix, mode)
    try:
        if present is not None:
            temporary.chmod(present)
        yield temporary
        os.replace(temporary, target)
    except BaseException:
        with contextlib.suppress(OSError):
            temporary.unlink()
        raise


def replace_file(path: Path, data: bytes) -> None:
    """Replace a file, for its owner alone if it is new; a crash at any instant leaves the old one or the new one.

    The data is on the disk before the name leads to it, and the name before this returns. A crash may leave a temporary
    file next to it, whose name begins with a point.

    Raises:
        OSError: it cannot be written; the old file stays.
    """
    with atomic_write(path, 0o600) as place, os.fdopen(os.open(place, os.O_WRONLY), "wb") as file:
        file.write(data)
        file.flush()
        os.fsync(file.fileno())
    with contextlib.suppress(OSError):  # not every file system can do that for folders
        sync_path(path.parent)


def sync_path(path: Path) -> None:
    """Wait until a file or folder is on the disk."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def open_at_once(path: str | os.PathLike[str], flags: int) -> int:
    """Open a path for writing, as an ``opener`` for ``open``, without waiting indefinitely for a pipe's reader.

    Raises:
        OSError: it cannot be opened; a pipe is refused if it has no reader within a second (decision).
    """
    for _ in range(_MOST_PAUSES):
        try:
            descriptor = os.open(path, flags | os.O_NONBLOCK | os.O_CLOEXEC, 0o666)
        except OSError as error:
            if error.errno != errno.ENXIO or not stat.S_ISFIFO(os.stat(path).st_mode):
                raise
            threading.Event().wait(_PAUSE_S)
        else:
            os.set_blocking(descriptor, True)
            return descriptor
    raise OSError(errno.ENXIO, "it is a pipe without a reader", os.fspath(path))


@contextmanager
def held_open(path: Path) -> Iterator[None]:
    """Keep a pipe or other special file open while the block lasts, so that a pipe's reader sees no end before.

    Raises:
        OSError: it cannot be written, or it is a pipe without a reader.
    """
    descriptor = open_at_once(path, os.O_WRONLY)
    try:
        yield
    finally:
        os.close(descriptor)


def is_direct(path: Path) -> bool:
    """Whether a path must be written directly, not replaced; /dev/stdout must be even if redirected to a file."""
    folder = os.path.realpath(path.parent)
    return folder == "/dev" or folder.startswith("/proc/") or (path.exists() and not path.is_file())


def _mode_of(target: Path) -> int | None:
    """Return the permissions of the file to be replaced; refuse one without write permission."""
    try:
        mode = stat.S_IMODE(target.stat().st_mode)
    except FileNotFoundError:
        return None
    if not os.access(target, os.W_OK):
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(target))
    return mode


def _new_file_next_to(target: Path, suffix: str, mode: int) -> Path:
    number = 0
    while True:
        name = f".automax-{os.getpid()}-{number}{suffix if len(suffix) <= _LONGEST_SUFFIX else ''}"
        with contextlib.suppress(FileExistsError):  # of another thread, or left by a crash
            os.close(os.open(target.with_name(name), os.O_WRONLY | os.O_CREAT | os.O_EXCL, mode))
            return target.with_name(name)
        number += 1
