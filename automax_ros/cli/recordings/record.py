"""Record a rack that runs, from any process of its ROS 2 domain.

RACK is the rack's name or namespace, or its YAML file or folder: then a rack that is started after its recorder is
recorded from its first scan on. The bag is the one that `automax run --record` makes:
it begins where the rack has sent an image of its common memory, and tasks can be replayed from their first full scan
and state on; the recorder asks the rack for both. Ctrl-C ends it.
"""

from __future__ import annotations

import argparse
import sys
import time
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

from automax_ros.cli.options.recording import split_seconds, storage_options
from automax_ros.cli.options.ros import (
    add_ros_arguments,
    add_wait_argument,
    config_of,
    names_file,
    prepare_ros,
    ros_arguments,
    space_of,
)
from automax_ros.cli.options.values import add_output_argument, seconds_above_0
from automax_ros.cli.output.screen import StatusLine
from automax_ros.cli.output.signals import StopRequest, stop_signals
from automax_ros.cli.run.saving import DiskSync
from automax_ros.cli.run.status import NO_SCAN, recorded_size
from automax_ros.core.kinds import WriterKind
from automax_ros.core.text import count_of, did_you_mean, quoted
from automax_ros.core.ticks import NS_PER_S
from automax_ros.core.user_error import UsageError
from automax_ros.messages.cdr.cdr import CdrError
from automax_ros.messages.types.messages import VariableTable
from automax_ros.messages.types.rack_files import RACK_FILE, RackFile, RackFilesError, source_name
from automax_ros.rackfile.checks.tasks import check_tasks
from automax_ros.recordings.live.recording import LiveRecording
from automax_ros.recordings.mcap.errors import RecordingError
from automax_ros.recordings.write.data_file import StorageOptions

if TYPE_CHECKING:
    from automax_ros.rackfile.model.config import RackConfig
    from automax_ros.ros.clients.recorder import LiveRecorder
    from automax_ros.ros.setup.arguments import RosArguments

_PATIENCE_S = 3.0
"""A rack that has been absent from the graph this long is reported, s."""
_GAPS_SHOWN = 20


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``automax record``."""
    parser.add_argument("rack", metavar="RACK", help="the rack's name or namespace, or its YAML file or folder")
    add_output_argument(parser, "DIR", "the new rosbag2 folder (default: rack and time)")
    parser.add_argument("--duration", type=seconds_above_0, metavar="S", help="seconds after which the recording ends")
    parser.add_argument("--tasks", metavar="A,B", help="record scans and states of these tasks only (default: all)")
    parser.add_argument(
        "--split-mb", metavar="MB", help="begin a new file when one reaches MB megabytes (1 MB is 10^6 bytes)"
    )
    parser.add_argument(
        "--split-s", type=split_seconds, metavar="S", help="begin a new file each S seconds of rack time"
    )
    parser.add_argument("--compression", metavar="zstd|lz4|none", help="how the files are compressed (default: zstd)")
    add_wait_argument(parser)
    add_ros_arguments(parser)


def run(arguments: argparse.Namespace) -> int:
    """Record until Ctrl-C, the end of the duration or a restart of the rack.

    1 where recording broke off or ended by itself, or holds nothing (decision: a script must see that).
    """
    storage = storage_options(arguments.compression, arguments.split_mb, "--")
    how = _Storing(storage, arguments.split_s or 0, arguments.tasks)
    with stop_signals() as stop:
        domain = prepare_ros(arguments)
        ros = ros_arguments(arguments)
        own, own_files, config = _rack(arguments.rack, ros)
        folder = arguments.output or Path(f"{own.strip('/').replace('/', '_')}_{datetime.now():%Y-%m-%d_%H-%M-%S}")
        if folder.exists():
            print(RecordingError("AMX6800", folder, "exists already, not overwriting"), file=sys.stderr)
            return 2
        from automax_ros.ros.clients.recorder import LiveRecorder
        from automax_ros.ros.setup.leaving import ended_within

        recorder = LiveRecorder(own, ros)
        session, code = _Session(recorder, own, domain, stop), 0
        try:
            if config is not None:
                recorder.expect(config)
            code = session.record(folder, arguments.wait, arguments.duration, how, own_files)
            return code
        finally:
            with ended_within(code):
                recorder.close()


@dataclass(frozen=True)
class _Storing:
    storage: StorageOptions
    split_ns: int
    tasks: str | None


class _Session:
    def __init__(self, recorder: LiveRecorder, space: str, domain: int, stop: StopRequest) -> None:
        self._recorder, self._space, self._domain, self._stop = recorder, space, domain, stop
        self._line = StatusLine()
        self._shown = (0, 0)
        self._gone_since = 0.0
        self._next_presence = 0.0
        self._expects_scans = True

    def record(
        self, folder: Path, wait_ns: int, duration_ns: int | None, how: _Storing, own_files: list[RackFile]
    ) -> int:
        table = self._find_rack(wait_ns)
        if table is None:
            return 0
        chosen = _choose_tasks(table, how.tasks)
        self._expects_scans = bool(_tasks(table))
        files = self._files(own_files)
        if self._stop.requested:
            return 0
        recording = self._recorder.open(folder, files, chosen, how.storage, how.split_ns)
        self._line.message(
            f"rack {table.rack}: {count_of(len(table.variables), 'common variable')}, tasks "
            f"{' '.join(sorted(chosen) if chosen else _tasks(table))}\n"
            f"recording {self._space} in domain {self._domain} into {folder}; Ctrl-C ends the recording"
        )
        sync = DiskSync(recording.sync)
        try:
            self._loop(recording, duration_ns)
        finally:
            try:
                self._recorder.finish()
            finally:
                sync.stop()
        recording.sync_at_end()
        self._notes(recording)
        return self._summary(recording, folder)

    def _find_rack(self, wait_ns: int) -> VariableTable | None:
        try:
            table = self._recorder.find(wait_ns, lambda: self._stop.requested)
        except CdrError as error:
            raise UsageError(f"{self._space}/variables is not a rack's table: {error}") from error
        if not self._recorder.binding.knows_senders:
            self._line.message(
                "warning: this ROS 2 does not identify senders: messages of other programs are recorded too"
            )
        if table is not None or self._stop.requested:
            return table
        there = self._recorder.racks()
        hint = did_you_mean(self._space, there) or (
            f"there are {', '.join(there)}" if there else "start the rack first"
        )
        seen = "" if there else "; no rack is there"
        raise UsageError(
            f"no rack {self._space} in ROS domain {self._domain} within {wait_ns / NS_PER_S:g} s{seen}",
            hint if there else f"{hint}, or set its ROS_DOMAIN_ID",
        )

    def _files(self, own: list[RackFile]) -> list[RackFile]:
        try:
            offered = self._recorder.files(lambda: self._stop.requested)
        except RackFilesError as error:
            self._line.message(f"warning: {self._space}/config is not what a rack sends: {error}")
            offered = []
        if not offered:
            if not self._stop.requested:
                source = "those next to the YAML file are stored" if own else "name its YAML file to store those"
                self._line.message(f"warning: the rack does not offer its files on {self._space}/config: {source}")
            return own
        texts = {item.name: item.sha256 for item in offered}
        for item in own:
            if texts.get(item.name) != item.sha256:
                self._line.message(f"warning: {item.name} on disk is not what runs; the bag stores what runs")
        return offered

    def _loop(self, recording: LiveRecording, duration_ns: int | None) -> None:
        from automax_ros.ros.clients.recorder import LOOK_S

        began: int | None = None
        while not self._stop.requested and recording.failure is None and recording.ended is None:
            self._recorder.step()
            now = time.monotonic_ns()
            if began is None and recording.first_stamp is not None:
                began = now
                self._line.message(f"recording since {recording.seconds(recording.first_stamp):.3f} s of the run")
            if began is not None and duration_ns is not None and now - began >= duration_ns:
                return
            self._notes(recording)
            self._show(recording)
            self._look_for_rack()
            time.sleep(LOOK_S)

    def _notes(self, recording: LiveRecording) -> None:
        news = self._recorder.binding.news
        for note in (*recording.notes, *news):
            self._line.message(note)
        recording.notes.clear()
        news.clear()

    def _show(self, recording: LiveRecording) -> None:
        passed = self._line.due()
        if not passed:
            return
        if recording.first_stamp is None:
            self._line.show(["waiting for an image of common memory"])
            return
        scans, writes = recording.scans - self._shown[0], recording.writes - self._shown[1]
        self._shown = recording.scans, recording.writes
        parts = [
            f"{recording.seconds(recording.last_stamp):8.1f} s",
            f"{scans * NS_PER_S / passed:.0f} scans/s",
            f"{writes * NS_PER_S / passed:.0f} writes/s",
        ]
        if recording.rests:
            parts.append("waiting for the rack's image or states")
        self._line.show([*parts, count_of(len(recording.gaps), "gap")])

    def _look_for_rack(self) -> None:
        """Report once when the rack has left the graph, and once when it is back."""
        now = time.monotonic()
        if now < self._next_presence:
            return
        self._next_presence = now + 1.0
        gone = self._gone_since
        if self._recorder.is_there:
            if gone < 0:
                self._line.message(f"rack {self._space} is there again")
            self._gone_since = 0.0
        elif not gone:
            self._gone_since = now
        elif 0 < gone < now - _PATIENCE_S:
            self._line.message(f"rack {self._space} has gone; Ctrl-C ends the recording")
            self._gone_since = -1.0

    def _summary(self, recording: LiveRecording, folder: Path) -> int:
        if recording.ended is not None:
            self._line.message(f"{recording.ended}: the recording ends here; record again for the new run")
        if recording.first_stamp is None:
            self._line.message(f"nothing was recorded into {folder}: no image of common memory came")
        else:
            span = f"{recording.seconds(recording.first_stamp):.3f} to {recording.seconds(recording.last_stamp):.3f} s"
            self._line.message(
                f"recorded {span} of the run: {count_of(recording.scans, 'scan')}, "
                f"{count_of(recording.writes, 'write')}, {count_of(recording.values, 'value')} of commons"
            )
        if recording.replayable_from is not None:
            self._line.message(f"  replayable from {recording.seconds(recording.replayable_from):.3f} s on")
        if recording.dropped:
            self._line.message(f"  {count_of(recording.dropped, 'scan')} before a full one left out")
        for gap in recording.gaps[:_GAPS_SHOWN]:
            self._line.message(f"  gap at {recording.seconds(gap.stamp):.3f} s: {gap}")
        if len(recording.gaps) > _GAPS_SHOWN:
            self._line.message(f"  and {len(recording.gaps) - _GAPS_SHOWN} more gaps")
        lost = sum(self._recorder.lost_values.values())
        if lost:
            self._line.message(f"  {count_of(lost, 'value')} of common topics did not come; the write log has them")
        if recording.malformed:
            self._line.message(f"  {count_of(recording.malformed, 'malformed message')} left out")
        foreign = self._recorder.binding.refused
        if foreign:
            self._line.message(f"  {count_of(foreign, 'message')} of other programs left out")
        for item in recording.lacks if recording.first_stamp is not None else ():
            self._line.message(f"  the bag lacks {item}")
        if recording.failure is not None:
            print(recording.failure, file=sys.stderr)
            return 1
        self._line.message(f"recorded {folder}: {recorded_size(folder)}")
        empty = self._expects_scans and not recording.executable
        if empty and recording.first_stamp is not None:
            unfit = "  no scan of it can be executed again: nothing of it can be replayed"
            self._line.message(unfit if recording.scans else NO_SCAN)
        return 1 if recording.ended is not None or recording.first_stamp is None or empty else 0


def _rack(text: str, ros: RosArguments) -> tuple[str, list[RackFile], RackConfig | None]:
    """Return the namespace with its slash, and the files and the configuration if RACK is a YAML file."""
    if not names_file(text):
        return space_of(text, ros), [], None
    config = config_of(Path(text))
    sources = [RackFile(source_name(task.name, task.file.name), source.text) for task, source, _ in check_tasks(config)]
    return f"/{ros.placed(config.namespace)}", [RackFile(RACK_FILE, config.text), *sources], config


def _tasks(table: VariableTable) -> list[str]:
    return [writer.name for writer in table.writers if writer.kind == WriterKind.TASK]


def _choose_tasks(table: VariableTable, text: str | None) -> set[str] | None:
    if text is None:
        return None
    known = _tasks(table)
    chosen = {name.strip().upper() for name in text.split(",") if name.strip()}
    for name in sorted(chosen - set(known)):
        raise UsageError(
            f"--tasks: no task {quoted(name)}", did_you_mean(name, known) or f"there are {' '.join(known)}"
        )
    if not chosen:
        raise UsageError("--tasks: no task is named", f"there are {' '.join(known)}")
    return chosen
