"""The options of `automax run` that say how a run is recorded."""

from __future__ import annotations

import argparse

from automax_ros.bags.recorder import RecordingOptions
from automax_ros.bags.writer import COMPRESSIONS, StorageOptions
from automax_ros.cli.usage import UsageError
from automax_ros.core.ticks import NS_PER_S, seconds_ns
from automax_ros.rack.config import RackConfig
from automax_ros.rack.findings import did_you_mean, quoted

_BYTES_PER_MB = 1_000_000
_MAX_MB = 1_000_000
MIN_SPLIT_NS = NS_PER_S
"""Shortest time to split at: each file begins with a whole image of memory (decision)."""
_NAMES = ("split_mb", "split_s", "compression", "tasks", "locals")


def add_record_arguments(parser: argparse.ArgumentParser) -> None:
    """Add ``--record-...``."""
    group = parser.add_argument_group("recording", "how --record records")
    group.add_argument(
        "--record-split-mb", metavar="MB", help="begin a new file when one has so many megabytes (1 MB is 10^6 bytes)"
    )
    group.add_argument("--record-split-s", metavar="S", help="begin a new file each S seconds of rack time")
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
        help="record the task's locals and block states behind every recorded scan, not only every 10 s",
    )


def recording_options(arguments: argparse.Namespace, config: RackConfig) -> RecordingOptions:
    """Return what the arguments say.

    Raises:
        UsageError: one of them makes no sense, or there is no --record.
    """
    given = [name for name in _NAMES if getattr(arguments, f"record_{name}") not in (None, False)]
    if given and arguments.record is None:
        raise UsageError(f"--record-{given[0].replace('_', '-')} says how to record", "add --record DIR")
    compression = "zstd" if arguments.record_compression is None else arguments.record_compression
    if compression not in COMPRESSIONS:
        hint = did_you_mean(compression, COMPRESSIONS) or f"there are {', '.join(COMPRESSIONS)}"
        raise UsageError(f"--record-compression: no compression {quoted(compression)}", hint)
    try:
        storage = StorageOptions(compression, split_bytes=_split_bytes(arguments.record_split_mb))
    except ValueError as error:
        raise UsageError(f"--record-split-mb: {error}") from error
    tasks = _tasks(arguments.record_tasks, config)
    return RecordingOptions(storage, _split_ns(arguments.record_split_s), tasks, arguments.record_locals)


def _split_bytes(text: str | None) -> int:
    if text is None:
        return 0
    try:
        size = float(text)
    except ValueError:
        raise UsageError(f"--record-split-mb: {quoted(text)} is no number of megabytes") from None
    if not 0 < size <= _MAX_MB:
        raise UsageError(f"--record-split-mb: {text} lies outside 0 to {_MAX_MB}")
    return max(1, round(size * _BYTES_PER_MB))


def _split_ns(text: str | None) -> int:
    if text is None:
        return 0
    try:
        period_ns = seconds_ns(text)
    except ValueError as error:
        raise UsageError(f"--record-split-s: {error}") from error
    if period_ns < MIN_SPLIT_NS:
        raise UsageError(f"--record-split-s: {text} s is too short", "1 s is the shortest")
    return period_ns


def _tasks(text: str | None, config: RackConfig) -> frozenset[str] | None:
    if text is None:
        return None
    known = [task.name for processor in config.processors for task in processor.tasks]
    names = [name.strip().upper() for name in text.split(",") if name.strip()]
    if not names:
        raise UsageError("--record-tasks: names no task", f"there are {', '.join(known)}")
    for name in names:
        if name not in known:
            hint = did_you_mean(name, known) or f"there are {', '.join(known)}"
            raise UsageError(f"--record-tasks: the rack has no task {quoted(name)}", hint)
    return frozenset(names)
