"""A rack and its nodes as a process, as ``automax run`` and ``automax node`` hold it.

It has its own context and executor, and three threads. The calling one scans, at absolute deadlines (``Pacer``),
without ROS timers (they skip ticks on a busy host). A second one receives messages and requests (``MessageIntake``),
between two scans. A third one spins the executor, which only handles events of the graph. Measured (bench/ros.py): the
loop's lateness is the host's own, as it is of nodes embedded in a program; a loop of ``time.sleep`` without ROS
oversleeps by 1 to 4 ms as often (the host of a virtual machine takes its processor away, with a period of about 0.51 s
among others). With a separate thread, scans are not delayed by a long message, a long conversion or a queue of events.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack

from rclpy.impl.implementation_singleton import rclpy_implementation

from automax_ros.core.types import Value
from automax_ros.rack.rack import Rack
from automax_ros.ros.distributed.bus import ProcessLayout
from automax_ros.ros.intake.guard import MOST_SHOWN
from automax_ros.ros.nodes.rack import RackNode
from automax_ros.ros.rack_nodes import RackNodes
from automax_ros.ros.setup.arguments import NO_ARGUMENTS, RosArguments
from automax_ros.ros.setup.environment import RosUnavailable
from automax_ros.ros.setup.process import RosProcess
from automax_ros.runtime.time.simulated_pacer import SimulatedTime

RCLError: type[Exception] = rclpy_implementation.RCLError


class LiveRack:
    """A rack and its nodes, as this process.

    Create it, ``start`` it, then ``run``; always call ``close``. ``on_idle`` or a callback sets ``stopping``.
    """

    def __init__(
        self,
        rack: Rack,
        arguments: RosArguments = NO_ARGUMENTS,
        process_layout: ProcessLayout | None = None,
        *,
        process: RosProcess | None = None,
        manager: RackNode | None = None,
        simulated: SimulatedTime | None = None,
    ) -> None:
        """Create all nodes.

        Args:
            rack: a rack that was not started.
            arguments: the ROS arguments of the nodes.
            process_layout: the processes of a distributed rack, as for ``RackNodes``.
            process: the caller's context and executor, which the caller closes; the rack's own if None.
            manager: the caller's node ``rack``, as for ``RackNodes``.
            simulated: simulated time, as for ``RackNodes``.

        Raises:
            RosUnavailable: ROS cannot be initialised, or refuses a node, a topic or a service.
        """
        self.rack = rack
        self.stopping = self._finished = False
        self._rest = ExitStack()
        self._process = RosProcess(arguments) if process is None else process
        self._owns_process = process is None
        self._executor, context = self._process.executor, self._process.context
        try:
            with self._process.resting():
                self.nodes = RackNodes(
                    rack,
                    context=context,
                    arguments=arguments,
                    manager=manager,
                    process_layout=process_layout,
                    simulated=simulated,
                )
                self.nodes.add_to(self._executor)
        except RCLError as error:
            self._leave()
            text = str(error).split(", at /", 1)[0][:MOST_SHOWN]
            hint = "do not give two of its topics or services one name (-r FROM:=TO)" if arguments.given else None
            raise RosUnavailable(f"the rack's nodes cannot be made: {text}", hint) from error
        except Exception:
            self._leave()
            raise
        self.notes = self.nodes.notes
        if process is None:
            self._process.spin(self.nodes.nodes[0].guard)
        self.stream, self.health, self.bus = self.nodes.stream, self.nodes.health, self.nodes.bus

    def start(self, settings: list[tuple[str, Value]], first: Callable[[], None] | None = None) -> None:
        """Begin the stream and put the rack into RUN (``Rack.start``); rack time 0 follows shortly."""
        self.nodes.start(settings, first, paced=False)

    def run(self, duration_ns: int | None, on_idle: Callable[[int], None]) -> None:
        """Run the rack until ``stopping`` is set or the duration has passed; ``on_idle`` gets the rack time."""
        self.nodes.run(duration_ns, on_idle, lambda: self.stopping)

    def finish(self) -> None:
        """Stop the tasks, and publish the last messages; the nodes serve nothing after that. Again, it does nothing."""
        if not self._finished:
            self._finished = True
            self._rest.enter_context(self._process.resting())
            self.nodes.finish()

    def close(self) -> None:
        """Finish, destroy the nodes, and shut ROS down unless the caller does."""
        with self._rest:
            self.finish()
            self.nodes.close(spun=False)
        self._leave()

    def _leave(self) -> None:
        if self._owns_process:
            self._process.close()
