"""The user's cache of native code: shared libraries and texts, by the hash of all their inputs.

Code that other users can write is never loaded: the folder, its parents and each file belong to the user (or, above the
folder, to root) and are writable only by the owner; symbolic links are not followed. A file ends with the SHA-256 of
its content, so that a damaged one is built again and never loaded.

Files are written under a temporary name and renamed when they are complete: if two processes build the same file at
once, both get a complete one, and a process that is killed leaves only a temporary file that is removed later.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import secrets
import stat
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from automax_ros.compile.base.native_source import NotNative

FOLDER = "automax_ros"
MOST_BYTES = 256 << 20
"""Largest size of a cache, bytes; the least recently used files are removed first (decision)."""
STALE_S = 3600
"""Age after which an unfinished file, or a compiler's folder, is taken for that of a killed process, s (decision)."""
_LIBRARY, _TEXT, _UNFINISHED = ".so", ".text", ".unfinished"
_DIGEST = 32
"""Bytes of SHA-256."""
_OTHERS = stat.S_IWGRP | stat.S_IWOTH


def user_folder() -> Path:
    """Return ``$XDG_CACHE_HOME/automax_ros``, or ``~/.cache/automax_ros``; a relative XDG_CACHE_HOME does not count.

    Raises:
        NotNative: the user has no home either.
    """
    base = Path(os.environ.get("XDG_CACHE_HOME", ""))
    if base.is_absolute():
        return base / FOLDER
    home = Path(os.environ.get("HOME", ""))
    if not home.is_absolute():
        raise NotNative("there is nowhere to keep native code: set HOME, or XDG_CACHE_HOME, to a folder's whole path")
    return home / ".cache" / FOLDER


@dataclass(frozen=True)
class NativeCache:
    """A cache in a folder, by default the user's; ``most_bytes`` is its largest size."""

    folder: Path | None = None
    most_bytes: int = MOST_BYTES

    def found(self, key: str) -> Path | None:
        """Return the library of a key, checked and safe to load, None where there is none or only a damaged one.

        Raises:
            NotNative: other users can write the file or a folder of it.
        """
        place = self._place() / (key + _LIBRARY)
        return None if _content(place) is None else place

    def read(self, key: str) -> bytes | None:
        """Return the text cached under a key, None where there is none or only a damaged one.

        Raises:
            NotNative: other users can write it.
        """
        return _content(self._place() / (key + _TEXT))

    def store(self, key: str, library: bytes) -> Path:
        """Store a library; return its path.

        Raises:
            NotNative: it cannot be written, or other users could write it.
        """
        return self._store(key + _LIBRARY, library)

    def keep(self, key: str, text: bytes) -> None:
        """Store a text.

        Raises:
            NotNative: it cannot be written, or other users could write it.
        """
        self._store(key + _TEXT, text)

    def _store(self, name: str, content: bytes) -> Path:
        place = self._place()
        with _open_folder(place) as folder:
            try:
                self._write(folder, name, content + _digest(name, content))
                self._make_room(folder, name)
            except OSError as error:
                raise NotNative(_unusable(place, error.strerror or str(error))) from error
        return place / name

    def _place(self) -> Path:
        folder = user_folder() if self.folder is None else self.folder
        try:
            for part in (*reversed(folder.parents), folder):  # mkdir(parents=True) could make them group-writable
                if not part.exists():
                    with contextlib.suppress(FileExistsError):
                        part.mkdir(mode=0o700)
            return folder.parent.resolve(strict=True) / folder.name
        except OSError as error:
            raise NotNative(_unusable(folder, error.strerror or str(error))) from error

    def _write(self, folder: int, name: str, content: bytes) -> None:
        unfinished = f"{name}.{secrets.token_hex(8)}{_UNFINISHED}"
        file = os.open(
            unfinished, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW | os.O_CLOEXEC, 0o600, dir_fd=folder
        )
        try:
            with os.fdopen(file, "wb") as stream:
                stream.write(content)
                stream.flush()
                os.fsync(stream.fileno())
            os.rename(unfinished, name, src_dir_fd=folder, dst_dir_fd=folder)
        except BaseException:
            with contextlib.suppress(OSError):
                os.unlink(unfinished, dir_fd=folder)
            raise

    def _make_room(self, folder: int, kept: str) -> None:
        """Remove remains of killed processes, then the oldest files until the others fit."""
        total, now = 0, os.stat(kept, dir_fd=folder).st_mtime
        for _, size, name in sorted(_files(folder, now), reverse=True):
            total += size
            if total > self.most_bytes and name != kept:
                with contextlib.suppress(FileNotFoundError):
                    os.unlink(name, dir_fd=folder)


def _files(folder: int, now: float) -> Iterator[tuple[float, int, str]]:
    """Yield time, size and name of each file; remove old unfinished ones; ``now`` in the time of the files, s."""
    for name in os.listdir(folder):
        with contextlib.suppress(FileNotFoundError):
            known = os.stat(name, dir_fd=folder, follow_symlinks=False)
            if name.endswith((_LIBRARY, _TEXT)):
                yield known.st_mtime, known.st_size, name
            elif name.endswith(_UNFINISHED) and known.st_mtime < now - STALE_S:
                os.unlink(name, dir_fd=folder)


@contextlib.contextmanager
def _open_folder(place: Path) -> Iterator[int]:
    """Open the folder after checking that only its owner can write it and its parents."""
    for above in place.parents:
        _require_safe_above(above)
    try:
        folder = os.open(place, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW | os.O_CLOEXEC)
    except OSError as error:
        raise NotNative(_unusable(place, error.strerror or str(error))) from error
    try:
        _require_own(os.fstat(folder), place, stat.S_ISDIR)
        yield folder
    finally:
        os.close(folder)


def _require_own(known: os.stat_result, path: Path, is_kind: object) -> None:
    assert callable(is_kind)
    if not is_kind(known.st_mode):
        raise NotNative(_unusable(path, "it is not what the cache has put there"))
    if known.st_uid != os.geteuid():
        raise NotNative(_unusable(path, "it belongs to another user"))
    if known.st_mode & _OTHERS:
        raise NotNative(f"{path} can be written by other users: chmod go-w {path}")


def _require_safe_above(path: Path) -> None:
    """Refuse a folder in which other users could replace the cache.

    In one with the sticky bit, such as /tmp, users cannot move the files of others.
    """
    known = path.stat()
    if known.st_uid not in (0, os.geteuid()):
        raise NotNative(_unusable(path, "it belongs to another user"))
    if known.st_mode & _OTHERS and not known.st_mode & stat.S_ISVTX:
        raise NotNative(f"{path} can be written by other users: chmod go-w {path}, or set XDG_CACHE_HOME elsewhere")


def _content(path: Path) -> bytes | None:
    """Return the content of a file of the cache, None where it is missing or damaged; mark it as used."""
    with _open_folder(path.parent) as folder:
        try:
            file = os.open(path.name, os.O_RDONLY | os.O_NOFOLLOW | os.O_CLOEXEC | os.O_NONBLOCK, dir_fd=folder)
        except FileNotFoundError:
            return None
        except OSError as error:
            raise NotNative(_unusable(path, error.strerror or str(error))) from error
        try:
            _require_own(os.fstat(file), path, stat.S_ISREG)
            content = _verify(file, path.name)
            if content is not None:
                with contextlib.suppress(OSError):
                    os.utime(file)
            return content
        finally:
            os.close(file)


def _digest(name: str, content: bytes) -> bytes:
    """Return the digest of a file of the cache; it includes the name, or one file could replace another."""
    return hashlib.sha256(name.encode() + b"\0" + content).digest()


def _verify(file: int, name: str) -> bytes | None:
    with os.fdopen(os.dup(file), "rb") as stream:
        stored = stream.read()
    content = stored[:-_DIGEST]
    return content if _digest(name, content) == stored[-_DIGEST:] else None


def _unusable(path: Path, why: str) -> str:
    return f"native code cannot be kept in {path}: {why}; set XDG_CACHE_HOME to a folder of your own"
