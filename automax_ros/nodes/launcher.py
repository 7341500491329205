"""One process that is a rack: its nodes in a context and an executor of their own, on the wall clock.

Three threads. The calling one scans, on absolute deadlines (``Pacer``): no ROS timer is in the way (they skip ticks on
a busy host). A second one takes messages and requests in (``Door``), between two scans. A third one spins the executor,
which is left with the graph's events. Measured (bench/ros.py): the loop's lateness is the host's own in either form; a
loop of ``time.sleep`` without ROS oversleeps by 1 to 4 ms as often (the host of a virtual machine takes its processor
away, with a period of about 0.51 s among others). What a thread of their own gives the scans is that a long message, a
long conversion or a queue of events does not stand before them.
"""

from __future__ import annotations

from collections.abc import Callable

from rclpy.impl.implementation_singleton import rclpy_implementation

from automax_ros.core.types import Value
from automax_ros.nodes.bus import Seating
from automax_ros.nodes.environment import RosUnavailable
from automax_ros.nodes.guard import MOST_TOLD
from automax_ros.nodes.process import RosProcess
from automax_ros.nodes.rack_node import RackNode
from automax_ros.nodes.rack_nodes import RackNodes
from automax_ros.nodes.ros_arguments import NO_ARGUMENTS, RosArguments
from automax_ros.rack.rack import Rack
from automax_ros.running.simulated_pacer import SimulatedTime

RCLError: type[Exception] = rclpy_implementation.RCLError


class LiveRack:
    """A rack with its nodes in this process.

    Make it, ``start`` it, then ``run``; ``close`` in any case. ``on_idle`` or a callback sets ``stopping``.
    """

    def __init__(
        self,
        rack: Rack,
        arguments: RosArguments = NO_ARGUMENTS,
        seating: Seating | None = None,
        *,
        process: RosProcess | None = None,
        manager: RackNode | None = None,
        simulated: SimulatedTime | None = None,
    ) -> None:
        """Create all nodes.

        Args:
            rack: a rack that was not started.
            arguments: what the nodes are told.
            seating: the processes of a distributed rack, as ``RackNodes`` takes it.
            process: the caller's part in the graph, who closes it; without one it is this rack's own.
            manager: the caller's node ``rack``, as ``RackNodes`` takes it.
            simulated: the rack's own time, as ``RackNodes`` takes it.

        Raises:
            RosUnavailable: ROS cannot be initialised, or refuses a node, a topic or a service.
        """
        self.rack = rack
        self.stopping = False
        self._process = RosProcess(arguments) if process is None else process
        self._owns_process = process is None
        self._executor, context = self._process.executor, self._process.context
        try:
            with self._process.resting():
                self.nodes = RackNodes(
                    rack, context=context, arguments=arguments, manager=manager, seating=seating, simulated=simulated
                )
                self.nodes.add_to(self._executor)
        except RCLError as error:
            self._leave()
            text = str(error).split(", at /", 1)[0][:MOST_TOLD]
            hint = "do not give two of its topics or services one name (-r FROM:=TO)" if arguments.given else None
            raise RosUnavailable(f"the rack's nodes cannot be made: {text}", hint) from error
        except Exception:
            self._leave()
            raise
        self.notes = self.nodes.notes
        if process is None:
            self._process.spin(self.nodes.nodes[0].guard)
        self.stream, self.health, self.bus = self.nodes.stream, self.nodes.health, self.nodes.bus

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
        return self.nodes.await_others(should_stop)

    def start(self, settings: list[tuple[str, Value]], first: Callable[[], None] | None = None) -> None:
        """Begin the stream and put the rack into RUN (``Rack.start``); rack time starts in a moment."""
        self.nodes.start(settings, first, paced=False)

    def run(self, duration_ns: int | None, on_idle: Callable[[int], None]) -> None:
        """Let the rack live until ``stopping`` is set or the duration has passed; ``on_idle`` gets the rack time."""
        self.nodes.run(duration_ns, on_idle, lambda: self.stopping)

    def close(self) -> None:
        """Stop the tasks, send what is still to be sent, destroy the nodes, and end ROS unless the caller does."""
        with self._process.resting():
            self.nodes.close(spun=False)
        self._leave()

    def _leave(self) -> None:
        if self._owns_process:
            self._process.close()
