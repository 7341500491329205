"""From when to when a recording lasts, read without decoding its messages."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass
from pathlib import Path

from automax_ros.bags.errors import BagError
from automax_ros.bags.mcap_file import McapFile, RawMessage
from automax_ros.bags.opening import size_of
from automax_ros.bags.reader import BagReader
from automax_ros.core.ticks import seconds_text
from automax_ros.wire.cdr import CdrError, decode
from automax_ros.wire.heads import scan_head
from automax_ros.wire.messages import VariableTable

_TABLE, _SCAN = "automax_msgs/msg/VariableTable", "automax_msgs/msg/Scan"
_PROGRESS_MASK = 0x3FF


@dataclass
class Span:
    """Start of the run (that of the recording where no table tells it), first and last stamp; nanoseconds.

    ``scans`` counts those of the tasks asked for that lie in the range asked for.
    """

    run_start: int = 0
    first: int = 0
    last: int = 0
    scans: int = 0

    def text(self) -> str:
        """Say from when to when the recording lasts, in s of the run."""
        first, last = (seconds_text(max(0, stamp - self.run_start)) for stamp in (self.first, self.last))
        return f"it lasts from {first} to {last} s of the run"


def span_of(
    bag: Path,
    tasks: Collection[str] = (),
    from_ns: int = 0,
    to_ns: int | None = None,
    progress: Callable[[float], None] | None = None,
) -> Span:
    """Return how long a recording lasts, and the scans of tasks in a range of ns since the start of the run.

    Raises:
        BagError: the recording cannot be read.
    """
    found = Span()
    begun = told = False
    reader = BagReader(bag)
    total = sum(map(size_of, reader.files))
    before = 0
    for file in reader.files:
        data = McapFile(file)
        for number, record in enumerate(data.records()):
            if progress is not None and not number & _PROGRESS_MASK:
                progress(min(1.0, (before + data.position) / total))
            if not isinstance(record, RawMessage):
                continue
            stamp = record.publish_time
            if not begun:
                begun = True
                found.run_start = found.first = found.last = stamp
            found.first, found.last = min(found.first, stamp), max(found.last, stamp)
            kind = record.schema.name if record.schema else ""
            if kind == _TABLE and not told:
                told, found.run_start = True, _table_stamp(bag, record)
            elif kind == _SCAN and tasks:
                time = stamp - found.run_start
                if from_ns <= time and (to_ns is None or time <= to_ns) and _task(record) in tasks:
                    found.scans += 1
        before += data.position
    return found


def require_scans(bag: Path, tasks: Collection[str], from_ns: int, to_ns: int | None) -> None:
    """Refuse a range, in ns since the start of the run, in which a recording holds no scan of the tasks.

    Raises:
        BagError: there is none, or the recording cannot be read.
    """
    span = span_of(bag, tasks, from_ns, to_ns)
    if not span.scans:
        what = f"holds no scan of {', '.join(tasks)[:80]} in the range asked for"
        raise BagError("AMX6825", bag, what, span.text())


def _table_stamp(bag: Path, record: RawMessage) -> int:
    try:
        table = decode(_TABLE, record.data)
    except CdrError as error:
        raise BagError("AMX6816", bag, f"the table of variables is malformed: {error}") from error
    assert isinstance(table, VariableTable)
    return table.stamp


def _task(record: RawMessage) -> str:
    try:
        return scan_head(record.data).task
    except CdrError:  # whoever decodes it tells
        return ""
