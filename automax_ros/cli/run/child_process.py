"""A child process whose output is read line by line and which ends when its parent does.

Its standard input is a pipe to which nothing is written: it is closed when the parent is gone, for whatever cause, and
the child ends then, too. A child has its own session, so that Ctrl-C reaches the parent alone, which ends its
children cleanly.
"""

from __future__ import annotations

import os
import signal
import subprocess
import threading
from collections.abc import Callable, Sequence
from typing import IO

from automax_ros.cli.output.signals import StopRequest

_MOST_BYTES = 64_000_000
"""Longest line that is kept, bytes (decision): a report with all commons is much shorter."""
_READ_BYTES = 1 << 16


class Lines:
    """Reads one output stream of a child line by line."""

    def __init__(self, stream: IO[bytes], hear: Callable[[str], None]) -> None:
        """Read from a pipe; ``hear`` is called with each line."""
        self._stream, self._hear = stream, hear
        self._rest = b""
        os.set_blocking(stream.fileno(), False)

    def fileno(self) -> int:
        """Return the file descriptor to wait for."""
        return self._stream.fileno()

    def read(self) -> bool:
        """Read what is available now; return FALSE at the stream's end."""
        try:
            data = os.read(self.fileno(), _READ_BYTES)
        except BlockingIOError:
            return True
        *lines, self._rest = (self._rest + data).split(b"\n")
        if not data or len(self._rest) > _MOST_BYTES:
            lines, self._rest = [*lines, *([self._rest] if self._rest else [])], b""
        for line in lines:
            self._hear(line.decode("utf-8", "backslashreplace").rstrip("\r"))
        return bool(data)

    def close(self) -> None:
        """Close the pipe."""
        self._stream.close()


class Child:
    """A process that has been started. ``out`` and ``err`` are its output streams."""

    def __init__(self, command: Sequence[str], hear: Callable[[str], None], complain: Callable[[str], None]) -> None:
        """Start the process; ``hear`` is called with each line of standard output, ``complain`` of standard error."""
        pipe = subprocess.PIPE
        self._process = subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=pipe, start_new_session=True)
        assert self._process.stdout is not None
        assert self._process.stderr is not None
        self.out, self.err = Lines(self._process.stdout, hear), Lines(self._process.stderr, complain)

    @property
    def pid(self) -> int:
        """Its process id."""
        return self._process.pid

    @property
    def code(self) -> int | None:
        """The exit code, less than 0 where a signal has ended it, None while it runs."""
        return self._process.poll()

    def send(self, number: signal.Signals) -> None:
        """Send a signal, unless the process has ended."""
        self._process.send_signal(number)

    def close(self) -> None:
        """Kill the child if it still runs, and close its streams."""
        if self.code is None:
            self._process.kill()
            self._process.wait()
        for stream in (self.out, self.err, self._process.stdin):
            if stream is not None:
                stream.close()


def end_with_watcher(stop: StopRequest) -> None:
    """Request a stop when the parent ends; to be called in a child before it does anything else."""

    def watch() -> None:
        try:
            while os.read(0, 1):
                pass
        except OSError:
            pass
        stop.requested = True

    threading.Thread(target=watch, name="watcher", daemon=True).start()
