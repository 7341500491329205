"""The executor that serves all nodes of one process.

EventsExecutor receives a message in a tenth of the time that SingleThreadedExecutor takes, but in some installations it
dispatches nothing. So it is tried once at the start, and replaced where it fails the trial.
"""

from __future__ import annotations

from typing import Any

from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter

_TRIAL_PERIOD_S = 0.001
_TRIAL_LIMIT_S = 0.2


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
