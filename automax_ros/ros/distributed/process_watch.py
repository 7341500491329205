"""Asks the kernel whether other processes of this host still live: immediate, and reliable under load."""

from __future__ import annotations

import os
import select
from functools import cache
from pathlib import Path

from automax_ros.messages.types.messages import Presence

_BOOT = Path("/proc/sys/kernel/random/boot_id")
_PIDS = Path("/proc/self/ns/pid")


@cache
def this_host() -> str:
    """Return an identifier of this host and of its namespace of process numbers; "" if unknown."""
    try:
        return f"{_BOOT.read_text(encoding='ascii').strip()} {_PIDS.readlink()}"
    except OSError:
        return ""


class ProcessWatch:
    """Watches processes that have announced themselves. Always call ``close``."""

    def __init__(self) -> None:
        self._files: dict[int, int] = {}

    def lives(self, presence: Presence) -> bool | None:
        """Return whether a process lives; None if that cannot be known here, as on another host."""
        if not this_host() or presence.host != this_host() or not hasattr(os, "pidfd_open"):
            return None
        if presence.process not in self._files:
            try:
                self._files[presence.process] = os.pidfd_open(presence.pid)
            except ProcessLookupError:
                return False
            except (OSError, ValueError, OverflowError):
                return None
        poll = select.poll()
        poll.register(self._files[presence.process], select.POLLIN)
        return not poll.poll(0)

    def forget(self, process: int) -> None:
        """Stop watching a process."""
        if process in self._files:
            os.close(self._files.pop(process))

    def close(self) -> None:
        """Stop watching all processes."""
        for process in list(self._files):
            self.forget(process)
