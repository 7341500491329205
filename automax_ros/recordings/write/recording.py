"""The base of recorders, of a rack in this process or elsewhere: a bag with the rack's files, which may fail."""

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

    If the disk cannot be written, recording ends and ``failure`` is the reason; the sender of the messages continues.
    """

    def __init__(self, writer: BagWriter, files: Iterable[RackFile]) -> None:
        """Store the files.

        Raises:
            RecordingError: the disk cannot be written.
        """
        self.failure: RecordingError | None = None
        self._writer = writer
        self._stored: dict[str, RackFile] = {}
        self._store(files)

    def store(self, files: Iterable[RackFile]) -> None:
        """Store files that are new or have changed, such as the source of a reloaded task."""
        if self.failure is None:
            with self._enduring():
                self._store(files)

    def sync(self) -> None:
        """Wait until flushed data are on the disk. May take long: to be called from another thread."""
        self._writer.sync()

    def sync_at_end(self) -> None:
        """Wait until the closed bag is on the disk."""
        self.sync()
        with self._enduring():
            self._writer.require_synced()

    def _store(self, files: Iterable[RackFile]) -> None:
        """Store files that are new or have changed.

        Raises:
            RecordingError: the disk cannot be written.
        """
        for file in files:
            if self._stored.get(file.name) != file:
                self._stored[file.name] = file
                self._writer.attach(file.name, file.media_type, file.data)

    @contextmanager
    def _enduring(self) -> Iterator[None]:
        """Catch an error of the disk, which ends the recording; the first one stays the ``failure``."""
        try:
            yield
        except RecordingError as error:
            self.failure = self.failure or error

    def _flush(self, stamp: int) -> None:
        """Hand the open chunk to the operating system if its time has passed at a stamp."""
        if self.failure is None:
            with self._enduring():
                self._writer.flush(stamp)

    def _finish(self) -> None:
        if self.failure is None:
            with self._enduring():
                self._writer.close()
