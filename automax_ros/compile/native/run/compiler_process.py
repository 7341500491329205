"""Runs a C compiler as a process with limited time and memory, which ends with the process that started it."""

from __future__ import annotations

import contextlib
import io
import math
import os
import resource
import shutil
import signal
import subprocess
import tempfile
import threading
import weakref
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from automax_ros.compile.base.native_source import NotNative
from automax_ros.compile.native.run.cache import STALE_S

LIMIT_S = 120.0
"""Time limit of the compiler for one text, s (decision): a task of 2,000 lines takes a few."""
LOOK_S = 0.25
"""Longest single wait for a compiler, s: Python misses a signal that comes just before a wait."""
LEAST_MEMORY, MEMORY_A_CHARACTER = 1 << 30, 512
"""Address space that each process of the compiler may have, bytes, and what each character of a text adds to that
(decision: gcc 12 takes 50 MB for a task of 40 blocks, and 300 bytes a character for long ones: 310 MB for 2,000 lines,
which may have 1.6 GB, and 930 MB for 3,800,000 characters, which may have 3 GB). As many compilers run at a time as
there are cores, and together they may have half of the memory. A machine that does not support this limit has none.
"""
FOLDER = "automax_native_"
"""Prefix of the name of a compiler's folder."""
_SHELL = "/bin/sh"
_SCRIPT = """
exec 3<&0
{ trap '' TERM; read -r _ <&3; kill -TERM 0; rm -rf -- "$1" || rm -rf -- "$1"; kill -KILL 0; } >/dev/null 2>&1 &
exec 3<&-
ulimit -c 0 2>/dev/null; ulimit -f 524288 2>/dev/null
ulimit -t "$2" 2>/dev/null; ulimit -v "$3" 2>/dev/null
shift 3
"$@" <text
code=$?
exec 2>/dev/null
trap '' TERM
kill -TERM 0; kill -KILL $!; wait
exit $code
"""
"""Limits a compiler, and runs it on the content of the file ``text`` (decision: it is quick and safe among threads).

It is a fixed shell script that does not split any argument. A shell costs 1 ms, a Python interpreter 9 ms; Python code
between fork and exec may hang where there are threads; and limits set on a running compiler do not apply to processes
that it has already started. The second line waits until the other end of standard input is closed: however our process
ends, even by SIGKILL, the compiler then ends and its folder is removed. Processes that a compiler leaves running when
it ends are ended too. No file may have more than 256 MB. A limit that the machine does not support, such as that of
memory on macOS, is left out.
"""
MADE = "made.so"
"""Name of the library that a compiler makes."""
_TEXT = "text"
_MESSAGE = 400
"""Most characters of the compiler's messages that are passed on."""
_NOT_RUN = (126, 127)
"""Exit codes of a shell that could not run a program."""
_NO_MEMORY = (
    *("out of memory", "memory exhausted", "annot allocate memory", "bad_alloc"),
    *("Killed signal terminated", "failed to map segment"),
)
"""Messages of gcc, clang, as and ld when they run out of memory; the last two occur when the machine has killed them or
could not load them."""
_CONTAINER_LIMIT = Path("/sys/fs/cgroup/memory.max")
"""The file in which Linux gives the memory limit of a container."""
_RUNNING: dict[io.FileIO, threading.Thread] = {}
"""The pipes whose closing ends the running compilers, and the threads that wait for them."""
_ABANDONED: weakref.WeakSet[threading.Thread] = weakref.WeakSet()
"""Threads whose results are not needed any longer."""


@dataclass(frozen=True)
class Ran:
    """The output of a compiler, and the library that it has made, None if it made none."""

    output: str
    library: bytes | None


def run_compiler(command: Sequence[str], search: str, text: str = "", limit_s: float = LIMIT_S) -> Ran:
    """Run a compiler that reads a text from standard input, and return its output and library.

    Its environment has only PATH: CPATH, LIBRARY_PATH, COMPILER_PATH and the like do not reach it.

    Args:
        command: its absolute path and its options; the library is ``MADE``.
        search: PATH.
        text: the text that it reads.
        limit_s: time limit, s; its memory is limited by the length of the text.

    Raises:
        NotNative: it cannot be run, fails, does not have enough memory, or takes longer.
    """
    memory = memory_of(text)
    with _running_compiler(command, search, text, limit_s, memory) as (process, folder, life):
        output, complaints = _wait_for_output(process, life, command[0], limit_s)
        if process.returncode:
            raise NotNative(_failure(command[0], process.returncode, complaints, memory))
        library = folder / MADE
        return Ran(output, library.read_bytes() if library.is_file() else None)


def memory_of(text: str) -> int:
    """Return the limit of the address space of each process of a compiler for a text, bytes."""
    wanted = LEAST_MEMORY + MEMORY_A_CHARACTER * len(text)
    machine = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    with contextlib.suppress(OSError, ValueError):  # no container, or one without a limit
        machine = min(machine, int(_CONTAINER_LIMIT.read_text()))
    own = [limit for limit in resource.getrlimit(resource.RLIMIT_AS) if limit != resource.RLIM_INFINITY]
    return min(wanted, machine // 2 // (os.cpu_count() or 1), *own)


def abandon(threads: Iterable[threading.Thread]) -> None:
    """End the compilers for which these threads wait, and each that they will start: their results are not needed."""
    _ABANDONED.update(threads)
    for life, thread in list(_RUNNING.items()):
        if thread in _ABANDONED:
            life.close()


@contextlib.contextmanager
def _running_compiler(
    command: Sequence[str], search: str, text: str, limit_s: float, memory: int
) -> Iterator[tuple[subprocess.Popen[str], Path, io.FileIO]]:
    """Start a compiler in its own folder; yield its process, the folder, and the pipe whose closing ends it."""
    with contextlib.ExitStack() as ending:
        try:
            folder = ending.enter_context(tempfile.TemporaryDirectory(prefix=FOLDER, ignore_cleanup_errors=True))
            _clear_away(Path(folder))
            Path(folder, _TEXT).write_text(text, encoding="utf-8", errors="replace")
            watched, held = os.pipe()
            life = ending.enter_context(io.FileIO(held, "w"))
            ending.callback(os.close, watched)
            process = subprocess.Popen(
                [_SHELL, "-c", _SCRIPT, "sh", folder, str(math.ceil(limit_s) + 1), str(memory >> 10), *command],
                stdin=watched,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                env={"PATH": search, "TMPDIR": folder, "LC_ALL": "C"},
                cwd=folder,
                text=True,
                encoding="utf-8",
                errors="replace",
                start_new_session=True,
            )
        except OSError as error:
            raise NotNative(f"{command[0]} cannot be run: {error.strerror or error}") from error
        yield process, Path(folder), life


def _clear_away(new: Path) -> None:
    """Remove remains next to a new folder, of processes killed before their compiler began or after it ended."""
    oldest = new.stat().st_mtime - STALE_S
    with contextlib.suppress(OSError), os.scandir(new.parent) as found:
        for entry in found:
            with contextlib.suppress(OSError):  # another program may remove it at the same time
                if entry.name.startswith(FOLDER) and entry.is_dir(follow_symlinks=False):
                    known = entry.stat(follow_symlinks=False)
                    if known.st_uid == os.geteuid() and known.st_mtime < oldest:
                        shutil.rmtree(entry.path, ignore_errors=True)


def _wait_for_output(process: subprocess.Popen[str], life: io.FileIO, name: str, limit_s: float) -> tuple[str, str]:
    """Return a compiler's output and error output. The processes that it has started end with it."""
    thread = _RUNNING[life] = threading.current_thread()
    try:
        if thread in _ABANDONED:
            life.close()
        return _read_output(process, limit_s)
    except BaseException as error:
        if process.returncode is None:  # else another process may have its number by now
            with contextlib.suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
        for pipe in (process.stdout, process.stderr):
            if pipe is not None:
                pipe.close()  # a process that has left the compiler's session may hold its other end for any time
        process.wait()
        if isinstance(error, subprocess.TimeoutExpired):
            raise NotNative(f"{name} has not ended within {limit_s:g} s") from error
        raise
    finally:
        del _RUNNING[life]


def _read_output(process: subprocess.Popen[str], limit_s: float) -> tuple[str, str]:
    """Return the output and error output of a process.

    Raises:
        TimeoutExpired: it has not ended in time.
    """
    for _ in range(math.ceil(limit_s / LOOK_S) - 1):
        with contextlib.suppress(subprocess.TimeoutExpired):
            return process.communicate(timeout=LOOK_S)
    return process.communicate(timeout=LOOK_S)


def _failure(name: str, code: int, complaints: str, memory: int) -> str:
    lines = complaints.strip().splitlines() or [f"exit code {code}"]
    if any(words in complaints for words in _NO_MEMORY):
        return f"{name} has not enough memory for it, of which it may have {memory >> 20:,} MB: divide the task"
    if code in _NOT_RUN:
        return f"{name} cannot be run: {lines[-1][:_MESSAGE]}"
    shown = next((line for line in lines if "error" in line), lines[0])
    return f"{name} fails: {shown[:_MESSAGE]}"
