"""Saves what outlives a run: kept state is restored at the start and saved as the run goes; recordings are synced."""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable
from pathlib import Path

from automax_ros.cli.run.status import NO_SCAN, StatusDisplay, recorded_size
from automax_ros.core.text import count_of
from automax_ros.core.ticks import NS_PER_S
from automax_ros.core.types import Value
from automax_ros.rack.operator.retention import Document, Restored, Retention, RetentionFault
from automax_ros.rack.rack import Rack
from automax_ros.recordings.write.recorder import Recorder

SYNC_PERIOD_S = 0.4
"""Pause between two syncs to the disk, so that a power failure, too, loses only about a second."""


SAVE_PERIOD_NS = 5 * NS_PER_S
"""Period at which a changed state is saved while the rack runs, so that a killed run loses little (decision)."""


class RecordingMonitor:
    """Reports a recording that ends before its rack; without a recorder it does nothing."""

    def __init__(self, recorder: Recorder | None, display: StatusDisplay) -> None:
        self._recorder = recorder
        self._display = display
        self._is_reported = False

    @property
    def failed(self) -> bool:
        """Whether the recording failed before the end."""
        return self._recorder is not None and self._recorder.failure is not None

    def flush(self, now_ns: int) -> None:
        """Write the pending messages of an idle rack to the file."""
        if self._recorder is not None:
            self._recorder.flush(now_ns)

    def report_failure(self) -> None:
        """Report once, on the display and on standard error, that the recording has failed."""
        if self.failed and not self._is_reported:
            assert self._recorder is not None
            self._is_reported = True
            self._display.message("recording ended, the rack goes on")
            print(self._recorder.failure, file=sys.stderr, flush=True)

    def report_end(self, bag: Path | None) -> None:
        """Report the size of the run's recording, and what it lacks; nothing without one."""
        if self._recorder is None or bag is None:
            return
        rest = f", not to the end of the run; to complete the file: automax bag repair {bag}" if self.failed else ""
        self._display.message(f"recorded {bag}: {recorded_size(bag)}{rest}")
        if self._recorder.has_tasks and not self._recorder.scans:
            self._display.message(NO_SCAN)


class DiskSync:
    """Calls a function that waits for the disk, periodically and in its own thread, so that no scan waits for it."""

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


class SavedState:
    """Keeps a rack's state in a folder, or nowhere if that is None."""

    def __init__(self, rack: Rack, folder: Path | None) -> None:
        """Restore the state of a folder, before the rack has observers: nodes and recordings begin with it.

        Raises:
            RetentionFault: the folder cannot be read or holds something else.
        """
        self.settings: tuple[tuple[str, Value], ...] = ()
        self._retention = Retention(rack, folder) if folder is not None else None
        self._news: list[str] = []
        self._next_ns = SAVE_PERIOD_NS
        self._failure: RetentionFault | None = None
        self._is_reported = False
        self._saving: threading.Thread | None = None
        self._last: Document | None = None
        if self._retention is not None:
            restored = self._retention.restore()
            self.settings = restored.settings
            self._news = _news(restored, self._retention.path)

    @property
    def failed(self) -> bool:
        """Whether the state could not be written."""
        return self._failure is not None

    def news(self) -> list[str]:
        """Return the lines to show since the last call."""
        if self._failure is not None and not self._is_reported:
            self._is_reported = True
            self._news.append(f"values of this run will not outlive it: {self._failure.place}: {self._failure.message}")
        news, self._news = self._news, []
        return news

    def update(self, now_ns: int) -> None:
        """Save a changed state if it is due, in a separate thread, so that no scan waits for the disk."""
        busy = self._saving is not None and self._saving.is_alive()
        if now_ns >= self._next_ns and self._retention is not None and not busy:
            self._next_ns = now_ns + SAVE_PERIOD_NS
            document = self._retention.present()
            self._saving = threading.Thread(target=self._save, args=(document,), name="state", daemon=True)
            self._saving.start()

    def freeze(self) -> None:
        """Capture the state to be saved at the end; call it while the tasks still run, so that AUTO RUN knows them."""
        if self._retention is not None:
            self._last = self._retention.present()

    def end(self) -> None:
        """Save a changed state: that of ``freeze`` if it was called, else the present one."""
        if self._saving is not None:
            self._saving.join()
        if self._retention is not None:
            self._save(self._last if self._last is not None else self._retention.present())

    def _save(self, document: Document) -> None:
        if self._retention is None or self.failed:
            return
        try:
            self._retention.save(document)
        except RetentionFault as fault:
            self._failure = fault


def _news(restored: Restored, path: Path) -> list[str]:
    counts = [count_of(restored.commons, "common"), count_of(restored.tunables, "tunable")]
    counts += [count_of(restored.forces, "force")] if restored.forces else []
    any_kept = any((restored.commons, restored.tunables, restored.forces))
    return [*([f"kept from the last run: {', '.join(counts)} ({path})"] if any_kept else []), *restored.notes]
