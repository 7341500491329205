"""Atomic writing of files: under another name in the same folder, renamed at the end."""

from __future__ import annotations

import contextlib
import errno
import os
import stat
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

_MOST_TRIES = 100
_LONGEST_SUFFIX = 16
_PAUSE_S = 0.01
_MOST_PAUSES = 100
"""A pipe may be without a reader for a second, for a reader that is started at the same time (decision)."""


@contextmanager
def atomic_write(path: Path) -> Iterator[Path]:
    """Yield the path to write to, in the same folder and with the same suffix; it replaces ``path`` after the block.

    If the block ends with an exception the new file is removed, and ``path`` is unchanged. For a pipe, /dev/stdout
    and anything else that is not a regular file, ``path`` itself is yielded, open until the block ends.

    Raises:
        OSError: the folder or the file in it cannot be written, or it is a pipe without a reader.
    """
    if is_direct(path):
        with held_open(path):
            yield path
        return
    target = Path(os.path.realpath(path))  # a link stays a link
    mode = _mode_of(target)
    temporary = _new_file_next_to(target, path.suffix)
    try:
        if mode is not None:
            temporary.chmod(mode)
        yield temporary
        os.replace(temporary, target)
    except BaseException:
        with contextlib.suppress(OSError):
            temporary.unlink()
        raise


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
    raise OSError(errno.ENXIO, "it is a pipe and nobody reads it", os.fspath(path))


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


def _new_file_next_to(target: Path, suffix: str) -> Path:
    if len(suffix) > _LONGEST_SUFFIX:
        suffix = ""
    for number in range(_MOST_TRIES):
        temporary = target.with_name(f".automax-{os.getpid()}-{number}{suffix}")
        with contextlib.suppress(FileExistsError):
            os.close(os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o666))
            return temporary
    raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST), str(target))
