"""Whether other processes of this host still live, by the kernel's word: at once, and without a mistake under load."""

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
    """Return a word for this host, and the numbers of processes as they are counted here; "" where none is known."""
    try:
        return f"{_BOOT.read_text(encoding='ascii').strip()} {_PIDS.readlink()}"
    except OSError:
        return ""


class ProcessWatch:
    """Watches processes that have said who they are. ``close`` in any case."""

    def __init__(self) -> None:
        """Begin with none."""
        self._files: dict[int, int] = {}

    def lives(self, presence: Presence) -> bool | None:
        """Return whether a process lives, None where that cannot be known here: it is on another host."""
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
        """Watch a process no longer."""
        if process in self._files:
            os.close(self._files.pop(process))

    def close(self) -> None:
        """Watch nobody any more."""
        for process in list(self._files):
            self.forget(process)
