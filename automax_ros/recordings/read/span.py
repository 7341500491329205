"""The time span of a recording, read without decoding its messages."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass
from pathlib import Path

from automax_ros.core.ticks import seconds_text
from automax_ros.messages.cdr.cdr import CdrError
from automax_ros.messages.cdr.message_headers import scan_head
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.recordings.mcap.mcap_file import RawMessage
from automax_ros.recordings.read.reader import BagReader

_SCAN = "automax_msgs/msg/Scan"


@dataclass
class RunSpan:
    """Start of the run, first and last stamp; nanoseconds.

    ``scans`` counts those of the requested tasks in the requested range.
    """

    run_start: int
    first: int
    last: int
    scans: int = 0

    def text(self) -> str:
        """Return the span in words, in s of the run."""
        first, last = (seconds_text(max(0, stamp - self.run_start)) for stamp in (self.first, self.last))
        return f"it lasts from {first} to {last} s of the run"


def span_of(
    bag: Path,
    run_start: int,
    tasks: Collection[str] = (),
    from_ns: int = 0,
    to_ns: int | None = None,
    progress: Callable[[float], None] | None = None,
) -> RunSpan:
    """Return the span of a recording, with the number of scans of tasks in a range of ns since the start of the run.

    Raises:
        BagError: the recording cannot be read.
    """
    reader = BagReader(bag)
    reader.on_progress = progress
    found: RunSpan | None = None
    for record in reader.records():
        stamp = record.publish_time
        if found is None:
            found = RunSpan(run_start, stamp, stamp)
        found.first, found.last = min(found.first, stamp), max(found.last, stamp)
        if tasks and record.schema is not None and record.schema.name == _SCAN:
            time = stamp - run_start
            found.scans += from_ns <= time and (to_ns is None or time <= to_ns) and _task(record) in tasks
    return found or RunSpan(run_start, run_start, run_start)


def require_scans(bag: Path, run_start: int, tasks: Collection[str], from_ns: int, to_ns: int | None) -> None:
    """Refuse a range, in ns since the start of the run, in which a recording has no scan of the tasks.

    Raises:
        BagError: there is none, or the recording cannot be read.
    """
    span = span_of(bag, run_start, tasks, from_ns, to_ns)
    if not span.scans:
        what = f"holds no scan of {', '.join(tasks)[:80]} in the range asked for"
        raise BagError("AMX6825", bag, what, span.text())


def _task(record: RawMessage) -> str:
    try:
        return scan_head(record.data).task
    except CdrError:  # reported where the message is decoded
        return ""
