"""What the recorder of a rack of ours and that of a rack elsewhere have in common: a bag that may fail and says why."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager

from automax_ros.core.machine_code import mypyc_attr
from automax_ros.messages.types.rack_files import RackFile
from automax_ros.recordings.mcap.errors import RecordingError
from automax_ros.recordings.write.writer import BagWriter


@mypyc_attr(allow_interpreted_subclasses=True)
class Recording:
    """A bag being recorded, with the rack's files in it.

    When the disk refuses, recording ends and ``failure`` says why; whoever sends the messages goes on.
    """

    def __init__(self, writer: BagWriter, files: Iterable[RackFile]) -> None:
        """Store the files.

        Raises:
            RecordingError: the disk refuses at once.
        """
        self.failure: RecordingError | None = None
        self._writer = writer
        self._stored: dict[str, RackFile] = {}
        self._store(files)

    def store(self, files: Iterable[RackFile]) -> None:
        """Store files that are not stored as they are now, such as the source of a task that was reloaded."""
        if self.failure is None:
            with self._enduring():
                self._store(files)

    def sync(self) -> None:
        """Wait until the disk itself has what was flushed. May take long: to be called from another thread."""
        self._writer.sync()

    def sync_at_end(self) -> None:
        """Wait until the disk itself has the closed bag."""
        self.sync()
        with self._enduring():
            self._writer.require_synced()

    def _store(self, files: Iterable[RackFile]) -> None:
        """Store files that are not stored as they are now.

        Raises:
            RecordingError: the disk refuses.
        """
        for file in files:
            if self._stored.get(file.name) != file:
                self._stored[file.name] = file
                self._writer.attach(file.name, file.media_type, file.data)

    @contextmanager
    def _enduring(self) -> Iterator[None]:
        """Let a disk that refuses end the recording; once it has, that stays the failure."""
        try:
            yield
        except RecordingError as error:
            self.failure = self.failure or error

    def _flush(self, stamp: int) -> None:
        """Hand the open chunk to the operating system if its time is over at a stamp."""
        if self.failure is None:
            with self._enduring():
                self._writer.flush(stamp)

    def _finish(self) -> None:
        if self.failure is None:
            with self._enduring():
                self._writer.close()
