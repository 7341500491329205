"""One process that composes all nodes of a rack over one memory image, on the wall clock.

The loop stands on absolute deadlines: it serves ROS until the next instant of the rack's scheduler, then carries out
what is due. No ROS timer is in the way (they skip ticks on a busy host); a deadline that the host made the loop miss is
skipped and counted, and the next scan stays on the grid. Messages are served on the same thread, so a write from
outside always falls between two scans.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from rclpy.context import Context

from automax_ros.core.types import Value
from automax_ros.nodes.common_memory import CommonMemoryNode
from automax_ros.nodes.environment import RosUnavailable
from automax_ros.nodes.executor import make_executor
from automax_ros.nodes.processor import ProcessorNode
from automax_ros.rack.rack import Rack
from automax_ros.running.health import Health
from automax_ros.running.pacer import START_LEAD_NS, Pacer
from automax_ros.wire.stream import RackStream

_NO_CONSOLE = ["--ros-args", "--disable-stdout-logs"]


@dataclass
class LiveRack:
    """A rack with its nodes in this process.

    Raises RosUnavailable if ROS cannot be initialised.

    Make it, ``start`` it, then ``run``; ``close`` in any case. ``on_idle`` or a callback sets ``stopping``.
    """

    rack: Rack
    stream: RackStream = field(init=False)
    stopping: bool = False
    health: Health = field(default_factory=Health)
    _context: Context = field(init=False)
    _executor: Any = field(init=False, default=None)
    _nodes: list[Any] = field(init=False, default_factory=list)
    _pacer: Pacer = field(init=False)
    _begun: bool = field(init=False, default=False)

    def __post_init__(self) -> None:
        """Initialise ROS for this process and create all nodes."""
        self._context = Context()
        try:
            self._context.init(args=_NO_CONSOLE)
        except RuntimeError as error:
            raise RosUnavailable(f"ROS 2 does not start: {error}") from error
        run_id = int.from_bytes(os.urandom(8), "big") >> 1
        self.stream = RackStream(self.rack, run_id)
        self._executor = make_executor(self._context)
        self._pacer = Pacer(self.rack.scheduler, wait=lambda seconds: self._executor.spin_once(timeout_sec=seconds))
        self._nodes.append(CommonMemoryNode(self.rack, self.stream, self._context, self._pacer.catch_up, self.health))
        for processor in self.rack.processors:
            self._nodes.append(
                ProcessorNode(self.rack, processor, self.stream, self._context, self._pacer.catch_up, self.health)
            )
        for node in self._nodes:
            self._executor.add_node(node)

    def start(self, settings: list[tuple[str, Value]]) -> None:
        """Begin the stream and put the rack into RUN; rack time starts in a moment."""
        self._pacer.begin(START_LEAD_NS)
        self.stream.begin(time.time_ns() + START_LEAD_NS)
        self._begun = True
        self.rack.start(settings)

    def run(self, duration_ns: int | None, on_idle: Callable[[int], None]) -> None:
        """Let the rack live until ``stopping`` is set or the duration has passed; ``on_idle`` gets the rack time."""
        self._pacer.run(duration_ns, on_idle, lambda: self.stopping)

    def close(self) -> None:
        """Stop the tasks, send what is still to be sent, destroy the nodes and end ROS in this process."""
        self.rack.stop()
        if self._begun:
            self.stream.end()
        if self._executor is not None:
            self._executor.shutdown()
        for node in self._nodes:
            node.destroy_node()
        self._context.try_shutdown()
