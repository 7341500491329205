"""C text to a shared library: the compiler, its options, and what a library's name in the cache depends on."""

from __future__ import annotations

import contextlib
import hashlib
import os
import platform
import shutil
import signal
import subprocess
import sys
import sysconfig
import tempfile
import threading
import weakref
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from automax_ros.compile.native.cache import NativeCache
from automax_ros.compile.native.source import NotNative

FLAGS = ("-std=c11", "-ffp-contract=off", "-fno-fast-math", "-fwrapv", "-fPIC", "-shared")
"""Nothing among them changes bits: no fused multiply-add, and integers that overflow wrap around."""
LONG_TEXT = 200_000
"""Characters from which on a text is compiled at -O1, not -O2 (decision).

A task of 2,000 lines, 800,000 characters, takes 5 s and not 15, and scans as quickly within a few percent.
"""
MOST_TEXT = 4_000_000
"""Characters of a text that is compiled (decision): a task of 10,000 lines, and 1 GB of memory for the compiler."""
LIMIT_S = 120.0
"""Time that the compiler has for one text, s (decision): a task of 2,000 lines takes a few."""
_USUAL = ("cc", "gcc", "clang")
_RUNNING: dict[subprocess.Popen[str], threading.Thread] = {}
"""The compilers that are under way, and the threads that wait for them."""
_ABANDONED: weakref.WeakSet[threading.Thread] = weakref.WeakSet()
"""Threads that nobody waits for any more."""
_MESSAGE = 400
"""Characters of what the compiler says that are passed on."""


@dataclass(frozen=True)
class Compiler:
    """A C compiler: its path, what it says it is, and the folders in which it finds its helpers."""

    path: str
    version: str
    search: str


def find_compiler(limit_s: float = LIMIT_S) -> Compiler:
    """Return the compiler that CC names, a whole path or a name on PATH, or cc, gcc or clang.

    Raises:
        NotNative: there is none, or CC names none.
    """
    # A relative folder on PATH is a compiler that whoever wrote the working folder has put there.
    search = os.pathsep.join(part for part in os.environ.get("PATH", "").split(os.pathsep) if os.path.isabs(part))
    named = os.environ.get("CC", "")
    if named and os.sep in named and not os.path.isabs(named):
        raise NotNative(f"CC={named} is neither a whole path nor a name on PATH")
    for name in (named,) if named else _USUAL:
        path = shutil.which(name, path=search)
        if path is not None:
            return Compiler(path, _version(path, search, _stamp(path), limit_s), search)
    missing = f"CC names {named}, which is not there" if named else "there is no C compiler: install gcc"
    raise NotNative(missing)


def require_tools(limit_s: float = LIMIT_S) -> None:
    """Look for all that a native task is built with.

    Raises:
        NotNative: there is no compiler, or ``Python.h`` is missing.
    """
    find_compiler(limit_s)
    python_options()


def library(text: str, cache: NativeCache, options: Sequence[str] = (), limit_s: float = LIMIT_S) -> Path:
    """Return the library of a C text: from the cache, or built and kept there.

    Raises:
        NotNative: no compiler, it fails or takes longer than ``limit_s``, the text is too long, or the cache not safe.
    """
    if len(text) > MOST_TEXT:
        raise NotNative(f"its C text would have {len(text):,} characters, more than {MOST_TEXT:,}")
    compiler = find_compiler(limit_s)
    options = (level_of(text), *options)
    key = key_of(text, compiler, options)
    found = cache.found(key)
    return found if found is not None else cache.store(key, build(text, compiler, options, limit_s))


def level_of(text: str) -> str:
    """Return the compiler's option for how much it does to make a text quick."""
    return "-O1" if len(text) >= LONG_TEXT else "-O2"


def key_of(text: str, compiler: Compiler, options: Sequence[str] = ()) -> str:
    """Return the SHA-256 of all that a library depends on: text, options, compiler, machine, C library."""
    parts = (text, *FLAGS, *options, compiler.path, compiler.version, platform.machine(), *platform.libc_ver())
    return hashlib.sha256(os.fsencode("\0".join(parts))).hexdigest()


def build(text: str, compiler: Compiler, options: Sequence[str] = (), limit_s: float = LIMIT_S) -> bytes:
    """Return a library as the compiler makes it of a text, without a shell and without the variables that steer it.

    Raises:
        NotNative: the compiler fails, or takes longer than ``limit_s`` s.
    """
    with tempfile.TemporaryDirectory(prefix="automax_native_") as folder:
        made = Path(folder, "made.so")
        command = [compiler.path, *FLAGS, *options, "-x", "c", "-", "-o", str(made), "-lm"]
        _run(command, _environment(compiler.search, folder), text, limit_s)
        if not made.is_file():
            raise NotNative(f"{compiler.path} has written no library")
        return made.read_bytes()


def abandon(threads: Iterable[threading.Thread]) -> None:
    """End the compilers that these threads wait for, and each that they will start: nobody waits for the threads."""
    _ABANDONED.update(threads)
    for process, thread in list(_RUNNING.items()):
        if thread in _ABANDONED:
            _kill(process)


def python_options() -> tuple[str, ...]:
    """Return the options for a text that includes ``Python.h``; this interpreter's binary interface is among them.

    Raises:
        NotNative: it is not installed.
    """
    include = sysconfig.get_path("include")
    if not Path(include, "Python.h").is_file():
        version = f"{sys.version_info.major}.{sys.version_info.minor}"
        raise NotNative(f"Python.h is missing: install python{version}-dev (Debian, Ubuntu) or python3-devel")
    return f"-I{include}", f"-DAUTOMAX_PYTHON={sys.implementation.cache_tag}_{sys.hexversion:x}"


def _environment(search: str, folder: str) -> dict[str, str]:
    """Return what the compiler is given: CPATH, LIBRARY_PATH, COMPILER_PATH and the like do not reach it."""
    return {"PATH": search, "TMPDIR": folder, "LC_ALL": "C"}


def _run(command: Sequence[str], environment: dict[str, str], text: str, limit_s: float) -> str:
    """Run a compiler; return what it prints. With it end the processes that it has started."""
    try:
        process = subprocess.Popen(
            command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            env=environment,
            cwd=os.sep,
            text=True,
            encoding="utf-8",
            errors="replace",
            start_new_session=True,
        )
    except OSError as error:
        raise NotNative(f"{command[0]} cannot be run: {error.strerror or error}") from error
    thread = _RUNNING[process] = threading.current_thread()
    if thread in _ABANDONED:
        _kill(process)
    try:
        said, complaints = process.communicate(text, limit_s)
    except BaseException as error:
        _kill(process)
        process.communicate()
        if isinstance(error, subprocess.TimeoutExpired):
            raise NotNative(f"{command[0]} has not ended within {limit_s:g} s") from error
        raise
    finally:
        del _RUNNING[process]
    if process.returncode:
        lines = complaints.strip().splitlines() or [f"exit code {process.returncode}"]
        told = next((line for line in lines if "error" in line), lines[0])
        raise NotNative(f"{command[0]} fails: {told[:_MESSAGE]}")
    return said


def _kill(process: subprocess.Popen[str]) -> None:
    if process.poll() is None:
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)


def _stamp(path: str) -> tuple[int, int]:
    """Return what changes with a compiler: time and size of its file."""
    known = os.stat(path)
    return known.st_mtime_ns, known.st_size


@lru_cache(maxsize=8)
def _version(path: str, search: str, _: tuple[int, int], limit_s: float) -> str:
    said = _run([path, "--version"], _environment(search, os.sep), "", limit_s)
    return (said.splitlines() or [""])[0]
