"""This program in the ROS graph: its context, and the executor that serves all its nodes on a separate thread.

EventsExecutor receives a message in a tenth of the time that SingleThreadedExecutor takes, but in some installations it
dispatches nothing. So it is tried once at the start, and replaced if the trial fails.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from typing import Any

from rclpy.context import Context
from rclpy.exceptions import InvalidHandle
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter

from automax_ros.ros.intake.guard import RequestGuard
from automax_ros.ros.setup.arguments import NO_ARGUMENTS, RosArguments
from automax_ros.ros.setup.environment import RosUnavailable

_SECURITY = "ROS_SECURITY_ENABLE"
_MOST_SHOWN = 400


_TRIAL_PERIOD_S = 0.001
_TRIAL_LIMIT_S = 0.2
_ANSWER_S = 0.5
"""An executor that has not begun a task after this time is not spun, or is spun by the waiting thread."""
_PASS_S = 10.0
"""Longest wait for an executor that is spun: it may be in a long callback."""
_SPIN_S = 0.1
"""Longest wait of the executor for an event."""


def joined_context(arguments: RosArguments = NO_ARGUMENTS) -> Context:
    """Return a context that has joined the graph; the caller shuts it down.

    Raises:
        RosUnavailable: ROS cannot be initialised.
    """
    context = Context()
    try:
        context.init(args=arguments.words)
        if os.environ.get(_SECURITY, "").lower() == "true":
            # A node makes DDS read the keys, which fails if it was built without security.
            node = Node("security_check", context=context, enable_rosout=False, start_parameter_services=False)
            node.destroy_node()
    except RuntimeError as error:
        context.try_shutdown()
        raise RosUnavailable(f"ROS 2 does not start: {str(error).strip()[:_MOST_SHOWN]}") from error
    return context


def make_executor(context: Context) -> Any:
    """Return an executor that dispatches when ``spin_once(timeout_sec=...)`` is called.

    Returns Any: the two executors have no common class in rclpy.
    """
    try:
        from rclpy.experimental import EventsExecutor
    except ImportError:
        return SingleThreadedExecutor(context=context)
    executor = EventsExecutor(context=context)
    if dispatches(executor, context):
        return executor
    executor.shutdown()
    return SingleThreadedExecutor(context=context)


def dispatches(executor: Any, context: Context) -> bool:
    """Return whether an executor calls the callback of a timer that is due."""
    # A service of rclpy's own would outlive its node in the graph.
    quiet = [Parameter("start_type_description_service", value=False)]
    node = Node(
        "executor_trial",
        context=context,
        enable_rosout=False,
        start_parameter_services=False,
        parameter_overrides=quiet,
    )
    hits: list[bool] = []
    timer = node.create_timer(_TRIAL_PERIOD_S, lambda: hits.append(True))
    try:
        executor.add_node(node)
        for _ in range(3):
            executor.spin_once(timeout_sec=_TRIAL_LIMIT_S)
            if hits:
                return True
        return False
    except RuntimeError:
        return False
    finally:
        timer.cancel()
        executor.remove_node(node)
        node.destroy_node()


def take_out(executor: Any, nodes: Iterable[Node], *, spun: bool = True) -> None:
    """Remove nodes from an executor, and wait until a thread that spins it no longer uses them: they may be destroyed.

    If no thread spins it there is no wait, but finding that out takes half a second unless ``spun`` is False.

    rclpy's executors use the nodes that they found at the beginning of a pass, and a node that is destroyed meanwhile
    ends their thread by ``InvalidHandle``. A task is begun in a pass that found the nodes before or after they were
    removed; a second task, created when the first is done, in a later pass.
    """
    for node in nodes:
        executor.remove_node(node)
    if not spun:
        return
    with suppress(AttributeError, InvalidHandle):  # of an executor that was shut down
        for limit_s in (_ANSWER_S, _PASS_S):
            begun = threading.Event()
            executor.create_task(begun.set)
            if not begun.wait(limit_s):
                return


class RosProcess:
    """The context and the executor of this program; always call ``close``."""

    def __init__(self, arguments: RosArguments = NO_ARGUMENTS) -> None:
        """Initialise ROS for this process; nothing is served before ``spin``.

        Raises:
            RosUnavailable: ROS cannot be initialised.
        """
        self.context = joined_context(arguments)
        self.executor = make_executor(self.context)
        self._guard: RequestGuard | None = None
        self._thread: threading.Thread | None = None
        self._rests = False

    def spin(self, guard: RequestGuard) -> None:
        """Start serving the nodes; ``guard`` reports failures."""
        self._guard, self._rests = guard, False
        self._thread = threading.Thread(target=self._spin, name="executor", daemon=True)
        self._thread.start()

    @contextmanager
    def resting(self) -> Iterator[None]:
        """Serve nothing inside the block: nodes may be added and removed only there.

        If nodes were removed, a new executor serves the others: EventsExecutor crashes if it is spun with events of
        publishers that have left it, because it releases the last one without the interpreter's lock
        (https://github.com/ros2/rclpy/issues/1644). Such events occur when other processes leave the graph just then.
        """
        spun = self._thread is not None
        self._rest()
        before = set(self.executor.get_nodes())
        try:
            yield
        finally:
            staying = set(self.executor.get_nodes())
            if before - staying:
                self.executor.shutdown()
                self.executor = type(self.executor)(context=self.context)
                for node in staying:
                    self.executor.add_node(node)
            if spun and self._guard is not None:
                self.spin(self._guard)

    def close(self) -> None:
        """Leave the graph, once all nodes have left."""
        self._rest()
        self.executor.shutdown()
        self.context.try_shutdown()

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
