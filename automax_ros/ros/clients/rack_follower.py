"""Follows a rack elsewhere in the ROS domain, as a recorder does, but keeps only what is so now."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

from automax_ros.core.ticks import NS_PER_S
from automax_ros.core.user_error import UserError
from automax_ros.messages.cdr.cdr import CdrError
from automax_ros.messages.types.rack_files import RackFile, RackFilesError, fingerprint
from automax_ros.rack.operator.rack_log import RackLog
from automax_ros.replay.scans.stored_rack import SourceRefused, StoredRack, rack_of_files
from automax_ros.ros.clients.followed_rack import TASK_TABLE, FollowedRack
from automax_ros.ros.clients.recorder import LOOK_S, LiveRecorder
from automax_ros.ros.setup.arguments import NO_ARGUMENTS, RosArguments

FIND_NS = 5 * NS_PER_S
"""How long a rack is looked for."""
GONE = "the rack has gone"
OTHER = "the rack runs from other files now: join it again"
_PRESENCE_S = 1.0


class RackFollower:
    """A thread that follows the rack with a namespace (with its slash) from the constructor to ``close``.

    A rack that has gone may come back: if it runs from the same files, its next run is followed.

    Attributes:
        stored: the files that it runs from, checked; those of a reload, too.
        over: why nothing is followed now, empty while the rack is there.
        log: its errors and operations since it is followed, and the operations that it remembers.
    """

    def __init__(
        self,
        space: str,
        arguments: RosArguments = NO_ARGUMENTS,
        wait_ns: int = FIND_NS,
        should_stop: Callable[[], bool] = lambda: False,
    ) -> None:
        """Find the rack within ``wait_ns``, read its files, and follow it.

        Raises:
            UserError: no such rack, several of the name, or one that does not say what it runs from.
            RosUnavailable: ROS cannot be initialised.
        """
        self.log = RackLog()
        self.over = ""
        self._space, self._arguments = space, arguments
        self._closing = threading.Event()
        self._lock = threading.Lock()
        self._join(wait_ns, should_stop)
        self._thread = threading.Thread(target=self._follow, name=f"follows {space}", daemon=True)
        self._thread.start()

    @contextmanager
    def run(self) -> Iterator[FollowedRack]:
        """Look at the present run while the block lasts; nothing changes meanwhile."""
        with self._lock:
            yield self._run

    def close(self) -> None:
        """Leave the graph."""
        self._closing.set()
        self._thread.join()
        self._recorder.close()

    def _join(self, wait_ns: int, should_stop: Callable[[], bool]) -> None:
        """Find the rack, and follow its present run."""
        space = self._space
        recorder = LiveRecorder(space, self._arguments, f"follower_{os.getpid()}")
        try:
            table = recorder.find(wait_ns, should_stop)
            if table is None:
                there = ", ".join(recorder.racks())
                hint = f"there are {there}" if there else "start it first, or set its ROS_DOMAIN_ID"
                raise UserError(f"no rack {space} is seen within {wait_ns / NS_PER_S:g} s", hint)
            files = recorder.files(should_stop)
            stored = self._checked(files)
            stored.check_table(table)
            run = recorder.follow(
                lambda topics: FollowedRack(stored.config, table, topics, self.log), {f"{space}/tasks": TASK_TABLE}
            )
        except (CdrError, RackFilesError) as error:
            recorder.close()
            raise UserError(f"what {space} sends is not what a rack sends: {error}") from error
        except BaseException:
            recorder.close()
            raise
        with self._lock:
            self._recorder, self._run, self.stored = recorder, run, stored
        self._files = fingerprint(files)

    def _checked(self, files: Sequence[RackFile]) -> StoredRack:
        if not files:
            raise UserError(f"the rack does not offer its files on {self._space}/config")
        try:
            return rack_of_files(Path(f"{self._space.removeprefix('/')}/config"), files)
        except SourceRefused as refused:
            raise UserError(f"what {self._space}/config offers has errors: {refused}") from refused

    def _follow(self) -> None:
        try:
            self._go_on()
        except Exception as fault:
            self.over = f"the rack is not followed any more: {type(fault).__name__}: {fault}"
            raise

    def _go_on(self) -> None:
        due_s = 0.0
        while not self._closing.wait(LOOK_S):
            with self._lock:
                self._recorder.step()
                run = self._run
                files, run.files = run.files, None
            if files is not None:
                with suppress(UserError):
                    self.stored, self._files = self._checked(files), fingerprint(files)
            if run.restarted and not self._join_again():
                return
            if time.monotonic() >= due_s:
                due_s = time.monotonic() + _PRESENCE_S
                self.over = "" if self._recorder.is_there else GONE

    def _join_again(self) -> bool:
        """Follow the next run of the rack; return whether it runs from the same files."""
        before = self._files
        self._recorder.close()
        while not self._closing.is_set():
            try:
                self._join(FIND_NS, self._closing.is_set)
            except UserError as fault:
                self.over = fault.message
                self._closing.wait(_PRESENCE_S)
                continue
            self.over = "" if self._files == before else OTHER
            return not self.over
        return False
