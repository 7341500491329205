"""A rack as ROS 2 nodes, embedded in any program; ``LiveRack`` (``ros/live_rack``) is one as a process.

``RackNodes`` uses the context and the executor of the program::

    rclpy.init()
    executor = SingleThreadedExecutor()
    nodes = RackNodes("rack.yaml")
    nodes.add_to(executor)
    nodes.start()
    executor.spin()        # serves your nodes and the rack's; a separate thread scans
    nodes.close()
"""

from __future__ import annotations

import os
import sys
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from dataclasses import replace
from functools import partial
from pathlib import Path
from types import TracebackType
from typing import Any

from rclpy.context import Context
from rclpy.duration import Duration
from rclpy.utilities import get_default_context

from automax_ros.core.ticks import NS_PER_S
from automax_ros.core.types import Value
from automax_ros.messages.stream.stream import RackStream
from automax_ros.rack.rack import Rack
from automax_ros.rack.tasks.installation import RackError
from automax_ros.rackfile.loader import load
from automax_ros.rackfile.processes import part_name
from automax_ros.ros.base.clock import RackClock
from automax_ros.ros.base.lifecycle import ACTIVE, INACTIVE, Pending, TransitionRefused
from automax_ros.ros.base.module_lifecycle import DEACTIVATED, ManagedModuleNode
from automax_ros.ros.base.node import SIM_TIME, ModuleNode, RackContext, RackLock, follows_clock
from automax_ros.ros.distributed.bus import DistributedMemory, ProcessLayout
from automax_ros.ros.distributed.forwarding import RequestForwarder, operate_name
from automax_ros.ros.distributed.presence import PresencePublisher
from automax_ros.ros.intake.intake import MessageIntake
from automax_ros.ros.nodes.common_memory import CommonMemoryNode
from automax_ros.ros.nodes.operator import OperatorNode, OperatorServices
from automax_ros.ros.nodes.processor import ProcessorNode
from automax_ros.ros.nodes.rack import Follower, RackLifecycle, RackNode
from automax_ros.ros.nodes.registry import nodes_of, run_facts
from automax_ros.ros.nodes.start_parameters import tune_at_start, without_use
from automax_ros.ros.setup.arguments import RosArguments, split_arguments
from automax_ros.ros.setup.parameter_files import RosArgumentsError
from automax_ros.ros.setup.process import take_out
from automax_ros.runtime.health import Health
from automax_ros.runtime.time.pacer import START_LEAD_NS
from automax_ros.runtime.time.simulated_pacer import SimulatedTime


def forward_operator(nodes: Sequence[ModuleNode], bus: DistributedMemory) -> OperatorServices | None:
    """Make the operator's node forward requests, or serve forwarded requests if that node is in another process.

    Returns the services created here, to be closed; None if the rack has no operator, or its node closes them.
    """
    rack = nodes[0].rack_context.rack
    memory = next((node for node in nodes if isinstance(node, CommonMemoryNode)), None)
    for node in nodes:
        if isinstance(node, OperatorNode) and memory is not None:
            node.operator_services.forward_by = RequestForwarder(node, bus, memory.offer_files)
    if rack.part.holds_common_memory or not rack.config.operator:
        return None
    return OperatorServices(nodes[0], partial(operate_name, part_name(rack.config, rack.part.slots)))


LOOK_S = 0.02
"""Seconds between two checks whether the other processes are present."""
DELIVERY_NS = NS_PER_S
"""How long a rack that ends waits for its subscribers to have received its last messages (decision)."""
DELIVERY_TO_RECORDER_NS = 20 * NS_PER_S
"""The same for a process that began with its recorder, whose recording must be whole (decision)."""

_Beginning = tuple[Sequence[tuple[str, Value]], "Callable[[], None] | None"]
"""The arguments of ``Rack.start``."""
_TOGETHER = "a distributed rack keeps the wall clock, by which its processes agree"


class RackNodes:
    """The nodes of one rack, and the rack itself.

    ``add_to`` an executor and ``start``, then spin it; or ``start`` with ``paced=False`` and ``run``, which scans on
    the calling thread. Messages and requests are received on a separate thread (``MessageIntake``), whatever the
    executor does. Always call ``close`` (a ``with`` block does). Hold ``lock`` to access ``rack`` meanwhile: scans and
    messages from outside do, so nothing ever interrupts a scan.

    Attributes:
        rack: the rack.
        stream: its messages, for a recorder.
        health: what went wrong so far.
        nodes: the node of each module.
        manager: the node ``rack``; None where common memory is in another process.
        notes: remarks on the command line, for the user.
    """

    def __init__(
        self,
        rack: Rack | Path | str,
        *,
        context: Context | None = None,
        arguments: RosArguments | None = None,
        manager: RackNode | None = None,
        process_layout: ProcessLayout | None = None,
        simulated: SimulatedTime | None = None,
    ) -> None:
        """Create the nodes; nothing runs yet.

        Args:
            rack: a rack that was not started, or the path of its YAML file.
            context: the context of all nodes, initialised; rclpy's default one if None.
            arguments: the ROS arguments of the nodes; those of this process if None, as in rclpy. Their namespace is
                for a rack that is given by its file; a ``Rack`` has its own.
            manager: the node ``rack`` if the caller has one and manages its state; else one is created here.
            process_layout: the processes of a distributed rack; ``rack`` is the part of this one.
            simulated: simulated time instead of the wall clock, which is then published on ``/clock``.

        Raises:
            RackError: the YAML file or a task has errors, which ``findings`` holds.
            RosArgumentsError: the command line is invalid, gives a tunable a value that its task refuses, or makes a
                distributed rack follow ``/clock``.
        """
        if arguments is None:
            arguments = split_arguments(sys.argv)[1]
        if simulated is not None:  # a rack that publishes /clock does not follow it
            arguments = arguments.without(SIM_TIME)
        self.rack = rack if isinstance(rack, Rack) else _load_rack(Path(rack), arguments)
        run_id = int.from_bytes(os.urandom(8), "big") >> 1
        self.stream = RackStream(self.rack, run_id)
        self.health = Health() if manager is None else manager.health
        self._executor: Any = None
        self._context = get_default_context() if context is None else context
        turns = RackLock()
        follows = follows_clock(arguments, self.rack.config.namespace)
        if follows and process_layout is not None:
            raise RosArgumentsError(_TOGETHER, "leave out use_sim_time, or run the rack in one process")
        self._clock = RackClock(self.rack.scheduler, turns, follows=follows, simulated=simulated)
        self._pacer = self._clock.pace
        self._intake = MessageIntake(self._report)
        self._rack_context = RackContext(
            self.rack,
            self.stream,
            self._pacer,
            self._context,
            self.health,
            self._intake,
            arguments,
            lock=turns,
            is_recorded=process_layout is not None and process_layout.awaits_recorder,
        )
        self._begun = self._finished = self._closed = False
        self._thread: threading.Thread | None = None
        self.nodes = nodes_of(self._rack_context)
        self._own: tuple[RackNode, ...] = ()
        if manager is None and self.rack.part.holds_common_memory:
            manager = RackNode(
                self.rack.config.namespace, self._context, self.health, RackLifecycle(self), self._enter, arguments
            )
            manager.served_by(self._intake)
            manager.follow(INACTIVE)
            self._own = (manager,)
        self.manager = manager
        self._clock.join(self._rack_context, self.nodes[0])
        self._to_begin: _Beginning | None = None
        if manager is not None:
            self.rack.observers.add(Follower(manager))
        self.bus = None if process_layout is None else DistributedMemory(self._rack_context, self.nodes, process_layout)
        if process_layout is None:
            PresencePublisher(self._rack_context, self.nodes[0])
        self._desk = None if self.bus is None else forward_operator(self.nodes, self.bus)
        self.notes = self._begin_with(arguments)

    def _begin_with(self, arguments: RosArguments) -> list[str]:
        """Set tunables to the values of the command line, and return messages about its unused parameters."""
        try:
            tuned = [node for node in self.nodes if isinstance(node, ProcessorNode)]
            tune_at_start(arguments, self.rack.config.namespace, tuned)
        except RosArgumentsError:
            self.close()
            raise
        managing = () if self.manager is None else (self.manager,)
        declared = {node.own_name: node.list_parameters([], 0).names for node in (*self.nodes, *managing)}
        notes = without_use(arguments, self.rack.config, declared)
        for text in notes:
            self.nodes[0].get_logger().warning(text)
        return notes

    @property
    def lock(self) -> AbstractContextManager[None]:
        """A context that holds off scans and messages: ``with nodes.lock``. Rack time is the present in it."""
        return self._rack_context.between_scans()

    def add_to(self, executor: Any) -> None:
        """Add the nodes to an rclpy executor of any kind, alone or with nodes of your own."""
        self._executor = executor
        for node in (*self.nodes, *self._own):
            executor.add_node(node)
        self._intake.open()

    def start(
        self,
        settings: Sequence[tuple[str, Value]] = (),
        first: Callable[[], None] | None = None,
        *,
        paced: bool = True,
    ) -> None:
        """Publish the state at the start and put the rack into RUN; rack time 0 follows shortly.

        A rack that follows ``/clock`` starts with its first message: ``run``, or the thread, waits for it.

        Args:
            settings: those of ``Rack.start``, whose exceptions are raised.
            first: called before tasks run; not in a rack that already runs in other processes.
            paced: whether a thread scans from then on; without one, ``run`` does.
        """
        self._intake.open()
        self._to_begin = (settings, first)
        if self._clock.is_there:
            self._begin()
        if paced:
            self._thread = threading.Thread(target=self._keep_pace, name=self.rack.config.namespace, daemon=True)
            self._thread.start()

    def _begin(self) -> None:
        beginning, self._to_begin = self._to_begin, None
        if beginning is None:
            return
        with self._rack_context.lock:
            if self.bus is None:
                self.stream.begin(self._pacer.begin(START_LEAD_NS))
                self._begun = True
                self.rack.start(*beginning)
            else:
                self._start_together(self.bus, beginning)
            if self.rack.part.holds_common_memory:
                self.nodes[0].declare_facts(run_facts(self.stream.run_id))
            for node in (*self._own, *self._managed_nodes()):
                node.follow(ACTIVE)

    @property
    def has_begun(self) -> bool:
        """Whether ``start`` was called."""
        return self._begun

    def activate(self) -> Pending | None:
        """Put all stopped tasks into RUN, also those in other processes, whose answers are awaited.

        Raises:
            OperationRefused: the rack refuses it (``Operations.run_all``).
        """
        operator = next((node for node in self.nodes if isinstance(node, OperatorNode)), None)
        if self.bus is not None and operator is not None:
            services = operator.operator_services
            return Pending(
                lambda done: services.run_everywhere(lambda why: done(TransitionRefused(why) if why else None))
            )
        with self._rack_context.between_scans():
            self.rack.operations.run_all()
        return None

    def deactivate(self) -> None:
        """STOP ALL, in all processes; the modules' nodes are inactive then too.

        Raises:
            OperationRefused: the power is off.
        """
        with self._rack_context.between_scans():
            self.rack.operations.stop_all(DEACTIVATED)

    def await_others(self, should_stop: Callable[[], bool]) -> bool:
        """Wait until the other processes of a distributed rack are present; return False if asked to stop.

        Raises:
            ProcessAlreadyRuns: another process of this run has the same modules.
        """
        bus = self.bus
        while bus is not None and not bus.epoch_ns:
            if bus.fault is not None:
                raise bus.fault
            if should_stop():
                return False
            time.sleep(LOOK_S)
        return True

    def _start_together(self, bus: DistributedMemory, beginning: _Beginning) -> None:
        """Start at the instant agreed by all processes, or join those that already run."""
        self._pacer.begin(bus.epoch_ns - time.time_ns())
        self.stream.in_run(bus.run_id)
        self.stream.begin(bus.epoch_ns)
        self._begun = True
        bus.link.begin()
        if bus.joining:
            self.rack.join(max(0, self._pacer.now_ns), bus.catch_up)
        else:
            self.rack.start(*beginning)
        bus.begin()

    def run(
        self,
        until_ns: int | None = None,
        on_idle: Callable[[int], None] | None = None,
        should_stop: Callable[[], bool] = lambda: False,
    ) -> None:
        """Scan on this thread until rack time ``until_ns``, or until asked to stop (``Pace.run``)."""
        if not self._clock.wait(should_stop, on_idle):
            return
        self._begin()
        self._pacer.run(until_ns, on_idle, should_stop)

    def finish(self) -> None:
        """Stop the tasks, and publish the last messages; a second call does nothing."""
        if self._finished:
            return
        self._finished = True
        if self._thread is not None:
            self._thread.join()
        self._intake.stop()
        with self._rack_context.lock:
            if self.bus is not None:
                self.bus.leave()
            self.rack.operations.stop_tasks()
            if self._begun:
                self._send_last()
        if self._begun:
            self._deliver()

    def close(self, *, spun: bool = True) -> None:
        """Finish, and leave the graph; a second call does nothing.

        Args:
            spun: whether a thread may be spinning the executor, which must then release the nodes first.
        """
        if self._closed:
            return
        self.finish()
        self._closed = True
        if self._desk is not None:
            self._desk.close()
        nodes = (*self.nodes, *self._own)
        if self._executor is not None:
            take_out(self._executor, nodes, spun=spun)
        for node in nodes:
            node.destroy_node()
        self._intake.close()

    def _send_last(self) -> None:
        try:
            self.stream.end()
        except Exception:
            if self._context.ok():  # else ROS was shut down, as rclpy's own handlers of signals do
                raise

    def _deliver(self) -> None:
        """Wait until subscribers have received all: a writer that is destroyed sends nothing again."""
        deadline_ns = time.monotonic_ns() + (DELIVERY_TO_RECORDER_NS if self._rack_context.is_recorded else DELIVERY_NS)
        waiting = [publisher for node in self.nodes for publisher in node.publishers]
        # Without a time to wait: rclpy would keep all other threads of Python, and its signals, from running meanwhile.
        while waiting and self._context.ok() and time.monotonic_ns() < deadline_ns:
            waiting = [publisher for publisher in waiting if not publisher.wait_for_all_acked(Duration())]
            if waiting:
                time.sleep(LOOK_S)

    def __enter__(self) -> RackNodes:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _managed_nodes(self) -> list[ManagedModuleNode]:
        return [node for node in self.nodes if isinstance(node, ManagedModuleNode)]

    def _enter(self, action: Callable[[], None]) -> None:
        with self._rack_context.between_scans():
            action()

    def _keep_pace(self) -> None:
        try:
            self._clock.wait(lambda: self._finished)
            self._begin()
            while not self._finished:
                with self._rack_context.lock.for_scan:
                    wait_s = self._pacer.step()
                time.sleep(wait_s)
        except Exception as error:
            if self._context.ok():  # else ROS was shut down, and a report reaches no subscriber
                self._report(f"rack {self.rack.config.name} has ended", error)

    def _report(self, what: str, error: Exception) -> None:
        self.nodes[0].guard.report(what, error)


def _load_rack(path: Path, arguments: RosArguments) -> Rack:
    result = load(path)
    if result.config is None:
        raise RackError(f"{path} has errors", [(result.source, result.diagnostics)])
    config = replace(result.config, namespace=arguments.placed(result.config.namespace))
    return Rack(config, stopwatch=time.monotonic_ns)
