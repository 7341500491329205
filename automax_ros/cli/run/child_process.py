"""A process that another one watches: what it prints comes line by line, and it ends when its watcher does.

Its standard input is a pipe that nobody writes: it ends when the watcher is gone, however that went, and the child
ends then, too. A child stands in a session of its own, so that Ctrl-C reaches the watcher alone, which ends its
children in order.
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
"""Longest line that is kept, bytes (decision): a report with all commons is far below."""
_READ_BYTES = 1 << 16


class Lines:
    """One stream of a child."""

    def __init__(self, stream: IO[bytes], hear: Callable[[str], None]) -> None:
        """Take a pipe; ``hear`` gets each line of it."""
        self._stream, self._hear = stream, hear
        self._rest = b""
        os.set_blocking(stream.fileno(), False)

    def fileno(self) -> int:
        """Return the file to wait for."""
        return self._stream.fileno()

    def read(self) -> bool:
        """Hear what is there now; return FALSE at the stream's end."""
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
        """Hear no more."""
        self._stream.close()


class Child:
    """A process that has been started. ``out`` and ``err`` are its streams."""

    def __init__(self, command: Sequence[str], hear: Callable[[str], None], complain: Callable[[str], None]) -> None:
        """Start it; its lines on standard output go to ``hear``, those on standard error to ``complain``."""
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
        """The exit code, less than 0 where a signal has ended it, None while it lives."""
        return self._process.poll()

    def send(self, number: signal.Signals) -> None:
        """Send a signal; one that has ended already gets none."""
        self._process.send_signal(number)

    def close(self) -> None:
        """Let go of a child that has ended, or that is killed by this."""
        if self.code is None:
            self._process.kill()
            self._process.wait()
        for stream in (self.out, self.err, self._process.stdin):
            if stream is not None:
                stream.close()


def end_with_watcher(stop: StopRequest) -> None:
    """Let the watcher's end ask this process to end, too: in a child, before it does anything."""

    def watch() -> None:
        try:
            while os.read(0, 1):
                pass
        except OSError:
            pass
        stop.requested = True

    threading.Thread(target=watch, name="watcher", daemon=True).start()
