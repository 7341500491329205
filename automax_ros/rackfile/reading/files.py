"""Reads untrusted files: only regular files, within a size and within a folder. Task sources may be old."""

from __future__ import annotations

import codecs
import os
import stat
from io import BufferedReader
from pathlib import Path, PurePosixPath, PureWindowsPath

from automax_ros.core.diagnostics import SourceText

MAX_BYTES = 1_000_000
"""Largest rack file and largest task source, in bytes (decision: a bound on untrusted files)."""


class FileFault(OSError):
    """A file cannot be used; ``too_large`` marks the one reason that has its own problem code."""

    def __init__(self, message: str, *, too_large: bool = False) -> None:
        super().__init__(message)
        self.too_large = too_large


def open_regular(path: Path) -> BufferedReader:
    """Open a regular file for reading; a pipe or a device is refused at once, instead of waiting for its other end.

    Raises:
        FileFault: the path is a folder, a pipe or a device.
        OSError: the file does not exist or cannot be opened.
    """
    descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
    try:
        mode = os.fstat(descriptor).st_mode
        if not stat.S_ISREG(mode):
            raise FileFault("is a folder, not a file" if stat.S_ISDIR(mode) else "is not a regular file")
    except BaseException:
        os.close(descriptor)
        raise
    return os.fdopen(descriptor, "rb")


def read_bytes(path: Path, limit: int = MAX_BYTES) -> bytes:
    """Return the bytes of a regular file.

    Raises:
        FileFault: the file does not exist, is not a regular file, cannot be read, or has more than ``limit`` bytes.
    """
    try:
        with open_regular(path) as stream:
            data = stream.read(limit + 1)
    except FileFault:
        raise
    except (OSError, ValueError, RuntimeError) as error:
        raise FileFault(f"cannot be read: {getattr(error, 'strerror', None) or error}") from error
    if len(data) > limit:
        raise FileFault(f"has more than {limit} bytes", too_large=True)
    return data


def is_inside(path: Path, folder: Path) -> bool:
    """Return whether a path, all symbolic links followed, ends inside a folder; FALSE if that cannot be determined."""
    try:
        return path.resolve().is_relative_to(folder.resolve())
    except (OSError, ValueError, RuntimeError):
        return False


def lies_next_to(path: Path, other: Path) -> bool:
    """Return whether a path ends in or below the folder of another file, all symbolic links followed.

    If every installed file is a link to its source (colcon), a rack file and its tasks meet there.
    """
    try:
        return is_inside(path, other.resolve().parent)
    except (OSError, ValueError, RuntimeError):
        return False


def stays_next_to(text: str, other: Path) -> bool:
    """Return whether a path in a file leads to the file's folder or below: relative, without .., links followed."""
    windows = PureWindowsPath(text)
    if PurePosixPath(text).is_absolute() or windows.drive or windows.root or ".." in windows.parts:
        return False
    path = other.parent / text
    return is_inside(path, other.parent) or lies_next_to(path, other)


def read_task_source(path: Path) -> SourceText:
    """Return a task's source, named by its path.

    A text that is not UTF-8 is read with one character per byte (Latin-1): editors of the rack's time wrote such bytes
    into remarks, and every column stays where it is (decision).

    Raises:
        FileFault: the file cannot be read or is too large.
    """
    data = read_bytes(path).removeprefix(codecs.BOM_UTF8)
    try:
        return SourceText(str(path), data.decode())
    except UnicodeDecodeError:
        return SourceText(str(path), data.decode("latin-1"))
