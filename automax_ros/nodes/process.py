"""This program in the ROS graph: its context, and the executor that serves all its nodes on a thread of its own."""

from __future__ import annotations

import threading
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress

from rclpy.node import Node

from automax_ros.nodes.context import joined_context
from automax_ros.nodes.executor import make_executor
from automax_ros.nodes.guard import Guard
from automax_ros.nodes.ros_arguments import NO_ARGUMENTS, RosArguments

_SPIN_S = 0.1
"""Longest wait of the executor for an event."""


class RosProcess:
    """A context and an executor of this program's own; ``close`` in any case."""

    def __init__(self, arguments: RosArguments = NO_ARGUMENTS) -> None:
        """Initialise ROS for this process; nothing is served before ``spin``.

        Raises:
            RosUnavailable: ROS cannot be initialised.
        """
        self.context = joined_context(arguments)
        self.executor = make_executor(self.context)
        self._guard: Guard | None = None
        self._thread: threading.Thread | None = None
        self._rests = False

    def spin(self, guard: Guard) -> None:
        """Begin to serve the nodes; ``guard`` is told what fails."""
        self._guard, self._rests = guard, False
        self._thread = threading.Thread(target=self._spin, name="executor", daemon=True)
        self._thread.start()

    @contextmanager
    def resting(self) -> Iterator[None]:
        """Serve nothing while the block lasts: nodes come and go only then.

        Where nodes have gone another executor serves those that stay: EventsExecutor crashes where it is spun with
        events of publishers that have left it, for it lets go of the last one without the interpreter's lock
        (https://github.com/ros2/rclpy/issues/1644). They come when other processes leave the graph just then.
        """
        spun = self._thread is not None
        self._rest()
        before = set(self.executor.get_nodes())
        try:
            yield
        finally:
            staying = set(self.executor.get_nodes())
            if before - staying:
                self._renew_executor(staying)
            if spun and self._guard is not None:
                self.spin(self._guard)

    def close(self) -> None:
        """Leave the graph, once all nodes have."""
        self._rest()
        self.executor.shutdown()
        self.context.try_shutdown()

    def _renew_executor(self, nodes: Iterable[Node]) -> None:
        self.executor.shutdown()
        self.executor = type(self.executor)(context=self.context)
        for node in nodes:
            self.executor.add_node(node)

    def _rest(self) -> None:
        self._rests = True
        if self._thread is not None:
            self._thread.join()
        self._thread = None

    def _spin(self) -> None:
        assert self._guard is not None
        with suppress(Exception):  # what an executor raises once the context is shut down
            while not self._rests and self.context.ok():
                self._guard.serve(self.executor, self.context, _SPIN_S)
