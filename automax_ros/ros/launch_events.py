"""`RackStopped`, the event of the package launch that reports a STOP ALL of a rack to a launch file.

    from automax_ros.ros.launch_events import RackStopped
    RegisterEventHandler(EventHandler(matcher=RackStopped.is_event, entities=[...]))

`rack.launch.py` emits it for each STOP ALL that the rack prints, whatever its cause; `text` is the printed line. The
end of the process, which after a fault exits with code 1 once it is asked to end, is launch's own `OnProcessExit`.
"""

from __future__ import annotations

from typing import Any

from launch import Event

from automax_ros.rack.base.stop_cause import STOP_ALL


class RackStopped(Event):  # type: ignore[misc]
    """A STOP ALL of a rack."""

    name = "automax_ros.RackStopped"

    def __init__(self, text: str) -> None:
        self.text = text

    @staticmethod
    def is_event(event: Any) -> bool:
        """Return whether an event is a ``RackStopped``: the matcher of an event handler."""
        return isinstance(event, RackStopped)


def stops_of(output: bytes) -> list[RackStopped]:
    """Return the STOP ALLs in the output of a rack; lines of a distributed one begin with a process's name."""
    lines = output.decode(errors="replace").splitlines()
    shown = (line.strip() for line in lines)
    return [RackStopped(line) for line in shown if line.partition(STOP_ALL)[0] == "" or f": {STOP_ALL}" in line]
