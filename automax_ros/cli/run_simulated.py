"""A run in simulated time, without ROS."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

from automax_ros.bags.rack_stream import RackStream
from automax_ros.bags.recorder import Recorder
from automax_ros.cli.run import warn
from automax_ros.cli.signals import StopRequest
from automax_ros.cli.status import StatusDisplay
from automax_ros.core.ticks import NS_PER_MS
from automax_ros.core.types import Value
from automax_ros.rack.config import RackConfig
from automax_ros.rack.rack import Rack
from automax_ros.rack.settings import Watched

SLICE_NS = 100 * NS_PER_MS
"""Rack time between two looks at signals and the display."""


def run_simulated(
    config: RackConfig,
    duration_ns: int | None,
    record: Path | None,
    settings: list[tuple[str, Value]],
    watch: Sequence[Watched],
    stop: StopRequest,
) -> int:
    """Run until the duration has passed, a fault stops all tasks, or a stop is requested; return the exit code."""
    rack = Rack(config)
    warn(rack)
    stream = RackStream(rack, rack.fingerprint)
    recorder = Recorder(rack, stream, record) if record is not None else None
    display = StatusDisplay(rack, watch, live=False)
    try:
        if recorder is not None:
            stream.begin()
        rack.start(settings)
        while not stop.requested and rack.stop_reason is None and (duration_ns is None or rack.now_ns < duration_ns):
            end = rack.now_ns + SLICE_NS
            rack.scheduler.run_until(end if duration_ns is None else min(end, duration_ns))
            display.printed()
            display.update(rack.now_ns)
    finally:
        if recorder is not None:
            stream.end()
            recorder.close()
    display.finish(record)
    return report_end(rack, recorder)


def report_end(rack: Rack, recorder: Recorder | None) -> int:
    """Print what went wrong and return the exit code: 1 after a fault or a recording that broke off."""
    code = 0
    if rack.stop_reason is not None:
        print(f"automax run: STOP ALL: {rack.stop_reason}", file=sys.stderr)
        code = 1
    if recorder is not None and recorder.failure is not None:
        print(recorder.failure, file=sys.stderr)
        code = 1
    return code
