"""Repairs recordings whose writer was killed, whose disk was full, or which were cut or damaged.

The original is never changed. Sound files are copied byte for byte; of the others everything sound is written to a new
file with index and summary. After the last whole chunk only whole instants are kept: a scan without its writes would
not show what the rack did.
"""

from __future__ import annotations

import copy
import shutil
from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path

from automax_ros.core.ticks import NS_PER_S
from automax_ros.recordings.mcap.errors import BagError, RecordingError
from automax_ros.recordings.mcap.mcap_file import McapFile, RawMessage
from automax_ros.recordings.mcap.metadata import METADATA_FILE, BagMetadata
from automax_ros.recordings.mcap.opening import NO_BAG_HINT, no_recording
from automax_ros.recordings.read.information import MAX_FILES, MAX_METADATA_BYTES, file_place, read_information
from automax_ros.recordings.read.reader import BagReader
from automax_ros.recordings.read.soundness import verdict_of
from automax_ros.recordings.repair.contents import FileContents, FileSequence, Provenance, topics_of
from automax_ros.recordings.repair.rewriting import RepairWriter

_MISSING_SHOWN = 20
_GAP_NS = NS_PER_S
"""Longest time between two files of one recording; a longer one is reported as a gap."""


@dataclass
class FileReport:
    """The result for one data file; counts are those of the repaired file."""

    name: str
    size: int
    sound: bool
    contents: FileContents
    damage: list[str] = field(default_factory=list)
    lost_bytes: int = 0
    lost_chunks: int = 0
    dropped_messages: int = 0
    dropped_scans: int = 0
    error: BagError | None = None
    """Why nothing in the file could be read."""
    before: FileSequence | None = None
    """The check of order before this file's messages; None if they may have any order."""

    @property
    def usable(self) -> bool:
        """Whether the file contributes anything to the repaired recording."""
        return self.contents.messages > 0 or self.sound


@dataclass
class RepairReport:
    """The result of a repair; ``output`` is None where nothing was written. Times in ns."""

    bag: Path
    files: list[FileReport] = field(default_factory=list)
    problems: list[str] = field(default_factory=list)
    """Problems of the recording as a whole."""
    output: Path | None = None
    left: BagError | None = None
    """Why the result is still not sound, for a reason that no repair corrects: the fault in `bag info --check`."""

    @property
    def sound(self) -> bool:
        """Whether there was nothing to repair."""
        return not self.problems and all(file.sound for file in self.files)

    @property
    def last_stamp(self) -> int:
        """The stamp of the last message that is kept."""
        return max((file.contents.last_stamp for file in self.files if file.contents.messages), default=0)

    @property
    def run_start(self) -> int:
        """The stamp of the start of the run, or of the first message without a VariableTable."""
        filled = [file.contents for file in self.files if file.contents.messages]
        starts = [item.run_start for item in filled if item.run_start is not None]
        return starts[0] if starts else min((item.began for item in filled), default=0)


def repair(
    bag: Path, output: Path | None = None, on_progress: Callable[[float], None] = lambda _: None
) -> RepairReport:
    """Check a recording, a folder or one .mcap file, and write a repaired one unless it is sound.

    ``output`` is the folder to write, ``<BAG>_repaired`` by default; if it is given, a sound recording is copied. The
    default for one file of a recording's folder is next to that folder. ``on_progress`` is called with the share that
    is done.

    Raises:
        BagError: there is no recording, or nothing in it can be used.
        RecordingError: the output exists already, is inside the recording's folder, or cannot be written.
    """
    target = output if output is not None else _default_output(bag)
    _require_outside(bag, target)
    report = RepairReport(bag)
    paths = _data_files(bag, report)
    provenance = Provenance()
    found: dict[Path, FileReport] = {}
    sequence = FileSequence() if _is_ours(bag, paths) else None
    for path in paths if sequence is None else sorted(paths, key=_first_log):
        found[path] = _examine(path, provenance, sequence)
        on_progress(len(found) / len(paths) / 2)
    report.files += [found[path] for path in paths]
    _check_metadata(bag, report, provenance)
    if report.sound and output is None:
        report.left = verdict_of(BagReader(bag)).fault
        return report
    was_sound = report.sound
    _write(target, paths, report, provenance, on_progress)
    if not was_sound:
        _check_gaps(report)
    report.output = target
    report.left = verdict_of(BagReader(target)).fault
    return report


def _default_output(bag: Path) -> Path:
    if bag.is_dir():
        return _beside(bag, "")
    if _is_in_recording(bag):
        return _beside(bag.parent, f"_{bag.stem}")
    return bag.with_name(f"{bag.stem}_repaired")


def _beside(folder: Path, what: str) -> Path:
    named = folder if folder.name not in {"", ".."} else folder.resolve()
    return named.with_name(f"{named.name}{what}_repaired")


def _is_in_recording(file: Path) -> bool:
    """Whether a data file is in the folder of a recording."""
    return (file.parent / METADATA_FILE).exists()


def _require_outside(bag: Path, target: Path) -> None:
    """Refuse an output inside the folder of the recording."""
    folder = bag if bag.is_dir() else bag.parent if _is_in_recording(bag) else None
    if folder is not None and folder.resolve() in target.resolve().parents:
        raise RecordingError(
            "AMX6824",
            target,
            f"lies inside {folder}, the recording itself, which is never changed",
            "name a folder next to it with --output",
        )


def _data_files(bag: Path, report: RepairReport) -> list[Path]:
    """Return the data files in their order; report those that are missing."""
    if bag.is_file():
        return [bag]
    if not bag.is_dir():
        raise no_recording(bag)
    found = sorted((path for path in bag.iterdir() if path.suffix == ".mcap" and path.is_file()), key=file_place)
    if not found:
        raise BagError("AMX6810", bag, "holds no .mcap file", NO_BAG_HINT)
    if len(found) > MAX_FILES:
        raise BagError("AMX6814", bag, f"holds {len(found)} data files, at most {MAX_FILES} are read")
    try:
        listed = read_information(bag).get("relative_file_paths")
    except BagError:
        listed = None
    names = [path.name for path in found]
    wanted = [str(name)[:80] for name in listed[:MAX_FILES]] if isinstance(listed, list) else _missing_numbers(found)
    report.problems += [f"{name} is missing" for name in wanted if name not in names][:_MISSING_SHOWN]
    return found


def _missing_numbers(found: list[Path]) -> list[str]:
    """Return the names that are missing in the numbering of a recording's files, up to the last one found."""
    stem, last, _ = file_place(found[-1])
    numbers = {file_place(path)[1] for path in found if file_place(path)[0] == stem}
    if last < 0 or last >= MAX_FILES or len(numbers) < len(found):
        return []
    prefix = found[-1].name.removesuffix(f"{last}.mcap")
    return [f"{prefix}{number}.mcap" for number in range(last) if number not in numbers]


def _is_ours(bag: Path, paths: list[Path]) -> bool:
    """Whether our recorder made the recording, so that messages follow each other (``BagReader.is_ours``)."""
    for path in (bag, *paths):
        try:
            if BagReader(path).is_ours:
                return True
        except BagError:  # raised again when the file is read
            continue
    return False


def _first_log(path: Path) -> int:
    """Return the log time of a file's first message, 0 where none can be read."""
    try:
        return next((item.log_time for item in McapFile(path).records() if isinstance(item, RawMessage)), 0)
    except BagError:
        return 0


def _examine(path: Path, provenance: Provenance, sequence: FileSequence | None) -> FileReport:
    """Read a file to its end and report its damage; a damaged one is rewritten later."""
    file = McapFile(path)
    contents = FileContents(path.name, channels=file.channels, schemas=file.schemas)
    before = copy.deepcopy(sequence)
    damage: list[str] = []
    malformed = strays = 0
    first = first_stray = ""
    try:
        for record in file.records():
            if isinstance(record, RawMessage):
                contents.count(record.channel.id, record.log_time, record.publish_time, record.data)
                place = f"on {record.channel.topic[:247]} at {record.log_time} ns"
                kind = contents.type_of(record.channel.id)
                if fault := contents.fault(record.channel.id, record.data):
                    malformed += 1
                    first = first or f"{place}: {fault}"
                elif sequence is not None and (fault := sequence.fault(record.log_time, kind, record.data)):
                    strays += 1
                    first_stray = first_stray or f"{place}: {fault}"
            else:
                provenance.take(record)
        damage += [f"malformed messages: {malformed}, the first {first}"] if malformed else []
        damage += [f"messages that do not follow on those before: {strays}, the first {first_stray}"] if strays else []
    except BagError as error:
        damage = ["not finished: index and summary are missing" if error.code == "AMX6812" else error.message]
    if damage:
        return FileReport(path.name, _size(path), False, FileContents(path.name), damage, before=before)
    return FileReport(path.name, _size(path), True, contents)


def _size(path: Path) -> int:
    try:
        return path.stat().st_size
    except OSError:
        return 0


def _check_metadata(bag: Path, report: RepairReport, provenance: Provenance) -> None:
    """Compare metadata.yaml with the contents of the files."""
    if not bag.is_dir():
        return
    try:
        information = read_information(bag)
        BagReader(bag)
    except BagError as error:
        report.problems.append(f"{METADATA_FILE}: {error.message}" if error.code != "AMX6810" else error.message)
        return
    provenance.take_information(information)
    listed = information.get("relative_file_paths")
    assert isinstance(listed, list)  # checked by the reader
    if sorted(listed) != sorted(file.name for file in report.files):
        report.problems.append(f"{METADATA_FILE} names other data files than there are")
    elif listed != [file.name for file in _in_time(report.files)] and all(file.sound for file in report.files):
        report.problems.append(f"{METADATA_FILE} does not list the data files in the order of their times")
    elif all(file.sound for file in report.files):
        count = sum(file.contents.messages for file in report.files)
        if information.get("message_count") != str(count):
            report.problems.append(f"{METADATA_FILE} states another number of messages than the {count} that there are")


def _in_time(files: list[FileReport]) -> list[FileReport]:
    """Return the files in the order of their first log times; one without messages stays after the one before it."""
    times: list[int] = []
    for file in files:
        times.append(file.contents.first_log if file.contents.messages else times[-1] if times else 0)
    return [file for _, file in sorted(zip(times, files, strict=True), key=lambda item: item[0])]


def _check_gaps(report: RepairReport) -> None:
    """Report gaps in time between two files."""
    filled = [file.contents for file in _in_time(report.files) if file.contents.messages]
    for before, after in pairwise(filled):
        gap = after.first_log - before.last_log
        if gap > _GAP_NS:
            report.problems.append(f"{gap / NS_PER_S:.3f} s are missing between {before.name} and {after.name}")


def _write(
    target: Path, paths: list[Path], report: RepairReport, provenance: Provenance, on_progress: Callable[[float], None]
) -> None:
    """Write the repaired recording; remove it if that fails."""
    try:
        target.mkdir(parents=True)
    except FileExistsError:
        raise RecordingError(
            "AMX6800", target, "exists already, not overwriting", "name another folder with --output"
        ) from None
    except OSError as error:
        raise _write_error(target, error) from error
    try:
        for number, (path, file) in enumerate(zip(paths, report.files, strict=True)):
            if file.sound:
                shutil.copyfile(path, target / path.name)
            else:
                _save(path, target / path.name, file, provenance)
            on_progress(0.5 + (number + 1) / len(paths) / 2)
        kept = _in_time([file for file in report.files if file.usable])
        if not kept:
            raise _nothing(report)
        if report.sound and report.bag.is_dir():
            shutil.copyfile(report.bag / METADATA_FILE, target / METADATA_FILE)
        else:
            _write_metadata(target, kept, report, provenance)
    except BaseException as error:
        shutil.rmtree(target, ignore_errors=True)
        if isinstance(error, OSError):
            raise _write_error(target, error) from error
        raise


def _save(path: Path, target: Path, file: FileReport, provenance: Provenance) -> None:
    """Write the sound parts of a file; a file without any is left out."""
    try:
        _rewrite(path, target, file, provenance)
    except BagError as error:
        file.error, file.contents, file.lost_bytes = error, FileContents(path.name), file.size
    if not file.usable:
        target.unlink(missing_ok=True)


def _nothing(report: RepairReport) -> BagError:
    """Return the error for a recording of which nothing can be used."""
    errors = [file.error for file in report.files if file.error is not None]
    if len(report.files) == len(errors) == 1:
        return errors[0]
    return BagError(
        "AMX6817", report.bag, "holds no message that can be used", "the recording was lost before it began"
    )


def _rewrite(path: Path, target: Path, file: FileReport, provenance: Provenance) -> None:
    rewriting = RepairWriter(target, path, provenance, copy.deepcopy(file.before))
    try:
        rewriting.write()
    finally:
        rewriting.close()
    file.contents = rewriting.contents
    damage = rewriting.damage
    file.damage += [text for text in damage.texts if text not in file.damage]
    file.lost_bytes, file.lost_chunks = damage.lost_bytes, damage.lost_chunks
    file.dropped_messages, file.dropped_scans = rewriting.dropped_messages, rewriting.dropped_scans


def _write_metadata(target: Path, kept: list[FileReport], report: RepairReport, provenance: Provenance) -> None:
    contents = [file.contents for file in kept]
    custom = provenance.custom_data(next((item.rack for item in contents if item.rack), ""))
    if not report.sound:
        custom["repaired"] = "automax bag repair"
    files, topics = [item.summary() for item in contents], topics_of(contents)
    listed = len(topics)
    while len(text := BagMetadata(files, topics[:listed], custom).document().encode()) > MAX_METADATA_BYTES and listed:
        listed = listed * MAX_METADATA_BYTES // (2 * len(text))
    if listed < len(topics):
        report.problems.append(f"{METADATA_FILE} lists {listed} of {len(topics)} topics: more of it nobody would read")
    (target / METADATA_FILE).write_bytes(text)


def _write_error(target: Path, error: OSError) -> RecordingError:
    return RecordingError(
        "AMX6801",
        target,
        f"cannot write the repaired recording: {error.strerror or error}",
        "check free space and permissions, or name another folder with --output",
    )
