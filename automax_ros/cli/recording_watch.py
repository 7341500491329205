"""Looks after a recording while the rack runs: tells once when it fails, and on the wall clock sees it to the disk."""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable

from automax_ros.bags.recorder import Recorder
from automax_ros.cli.status import StatusDisplay

SYNC_PERIOD_S = 0.4
"""Pause between two waits for the disk itself, so that a power failure costs about a second too."""


class RecordingWatch:
    """Tells the person when a recording ends before its rack; without a recorder it does nothing."""

    def __init__(self, recorder: Recorder | None, display: StatusDisplay) -> None:
        self._recorder = recorder
        self._display = display
        self._told = False

    @property
    def failed(self) -> bool:
        """Whether the recording broke off."""
        return self._recorder is not None and self._recorder.failure is not None

    def flush(self, now_ns: int) -> None:
        """Let what an idle rack has recorded reach the file."""
        if self._recorder is not None:
            self._recorder.flush(now_ns)

    def tell(self) -> None:
        """Say on standard error, once, that the recording has broken off."""
        if self.failed and not self._told:
            assert self._recorder is not None
            self._told = True
            self._display.message("recording ended, the rack goes on")
            print(self._recorder.failure, file=sys.stderr, flush=True)


class DiskSync:
    """Calls a function that waits for the disk, again and again, on a thread of its own: no scan waits with it."""

    def __init__(self, sync: Callable[[], None]) -> None:
        self._sync = sync
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run, name="disk sync", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """End the thread."""
        self._ended.set()
        self._thread.join()

    def _run(self) -> None:
        while not self._ended.wait(SYNC_PERIOD_S):
            self._sync()
