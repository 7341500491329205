"""One process that is a rack: its nodes in a context and an executor of their own, on the wall clock.

Three threads. The calling one scans, on absolute deadlines (``Pacer``): no ROS timer is in the way (they skip ticks on
a busy host). A second one takes messages and requests in (``Door``), between two scans. A third one spins the executor,
which is left with the graph's events. Measured (bench/ros.py): the loop's lateness is the host's own in either form; a
loop of ``time.sleep`` without ROS oversleeps by 1 to 4 ms as often (the host of a virtual machine takes its processor
away, with a period of about 0.51 s among others). What a thread of their own gives the scans is that a long message, a
long conversion or a queue of events does not stand before them.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from contextlib import suppress

from automax_ros.core.types import Value
from automax_ros.nodes.bus import Seating
from automax_ros.nodes.context import joined_context
from automax_ros.nodes.executor import make_executor
from automax_ros.nodes.rack_nodes import RackNodes
from automax_ros.nodes.ros_arguments import NO_ARGUMENTS, RosArguments
from automax_ros.rack.rack import Rack

_SPIN_S = 0.1
"""Longest wait of the executor for an event."""


class LiveRack:
    """A rack with its nodes in this process.

    Make it, ``start`` it, then ``run``; ``close`` in any case. ``on_idle`` or a callback sets ``stopping``.
    """

    def __init__(self, rack: Rack, arguments: RosArguments = NO_ARGUMENTS, seating: Seating | None = None) -> None:
        """Initialise ROS for this process and create all nodes; ``seating`` is that of ``RackNodes``.

        Raises:
            RosUnavailable: ROS cannot be initialised.
        """
        self.rack = rack
        self.stopping = False
        self._context = joined_context(arguments)
        self._executor = make_executor(self._context)
        try:
            self._nodes = RackNodes(rack, context=self._context, arguments=arguments, seating=seating)
        except Exception:
            self._leave()
            raise
        self._nodes.add_to(self._executor)
        self.notes = self._nodes.notes
        self._closing = False
        self._spinning = threading.Thread(target=self._spin, name="executor", daemon=True)
        self._spinning.start()
        self.stream, self.health, self.bus = self._nodes.stream, self._nodes.health, self._nodes.bus

    @property
    def missing(self) -> list[str]:
        """The other processes of a distributed rack that are not there."""
        return self.bus.missing if self.bus is not None else []

    @property
    def is_joining(self) -> bool:
        """Whether the rack ran already in other processes when this one began."""
        return self.bus is not None and self.bus.joining

    def await_others(self, should_stop: Callable[[], bool]) -> bool:
        """Wait for the other processes of a distributed rack; FALSE where asked to stop meanwhile.

        Raises:
            SeatTaken: another process of this run has the same modules.
        """
        return self._nodes.await_others(should_stop)

    def start(self, settings: list[tuple[str, Value]]) -> None:
        """Begin the stream and put the rack into RUN; rack time starts in a moment."""
        self._nodes.start(settings, paced=False)

    def run(self, duration_ns: int | None, on_idle: Callable[[int], None]) -> None:
        """Let the rack live until ``stopping`` is set or the duration has passed; ``on_idle`` gets the rack time."""
        self._nodes.run(duration_ns, on_idle, lambda: self.stopping)

    def close(self) -> None:
        """Stop the tasks, send what is still to be sent, destroy the nodes and end ROS in this process."""
        self._closing = True
        self._spinning.join()
        self._nodes.close()
        self._leave()

    def _leave(self) -> None:
        self._executor.shutdown()
        self._context.try_shutdown()

    def _spin(self) -> None:
        guard = self._nodes.nodes[0].guard
        with suppress(Exception):  # what an executor raises once the context is shut down
            while not self._closing and self._context.ok():
                guard.serve(self._executor, self._context, _SPIN_S)
