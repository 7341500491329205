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
"""Longest line that is kept whole, bytes (decision): a report with all commons is much shorter."""


class Child:
    """A process that has been started, with a thread for each of its output streams."""

    def __init__(
        self, command: Sequence[str], on_line: Callable[[str], None], on_stderr: Callable[[str], None]
    ) -> None:
        """Start the process; the functions are called, each on its own thread, with the lines of both streams."""
        pipe = subprocess.PIPE
        self._process = subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=pipe, start_new_session=True)
        streams = (self._process.stdout, on_line), (self._process.stderr, on_stderr)
        self._readers = [threading.Thread(target=_read, args=pair, daemon=True) for pair in streams]
        for reader in self._readers:
            reader.start()

    @property
    def pid(self) -> int:
        """Its process id."""
        return self._process.pid

    @property
    def code(self) -> int | None:
        """The exit code, less than 0 where a signal has ended it, None while it runs."""
        return self._process.poll()

    @property
    def is_read(self) -> bool:
        """Whether the functions have been called with all of its output."""
        return not any(reader.is_alive() for reader in self._readers)

    def send(self, number: signal.Signals) -> None:
        """Send a signal, unless the process has ended."""
        self._process.send_signal(number)

    def close(self) -> None:
        """Kill the child if it still runs, and close its standard input."""
        if self.code is None:
            self._process.kill()
            self._process.wait()
        if self._process.stdin is not None:
            self._process.stdin.close()


def _read(stream: IO[bytes], on_line: Callable[[str], None]) -> None:
    with stream:
        while line := stream.readline(_MOST_BYTES):
            on_line(line.decode("utf-8", "backslashreplace").rstrip("\r\n"))


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
