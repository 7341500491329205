"""A run in simulated time, without ROS."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

from automax_ros.bags.recorder import Recorder, RecordingOptions
from automax_ros.cli.recording_watch import RecordingWatch
from automax_ros.cli.run import warn
from automax_ros.cli.signals import StopRequest
from automax_ros.cli.status import StatusDisplay
from automax_ros.core.ticks import NS_PER_MS
from automax_ros.core.types import Value
from automax_ros.rack.config import RackConfig
from automax_ros.rack.rack import Rack
from automax_ros.rack.settings import Watched
from automax_ros.wire.stream import RackStream

SLICE_NS = 100 * NS_PER_MS
"""Rack time between two looks at signals and the display."""


def run_simulated(
    config: RackConfig,
    duration_ns: int | None,
    record: Path | None,
    options: RecordingOptions,
    settings: list[tuple[str, Value]],
    watch: Sequence[Watched],
    stop: StopRequest,
) -> int:
    """Run until the duration has passed, a fault stops all tasks, or a stop is requested; return the exit code."""
    rack = Rack(config)
    warn(rack)
    stream = RackStream(rack, rack.fingerprint)
    recorder = Recorder(rack, stream, record, options) if record is not None else None
    display = StatusDisplay(rack, watch, live=False)
    recording = RecordingWatch(recorder, display)
    try:
        if recorder is not None:
            stream.begin()
        rack.start(settings)
        while not stop.requested and rack.stop_reason is None and (duration_ns is None or rack.now_ns < duration_ns):
            end = rack.now_ns + SLICE_NS
            rack.scheduler.run_until(end if duration_ns is None else min(end, duration_ns))
            display.printed()
            display.update(rack.now_ns)
            recording.tell()
    finally:
        if recorder is not None:
            stream.end()
            recorder.close()
    recording.tell()
    display.finish(record, complete=not recording.failed)
    return report_end(rack, failed=recording.failed)


def report_end(rack: Rack, *, failed: bool) -> int:
    """Print what stopped the rack and return the exit code: 1 after a fault or a recording that ``failed``."""
    if rack.stop_reason is not None:
        print(f"automax run: STOP ALL: {rack.stop_reason}", file=sys.stderr)
        return 1
    return 1 if failed else 0
