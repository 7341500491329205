"""The node ``rack``: a whole rack as one managed node, which ROS 2 lifecycle managers configure and activate.

Services, as every lifecycle node has them: ``~/change_state``, ``~/get_state``, ``~/get_available_states``,
``~/get_available_transitions``, ``~/get_transition_graph`` (lifecycle_msgs). Publishes ``~/transition_event``.

*configure* reads the rack's YAML file and compiles its tasks; *activate* puts all tasks into RUN; *deactivate* is STOP
ALL between two scans, which makes all outputs 0; *cleanup* destroys the nodes of the modules; *shutdown* ends the
program as SIGTERM does.

A rack that a fault has stopped stays active (decision): a manager that finds a node inactive that it has not
deactivated brings the whole system down, and ``/diagnostics`` reports the fault. ``deactivate`` and ``activate`` put
its tasks into RUN again, once the error log of the faulted one is cleared. Tasks that are put into RUN by other means,
as by an operator, make the node active (decision): an inactive rack does not run.

``RackLifecycle`` has the transitions of a rack that another program embeds as a library (``RackNodes``).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from rclpy.context import Context

from automax_ros.rack.base.observers import Operation
from automax_ros.rack.rack import Rack
from automax_ros.ros.base.lifecycle import (
    ACTIVATE,
    ACTIVE,
    DEACTIVATE,
    LifecycleCallbacks,
    LifecycleNode,
    Pending,
)
from automax_ros.ros.base.module_lifecycle import NOT_OPERATED
from automax_ros.ros.base.node import MAIN_NODE, RackRosNode
from automax_ros.ros.setup.arguments import NO_ARGUMENTS, RosArguments
from automax_ros.runtime.health import Health
from automax_ros.runtime.memory.views import WriteGroup
from automax_ros.runtime.tasks.task import ScanRecord, Task

_RUNS = ("run", "run_all")
"""The operations that put tasks into RUN."""


class RunningRack(Protocol):
    """A rack with its nodes."""

    rack: Rack

    @property
    def has_begun(self) -> bool:
        """Whether the program has started it."""
        ...

    def activate(self) -> Pending | None:
        """Put all stopped tasks into RUN."""
        ...

    def deactivate(self) -> None:
        """STOP ALL."""
        ...


class RackLifecycle:
    """RUN and STOP ALL of a started rack; only its program starts, closes and replaces it (decision)."""

    def __init__(self, held: RunningRack) -> None:
        self._held = held

    def refusal(self, transition: str) -> str | None:
        """Return why a transition is refused."""
        if not self._held.rack.config.operator:
            return NOT_OPERATED
        if transition not in (ACTIVATE, DEACTIVATE) or not self._held.has_begun:
            return "this rack is started and closed by the program that embeds it"
        return None

    def activate(self) -> Pending | None:
        """Put all stopped tasks into RUN."""
        return self._held.activate()

    def deactivate(self) -> None:
        """STOP ALL."""
        self._held.deactivate()

    def configure(self) -> None:
        """Do nothing: the rack is configured already."""

    def cleanup(self) -> None:
        """Do nothing: the program closes the rack."""

    def shutdown(self) -> None:
        """Do nothing: the program ends itself."""

    def fail(self) -> None:
        """STOP ALL, so that no output stays on."""
        if self._held.rack.operations.powered:
            self._held.deactivate()


class RackNode(LifecycleNode, RackRosNode):
    """The node of a whole rack."""

    def __init__(
        self,
        namespace: str,
        context: Context,
        health: Health,
        duties: LifecycleCallbacks,
        enter: Callable[[Callable[[], None]], None],
        arguments: RosArguments = NO_ARGUMENTS,
    ) -> None:
        RackRosNode.__init__(self, MAIN_NODE, namespace, context, health, arguments)
        self.health = health
        self.manage(duties, self.guard, enter)


class Follower:
    """Observes a rack, and makes the node ``rack`` active when tasks are put into RUN by other means."""

    def __init__(self, manager: LifecycleNode) -> None:
        self._manager = manager

    def operated(self, operation: Operation) -> None:
        """Activate the node if the operation has put tasks into RUN."""
        if operation.ok and operation.what in _RUNS:
            self._manager.follow(ACTIVE)

    def scanned(self, task: Task, record: ScanRecord, writes: list[WriteGroup]) -> None:
        """Ignore scans: they change no state."""

    def written(self, writes: list[WriteGroup]) -> None:
        """Ignore writes: they change no state."""

    def tuned(self, task: Task, now_ns: int) -> None:
        """Ignore tuning: it changes no state."""
