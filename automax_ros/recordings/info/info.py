"""The contents of a recording: rack, scans, topics and files, counted from its messages, and whether it is sound.

Also the facts of its tasks, from the rack file and the sources that are stored inside.
"""

from __future__ import annotations

import contextlib
import hashlib
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from mcap.records import Attachment

from automax_ros.core.diagnostics import SourceText
from automax_ros.core.text import count_of
from automax_ros.messages.cdr.cdr import CdrError, decoder
from automax_ros.messages.cdr.message_headers import scan_head
from automax_ros.messages.types.messages import Operation, ScanError, VariableTable
from automax_ros.messages.types.rack_files import RACK_FILE, RackFilesError, files_from_text, source_name
from automax_ros.rackfile.checks.tasks import check_source, commons_of
from automax_ros.rackfile.loader import load_stored
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.recordings.mcap.mcap_file import TRUNCATED_HINT, McapFile, RawMessage
from automax_ros.recordings.mcap.opening import NO_BAG_HINT, size_of
from automax_ros.recordings.mcap.unpacking import DAMAGED_HINT
from automax_ros.recordings.read.common_log import variables_of
from automax_ros.recordings.read.information import file_place
from automax_ros.recordings.read.reader import BagReader
from automax_ros.recordings.read.soundness import verdict_of
from automax_ros.recordings.read.tally import Tally
from automax_ros.recordings.tables.series import Progress

MOST_KEPT = 1000
"""Most attachments, operations, tasks and kinds of errors that `bag info` lists (decision): a recording may
lie about them."""
_TABLE = "automax_msgs/msg/VariableTable"
_SCAN = "automax_msgs/msg/Scan"
_OPERATION = "automax_msgs/msg/Operation"
_STRING = "std_msgs/msg/String"
_FILES_TOPIC = "/config"
_NO_ERRORS = bytes(4)
"""End of a Scan without errors: the length of an empty list."""
_PROGRESS_MASK = 0x3FF
REPAIR_HINT = "`automax bag repair` makes a whole recording of what is readable"


@dataclass
class RecordedTask:
    """The scans of a task: their count, lowest and highest number, missing numbers, restarts, logged errors.

    ``errors`` counts them by BASIC line and number of the problem.
    """

    slot: int = 0
    scans: int = 0
    first: int = 0
    last: int = 0
    missing: int = 0
    restarts: int = 0
    errors: Counter[ScanError] = field(default_factory=Counter)
    _before: int | None = None

    def count(self, number: int) -> None:
        """Count a scan by its number."""
        self.scans += 1
        if self._before is None:
            self.first = self.last = number
        elif number > self._before:
            self.missing += number - self._before - 1
        else:
            self.restarts += 1
        self.first, self.last = min(self.first, number), max(self.last, number)
        self._before = number


@dataclass
class FileInfo:
    """A data file: its size, its number of chunks, the bytes in them as stored and unpacked."""

    name: str
    size: int
    chunks: int
    stored_bytes: int
    unpacked_bytes: int


@dataclass(frozen=True)
class AttachmentInfo:
    """A file stored inside."""

    name: str
    media_type: str
    size: int
    sha256: str


@dataclass
class BagInfo(Tally):
    """The contents of a recording; ``problems`` is empty if it is sound.

    ``texts`` are the rack's file and the sources of its tasks as stored inside. ``gaps`` lists missing writes, if they
    were checked.
    """

    path: Path
    custom_data: dict[str, str] = field(default_factory=dict)
    table: VariableTable | None = None
    tasks: dict[str, RecordedTask] = field(default_factory=dict)
    files: list[FileInfo] = field(default_factory=list)
    operations: list[Operation] = field(default_factory=list)
    attachments: list[AttachmentInfo] = field(default_factory=list)
    texts: dict[str, str] = field(default_factory=dict)
    problems: list[BagError] = field(default_factory=list)
    gaps: list[str] = field(default_factory=list)

    @property
    def gap_texts(self) -> list[str]:
        """Gaps that do not make the recording unsound, from its recorder's data, its write log and its scans."""
        recorded = self.custom_data.get("gaps", "")
        found = [f"the recorder's note: {recorded}"] if recorded else []
        scans = [f"{count_of(task.missing, 'scan')} of {name}" for name, task in self.tasks.items() if task.missing]
        return [*found, *self.gaps, *(f"{text} not there" for text in scans)]

    @property
    def duration_ns(self) -> int:
        """Time from the first stamp to the last."""
        return self.last_stamp - self.first_stamp

    @property
    def size(self) -> int:
        """Size of all data files, in bytes."""
        return sum(file.size for file in self.files)

    @property
    def scans(self) -> int:
        """Number of scans of all tasks."""
        return sum(task.scans for task in self.tasks.values())

    @property
    def compression(self) -> float | None:
        """Ratio of the unpacked bytes of all chunks to their stored bytes, None without chunks."""
        stored = sum(file.stored_bytes for file in self.files)
        return sum(file.unpacked_bytes for file in self.files) / stored if stored else None


def bag_info(bag: Path, *, check: bool = False, progress: Progress | None = None) -> BagInfo:
    """Read a recording from its beginning to its end and count its contents; checksums are verified, too.

    ``check`` also decodes every message of a known type, and checks whether the write log has gaps or goes backwards.
    Errors of the recording are in ``problems``; messages before an error are counted. Memory use does not grow with the
    recording.

    Raises:
        BagError: there is no recording of ROS 2 in mcap files at the path.
    """
    info = BagInfo(bag)
    files = _data_files(info)
    total = sum(size_of(file) for file in files)
    parts = 2 if check else 1
    before = 0
    for file in files:
        data = McapFile(file)
        try:
            for number, record in enumerate(data.records()):
                _count(info, record)
                if progress is not None and not number & _PROGRESS_MASK:
                    progress(min(1.0, (before + data.position) / total) / parts)
        except BagError as error:
            if not info.messages and error.code in {"AMX6810", "AMX6811"}:
                raise
            info.problems.append(_with_repair(error))
        counts = data.chunks_read, data.stored_bytes, data.unpacked_bytes
        info.files.append(FileInfo(file.name, size_of(file), *counts))
        before += info.files[-1].size
    if info.table is not None:
        # A rack sends its files before its run begins, but the recording of a run begins with the run.
        info.first_stamp = min(max(info.first_stamp, info.table.stamp), info.last_stamp)
    if check and not info.problems:
        _check(info, progress)
    return info


def _data_files(info: BagInfo) -> list[Path]:
    """Return the data files, even if metadata.yaml is missing or wrong."""
    try:
        reader = BagReader(info.path)
    except BagError as error:
        found = info.path.glob("*.mcap") if info.path.is_dir() else ()
        files = sorted(filter(Path.is_file, found), key=file_place)
        if not files or error.code == "AMX6811":
            raise
        info.problems.append(_with_repair(error))
        return files
    info.custom_data = reader.custom_data
    return reader.files


def _with_repair(error: BagError) -> BagError:
    """Return the error with a hint to the repair, unless the repair does not help or the error has another hint."""
    if error.code == "AMX6814" or error.hint not in ("", TRUNCATED_HINT, DAMAGED_HINT, NO_BAG_HINT):
        return error
    return BagError(error.code, error.place, error.message, REPAIR_HINT)


def _count(info: BagInfo, record: object) -> None:
    if isinstance(record, RawMessage):
        name = record.schema.name if record.schema else ""
        info.add(record.channel.topic, name, record.log_time, record.publish_time)
        if name == _SCAN:
            _count_scan(info, record)
        elif name == _OPERATION and len(info.operations) < MOST_KEPT:
            info.operations.append(_decode(info, _OPERATION, record))
        elif name == _TABLE and info.table is None:
            table = _decode(info, _TABLE, record)
            variables_of(info.path, table)
            info.table = table
        elif name == _STRING and record.channel.topic.endswith(_FILES_TOPIC) and not info.texts:
            _keep_sent_files(info, record)
    elif isinstance(record, Attachment):
        _count_attachment(info, record)


def _count_scan(info: BagInfo, record: RawMessage) -> None:
    try:
        head = scan_head(record.data)
    except CdrError as error:
        raise BagError("AMX6816", info.path, f"the scan at {record.log_time} ns is malformed: {error}") from error
    task = info.tasks.get(head.task)
    if task is None:
        if len(info.tasks) >= MOST_KEPT:
            raise BagError("AMX6814", info.path, f"scans of more than {MOST_KEPT} tasks")
        task = info.tasks[head.task] = RecordedTask()
    task.count(head.scan)
    if record.data[-len(_NO_ERRORS) :] != _NO_ERRORS:
        for logged in _decode(info, _SCAN, record).errors:
            if logged in task.errors or len(task.errors) < MOST_KEPT:
                task.errors[logged] += 1


def _keep_sent_files(info: BagInfo, record: RawMessage) -> None:
    """Keep the files that a rack has sent, for a recording without stored files."""
    with contextlib.suppress(CdrError, RackFilesError):  # another program's topic of that name
        message: Any = decoder(_STRING)(record.data)
        info.texts.update((file.name, file.text) for file in files_from_text(message.data))


def _decode(info: BagInfo, type_name: str, record: RawMessage) -> Any:
    try:
        return decoder(type_name)(record.data)
    except CdrError as error:
        text = f"the message on {record.channel.topic[:247]} at {record.log_time} ns is malformed: {error}"
        raise BagError("AMX6816", info.path, text) from error


def _count_attachment(info: BagInfo, record: Attachment) -> None:
    digest = hashlib.sha256(record.data).hexdigest()
    entry = AttachmentInfo(record.name, record.media_type, len(record.data), digest)
    if entry in info.attachments or len(info.attachments) >= MOST_KEPT:
        return  # a split file repeats them
    info.attachments.append(entry)
    if record.name.endswith((".yaml", ".BLK", ".BAS")) and len(record.data) <= _MOST_TEXT:
        info.texts.setdefault(record.name, record.data.decode("utf-8", "replace"))


_MOST_TEXT = 1 << 18
"""Longest rack file or source that is read, in bytes."""


def _check(info: BagInfo, progress: Progress | None) -> None:
    """Decode every message of a known type, and check whether the recording is sound."""
    reader = BagReader(info.path)
    if progress is not None:
        reader.on_progress = lambda share: progress((1 + share) / 2)
    verdict = verdict_of(reader)
    info.gaps = list(verdict.gaps)
    if verdict.fault is not None:
        info.problems.append(verdict.fault)


@dataclass(frozen=True)
class TaskFacts:
    """A task by the rack file and its source; values are None if the source is missing or has errors.

    ``ticks`` is also None for a task without TICKS, ``period_ns`` for one without a scan period.
    """

    slot: int
    processor: str
    tick_ns: int
    priority: int
    target: str | None = None
    ticks: int | None = None
    period_ns: int | None = None


def task_facts(info: BagInfo) -> dict[str, TaskFacts]:
    """Return the tasks of the rack by name; none if the recording has no rack file without errors."""
    text = info.texts.get(RACK_FILE)
    config = load_stored(SourceText(RACK_FILE, text), Path(RACK_FILE)).config if text is not None else None
    if config is None:
        return {}
    commons = commons_of(config)
    facts = {}
    for processor in config.task_modules:
        for task in processor.tasks:
            name = source_name(task.name, task.file.name)
            source = info.texts.get(name)
            program = None
            if source:
                text_of = SourceText(name, source)
                program = check_source(text_of, task.name, processor.tick_ns, commons, processor.times).program
            facts[task.name] = TaskFacts(
                processor.slot,
                processor.model,
                processor.tick_ns,
                task.priority,
                program.target if program else None,
                (program.ticks or None) if program else None,
                (program.period_ns or None) if program else None,
            )
    return facts
