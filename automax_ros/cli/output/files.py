"""Files that a subcommand writes: errors are reported, and an input is never overwritten."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any, TextIO

from automax_ros.core.safe_file import atomic_write, held_open, is_direct, open_at_once
from automax_ros.core.user_error import UsageError

PICTURE_FORMATS = (".png", ".svg", ".pdf")


@contextmanager
def opened_for_writing(path: Path | None) -> Iterator[TextIO]:
    """Open a table for writing; without a path, standard output.

    Raises:
        UsageError: it cannot be written.
    """
    if path is None:
        yield sys.stdout
        return
    try:
        stream = open(path, "w", encoding="utf-8", newline="", opener=open_at_once)  # noqa: SIM115
    except (OSError, ValueError) as error:
        raise _unwritable(path, error) from error
    with stream:
        yield stream


def require_writable(path: Path) -> None:
    """Refuse a file that could not be written, before the work for it begins.

    Raises:
        UsageError: it is a folder, its folder does not exist, or there is no write permission for one of both.
    """
    if not path.parent.is_dir():
        raise UsageError(f"{path} cannot be written: there is no folder {path.parent}")
    if path.is_dir():
        raise UsageError(f"{path} cannot be written: it is a folder")
    target = Path(os.path.realpath(path))
    if not is_direct(path) and not all(
        os.access(place, os.W_OK) for place in (target, target.parent) if place.exists()
    ):
        raise UsageError(f"{path} cannot be written: it, or its folder, must not be written")


@contextmanager
def held_for_writing(path: Path | None) -> Iterator[None]:
    """Keep a pipe open from before the work until its result is written; a regular file needs nothing.

    A pipe must have a reader before the work begins (decision): hours of a run are not lost at its end.

    Raises:
        UsageError: the pipe has no reader, or it cannot be written.
    """
    with ExitStack() as held:
        if path is not None:
            try:
                if is_direct(path):
                    held.enter_context(held_open(path))
            except (OSError, ValueError) as error:
                raise _unwritable(path, error) from error
        yield


def require_folder(key: str, folder: Path) -> None:
    """Refuse a folder that could not be made or written into, before the work for it begins.

    Raises:
        UsageError: the path or a parent is not a folder, or there is no write permission.
    """
    try:
        there = next(place for place in (folder, *folder.absolute().parents) if place.exists() or place.is_symlink())
        if not there.is_dir():
            raise UsageError(f"{key}: {there} is not a folder")
        if not os.access(there, os.W_OK | os.X_OK):
            raise UsageError(f"{key}: {there} must not be written")
    except (OSError, ValueError, RuntimeError) as error:
        raise UsageError(f"{key}: {folder} cannot be used: {getattr(error, 'strerror', None) or error}") from error


def write_report(path: Path, report: Mapping[str, Any]) -> None:
    """Write data as JSON, a regular file as a whole or not at all; a link stays a link (decision).

    Raises:
        UsageError: it cannot be written.
    """
    write_text(path, json.dumps(report, indent=1, allow_nan=False, ensure_ascii=False) + "\n")


def write_text(path: Path, text: str) -> None:
    """Write a text, a regular file as a whole or not at all; a link stays a link.

    Raises:
        UsageError: it cannot be written.
    """
    try:
        with atomic_write(path) as place, open(place, "w", encoding="utf-8", opener=open_at_once) as stream:
            stream.write(text)
    except (OSError, ValueError) as error:
        raise _unwritable(path, error) from error


def write_whole(path: Path, data: bytes, *, over: bool, hint: str | None = None) -> None:
    """Write the whole file or nothing; unless ``over``, never over a file that was created meanwhile.

    Raises:
        UsageError: it cannot be written.
    """
    try:
        if over:
            with atomic_write(path) as place:
                place.write_bytes(data)
        else:
            with path.open("xb") as stream:
                stream.write(data)
    except OSError as error:
        raise UsageError(f"{path} cannot be written: {error.strerror or error}", hint) from error


def _unwritable(path: Path, error: Exception) -> UsageError:
    return UsageError(f"{path} cannot be written: {getattr(error, 'strerror', None) or error}")


def require_picture_file(path: Path) -> None:
    """Refuse a picture that could not be written, before the work for it begins.

    Raises:
        UsageError: its suffix is not that of a picture format, or it is not writable (``require_writable``).
    """
    if path.suffix.lower() not in PICTURE_FORMATS:
        raise UsageError(f"{path} names no format of pictures", f"end it with {', '.join(PICTURE_FORMATS)}")
    require_writable(path)


def require_different_files(read: Mapping[str, Path], written: Mapping[str, Path | None]) -> None:
    """Refuse to overwrite an input, or to write two outputs to one file; the keys are the arguments' names.

    Raises:
        UsageError: two arguments name one file.
    """
    outputs = {key: path for key, path in written.items() if path}
    for key, path in outputs.items():
        for other, its_path in {**read, **outputs}.items():
            if key != other and _is_same_file(path, its_path):
                raise UsageError(f"{key} and {other} are the same file, {path}")


def _is_same_file(one: Path, other: Path) -> bool:
    """Whether two paths lead to one regular file, or would if it existed; /dev/null may be given twice."""
    try:
        if one.exists() and other.exists():
            return one.is_file() and one.samefile(other)
        return one.resolve() == other.resolve()
    except (OSError, ValueError, RuntimeError):
        return False
