"""Builds a shared library from a C text: the compiler, its options, and the library's name in the cache."""

from __future__ import annotations

import hashlib
import os
import platform
import shutil
import sys
import sysconfig
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from automax_ros.compile.base.native_source import NOT_KEPT, NotNative
from automax_ros.compile.native.run.cache import NativeCache
from automax_ros.compile.native.run.compiler_process import LIMIT_S, MADE, run_compiler

FLAGS = ("-std=c11", "-ffp-contract=off", "-fno-fast-math", "-fwrapv", "-fPIC", "-shared")
"""None of these changes bits: no fused multiply-add, and integers that overflow wrap around."""
LONG_TEXT = 200_000
"""Characters from which on a text is compiled at -O1, not -O2 (decision).

A task of 2,000 lines, a million characters, then takes 5 s instead of 15, and scans as fast within a few percent.
"""
MOST_TEXT = 4_000_000
"""Most characters of a text that is compiled (decision): a task of 8,000 lines, and 1 GB of memory for the compiler."""
_USUAL = ("cc", "gcc", "clang")


@dataclass(frozen=True)
class Compiler:
    """A C compiler: its path, the version that it prints, and the folders in which it finds its helpers."""

    path: str
    version: str
    search: str


def find_compiler(limit_s: float = LIMIT_S) -> Compiler:
    """Return the compiler that CC names, as an absolute path or a name on PATH, or cc, gcc or clang.

    Raises:
        NotNative: there is none, or CC names none.
    """
    # In a relative folder on PATH anyone who can write the working folder could have put a compiler.
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
    """Check for all tools needed to build a native task.

    Raises:
        NotNative: there is no compiler, or ``Python.h`` is missing.
    """
    find_compiler(limit_s)
    python_options()


def library(
    text: str, cache: NativeCache, options: Sequence[str] = (), limit_s: float = LIMIT_S, *, builds: bool = True
) -> Path:
    """Return the library of a C text: from the cache or, if ``builds``, built now and cached.

    Raises:
        NotNative: there is no compiler, it fails, lacks memory or time, the text is too long, or the cache not safe.
    """
    if len(text) > MOST_TEXT:
        raise NotNative(f"its C text would have {len(text):,} characters, more than {MOST_TEXT:,}")
    compiler = find_compiler(limit_s)
    options = (level_of(text), *options)
    key = key_of(text, compiler, options)
    found = cache.found(key)
    if found is None and not builds:
        raise NotNative(NOT_KEPT)
    return found if found is not None else cache.store(key, build(text, compiler, options, limit_s))


def level_of(text: str) -> str:
    """Return the compiler's optimization level for a text."""
    return "-O1" if len(text) >= LONG_TEXT else "-O2"


def key_of(text: str, compiler: Compiler, options: Sequence[str] = ()) -> str:
    """Return the SHA-256 of all that a library depends on: text, options, compiler, machine, C library."""
    parts = (text, *FLAGS, *options, compiler.path, compiler.version, platform.machine(), *platform.libc_ver())
    return hashlib.sha256(os.fsencode("\0".join(parts))).hexdigest()


def build(text: str, compiler: Compiler, options: Sequence[str] = (), limit_s: float = LIMIT_S) -> bytes:
    """Return the library that the compiler builds from a text.

    Raises:
        NotNative: the compiler fails, does not have enough memory, or takes longer than ``limit_s`` s.
    """
    command = [compiler.path, *FLAGS, *options, "-x", "c", "-", "-o", MADE, "-lm"]
    library = run_compiler(command, compiler.search, text, limit_s).library
    if library is None:
        raise NotNative(f"{compiler.path} has written no library")
    return library


def python_options() -> tuple[str, ...]:
    """Return the options for a text that includes ``Python.h``, including this interpreter's binary interface.

    Raises:
        NotNative: it is not installed.
    """
    include = sysconfig.get_path("include")
    if not Path(include, "Python.h").is_file():
        version = f"{sys.version_info.major}.{sys.version_info.minor}"
        raise NotNative(f"Python.h is missing: install python{version}-dev (Debian, Ubuntu) or python3-devel")
    return f"-I{include}", f"-DAUTOMAX_PYTHON={sys.implementation.cache_tag}_{sys.hexversion:x}"


def _stamp(path: str) -> tuple[int, int]:
    known = os.stat(path)
    return known.st_mtime_ns, known.st_size


@lru_cache(maxsize=8)
def _version(path: str, search: str, _: tuple[int, int], limit_s: float) -> str:
    output = run_compiler([path, "--version"], search, limit_s=limit_s).output
    return (output.splitlines() or [""])[0]
