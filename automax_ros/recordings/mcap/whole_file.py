"""Files that are there whole or not at all: written under another name next to their place, renamed at the end."""

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
"""A pipe may be without a reader for a second: whoever is started at the same time gets there (decision)."""


@contextmanager
def atomic_write(path: Path) -> Iterator[Path]:
    """Give the path to write to, in the same folder and with the same suffix; ``path`` is replaced when the block ends.

    If the block ends with an exception the new file is removed, and ``path`` stays as it was. A pipe, /dev/stdout
    and whatever else is not a regular file is given itself, open until the block ends.

    Raises:
        OSError: the folder or the file there cannot be written, or it is a pipe that nobody reads.
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
    """Open a path for writing, as ``open`` takes it for its ``opener``; never wait for a pipe's reader without end.

    Raises:
        OSError: it cannot be opened; a pipe is refused that nobody has begun to read within a second (decision).
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
    """Keep what is not a regular file open while the block runs, so that a pipe's reader sees no end before it.

    Raises:
        OSError: it cannot be written, or it is a pipe that nobody reads.
    """
    descriptor = open_at_once(path, os.O_WRONLY)
    try:
        yield
    finally:
        os.close(descriptor)


def is_direct(path: Path) -> bool:
    """Whether a path has to be written itself; /dev/stdout has to be even where it is redirected to a file."""
    folder = os.path.realpath(path.parent)
    return folder == "/dev" or folder.startswith("/proc/") or (path.exists() and not path.is_file())


def _mode_of(target: Path) -> int | None:
    """Return the permissions of the file that is replaced; one that must not be written is refused."""
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
