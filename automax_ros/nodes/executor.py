"""The executor that serves all nodes of one process.

EventsExecutor receives a message in a tenth of the time that SingleThreadedExecutor takes, but in some installations it
dispatches nothing. So it is tried once at the start, and replaced where it fails the trial.
"""

from __future__ import annotations

import threading
from collections.abc import Iterable
from contextlib import suppress
from typing import Any

from rclpy.context import Context
from rclpy.exceptions import InvalidHandle
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter

_TRIAL_PERIOD_S = 0.001
_TRIAL_LIMIT_S = 0.2
_ANSWER_S = 0.5
"""An executor that has not begun a task after this time is not spun, or by the thread that asks."""
_PASS_S = 10.0
"""Longest wait for one that is spun: it may be at a long callback."""


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
    """Return whether an executor carries out the callback of a timer that is due."""
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
    """Take nodes out of an executor, and wait until a thread that spins it has let go of them: they may be destroyed.

    Nothing is waited for where nobody spins it, which takes half a second to see unless ``spun`` says so.

    rclpy's executors go on with the nodes that they have found at the beginning of a pass, and what is destroyed
    meanwhile ends their thread by ``InvalidHandle``. A task is begun in a pass that found the nodes before or after
    they were taken out; a second one, made when the first is done, in a later pass.
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
