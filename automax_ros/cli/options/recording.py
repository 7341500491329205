"""The options of `automax run` and `automax record` for recordings."""

from __future__ import annotations

import argparse

from automax_ros.cli.options.values import naming, option_number, seconds
from automax_ros.core.text import did_you_mean, quoted
from automax_ros.core.ticks import NS_PER_S
from automax_ros.core.user_error import UsageError
from automax_ros.rackfile.model.config import RackConfig
from automax_ros.recordings.write.data_file import COMPRESSIONS, StorageOptions
from automax_ros.recordings.write.recorder import RecordingOptions

_BYTES_PER_MB = 1_000_000
_MAX_MB = 1_000_000
MIN_SPLIT_NS = NS_PER_S
"""Shortest time to split a recording at, ns (decision): each file begins with a whole image of memory."""
_NAMES = ("split_mb", "split_s", "compression", "tasks", "locals")


def add_record_arguments(parser: argparse.ArgumentParser) -> None:
    """Add ``--record-...``."""
    group = parser.add_argument_group("recording", "how --record records")
    group.add_argument(
        "--record-split-mb", metavar="MB", help="begin a new file when one reaches MB megabytes (1 MB is 10^6 bytes)"
    )
    group.add_argument(
        "--record-split-s", type=split_seconds, metavar="S", help="begin a new file each S seconds of rack time"
    )
    group.add_argument(
        "--record-compression",
        metavar="zstd|lz4|none",
        help="how the file is compressed: zstd (default) small, lz4 fast, none not at all",
    )
    group.add_argument(
        "--record-tasks",
        metavar="A,B",
        help="record scans and states of these tasks only (default: all); common memory is always recorded whole",
    )
    group.add_argument(
        "--record-locals",
        action="store_true",
        help="record the task's locals and block states after every recorded scan, not only every 10 s",
    )


def recording_options(arguments: argparse.Namespace, config: RackConfig) -> RecordingOptions:
    """Return the recording options that the arguments give.

    Raises:
        UsageError: an argument is wrong, or there is no --record.
    """
    given = [name for name in _NAMES if getattr(arguments, f"record_{name}") not in (None, False)]
    if given and arguments.record is None:
        raise UsageError(f"--record-{given[0].replace('_', '-')} says how to record", "add --record DIR")
    storage = storage_options(arguments.record_compression, arguments.record_split_mb, "--record-")
    tasks = _tasks(arguments.record_tasks, config)
    return RecordingOptions(storage, arguments.record_split_s or 0, tasks, arguments.record_locals)


def storage_options(compression: str | None, split_mb: str | None, prefix: str) -> StorageOptions:
    """Return the storage options of a recording; the names of the options begin with ``prefix``.

    Raises:
        UsageError: an unknown compression, or a size out of range.
    """
    chosen = "zstd" if compression is None else compression
    if chosen not in COMPRESSIONS:
        hint = did_you_mean(chosen, COMPRESSIONS) or f"there are {', '.join(COMPRESSIONS)}"
        raise UsageError(f"{prefix}compression: no compression {quoted(chosen)}", hint)
    size = _split_bytes(split_mb, f"{prefix}split-mb")
    with naming(f"{prefix}split-mb"):
        return StorageOptions(chosen, size)


def split_seconds(text: str) -> int:
    """Return the rack time in ns after which another file begins: the type of an option."""
    period_ns = seconds(text)
    if period_ns < MIN_SPLIT_NS:
        raise argparse.ArgumentTypeError(f"{text} s is too short: 1 s is the shortest")
    return period_ns


def _split_bytes(text: str | None, option: str) -> int:
    if text is None:
        return 0
    size = option_number(option, text, 0, _MAX_MB)
    if size == 0:
        raise UsageError(f"{option}: 0 MB hold nothing")
    return max(1, round(size * _BYTES_PER_MB))


def _tasks(text: str | None, config: RackConfig) -> frozenset[str] | None:
    if text is None:
        return None
    known = [task.name for _, task in config.placed_tasks]
    names = [name.strip().upper() for name in text.split(",") if name.strip()]
    if not names:
        raise UsageError("--record-tasks: names no task", f"there are {', '.join(known)}")
    for name in names:
        if name not in known:
            hint = did_you_mean(name, known) or f"there are {', '.join(known)}"
            raise UsageError(f"--record-tasks: the rack has no task {quoted(name)}", hint)
    return frozenset(names)
