"""The one run of a sweep that is recorded."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from automax_ros.bags.recorder import Recorder
from automax_ros.rack.rack import Rack
from automax_ros.sweep.points import Point
from automax_ros.sweep.run import Plan, run_point
from automax_ros.sweep.sweeping import Row
from automax_ros.wire.stream import RackStream


def record_run(plan: Plan, point: Point, folder: Path, should_stop: Callable[[], bool]) -> list[Row]:
    """Run a point, record it into a new folder, and return its row, which is that of the run without recording.

    There is no row where ``should_stop`` has ended the run; what is recorded by then is a whole recording.

    Raises:
        BagError: it cannot be recorded.
    """

    def attend(rack: Rack) -> Callable[[], None]:
        stream = RackStream(rack, rack.fingerprint)
        recorder = Recorder(rack, stream, folder)

        def end() -> None:
            stream.end()
            recorder.close()
            if recorder.failure is not None:
                raise recorder.failure

        stream.begin()
        return end

    outcome = run_point(plan, point, attend, should_stop)
    return [] if should_stop() else [Row(1, point, outcome)]
