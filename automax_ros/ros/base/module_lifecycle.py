"""Managed nodes of modules with tasks.

*configure* reads, checks and compiles the sources of the module's tasks again; *activate* puts them into RUN;
*deactivate* stops them between two scans; *cleanup* deletes them. When a rack starts, all of these nodes are active.
The state also follows what is done to the tasks by other means (decision): a module whose tasks were all deleted is
unconfigured, and one with a task that was put into RUN is active. Stopping tasks one by one, or a STOP ALL, leaves it
active (decision: as the node ``rack``).

Long work is done on a separate thread, which passes its result to the node's executor.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from contextlib import suppress
from typing import Any

from rclpy.node import Node

from automax_ros.rack.base.observers import Operation
from automax_ros.rack.base.stop_cause import OperationRefused
from automax_ros.rack.modules.module import Module
from automax_ros.rack.operator.module_tasks import ModuleTasks
from automax_ros.rack.operator.reloads import ReloadRefused, Reloads
from automax_ros.rack.tasks.installation import PreparedReload
from automax_ros.ros.base.lifecycle import ACTIVE, INACTIVE, UNCONFIGURED, LifecycleNode, Pending, TransitionRefused
from automax_ros.ros.base.node import ModuleNode, RackContext

NOT_OPERATED = "the rack's YAML file does not say `operator: true`"
"""Why a requested transition that stops or runs tasks is refused."""
DEACTIVATED = "the node rack was deactivated"
"""Reason of the STOP ALL that makes the nodes of the modules inactive too, in every process."""
_BEFORE_THE_RACK = "the rack has not been activated yet: activate its node rack first"


class Background:
    """Does long work for one node while the rack scans.

    The thread does not keep the program from ending; unfinished work is lost then.
    """

    def __init__(self, node: Node) -> None:
        self._node, self._closed = node, False

    def do(self, work: Callable[[], Any], finish: Callable[[Any, Exception | None], None]) -> None:
        """Call ``work`` on a thread; then the executor calls ``finish`` with its result and its exception."""
        executor = self._node.executor

        def finished(result: Any, error: Exception | None) -> None:
            if not self._closed:
                finish(result, error)

        def run() -> None:
            result, error = None, None
            try:
                result = work()
            except Exception as raised:
                error = raised
            if not self._closed:
                executor.create_task(finished, result, error)

        threading.Thread(target=run, name=f"{self._node.get_name()} work", daemon=True).start()

    def close(self) -> None:
        """Discard the results of work in progress."""
        self._closed = True


class ManagedModuleNode(LifecycleNode, ModuleNode):
    """Node of one module; a lifecycle manager can stop, delete, reload and run its tasks."""

    def __init__(self, rack_context: RackContext, module: Module) -> None:
        ModuleNode.__init__(self, rack_context, module.config.name)
        self.work = Background(self)
        self._duties_of_tasks = ModuleLifecycle(self, module)
        self.manage(self._duties_of_tasks, self.guard, self._enter)
        self.adopt_services()
        self.follow(INACTIVE)

    def follow_operation(self, operation: Operation) -> None:
        """Update the node's state after an operation."""
        if operation.what == "stop_all" and operation.reason == DEACTIVATED:
            self.follow(INACTIVE)
        elif operation.ok:
            self.follow_tasks()

    def follow_tasks(self) -> None:
        """Update the node's state from that of the tasks."""
        state = self._duties_of_tasks.state
        if state is not None:
            self.follow(state)

    def destroy_node(self) -> None:
        """Leave the graph; a source that is being compiled is not installed."""
        self.work.close()
        super().destroy_node()

    def _enter(self, action: Callable[[], None]) -> None:
        with self.rack_context.between_scans():
            action()


class ModuleLifecycle:
    """The transitions of a module's node: their effect on its tasks."""

    def __init__(self, node: ManagedModuleNode, module: Module) -> None:
        self._node, self._rack_context = node, node.rack_context
        self._tasks, self._reloads = ModuleTasks(node.rack_context.rack, module), Reloads(node.rack_context.rack)

    @property
    def state(self) -> str | None:
        """The state that follows from the tasks; None if the present state fits them."""
        if self._tasks.are_deleted:
            return UNCONFIGURED
        if self._tasks.is_running:
            return ACTIVE
        return INACTIVE if self._node.state == UNCONFIGURED else None

    def refusal(self, _: str) -> str | None:
        """Refuse transitions of a rack that has no operator or was not started."""
        if not self._rack_context.rack.config.operator:
            return NOT_OPERATED
        return None if self._rack_context.stream.has_begun else _BEFORE_THE_RACK

    def configure(self) -> Pending:
        """Reload the deleted tasks from their files; if one has an error, none is installed."""
        return Pending(lambda finish: self._reload(self._tasks.deleted, finish))

    def activate(self) -> None:
        """Put the tasks into RUN."""
        self._tasks.run()

    def deactivate(self) -> None:
        """Stop the tasks; a critical one cannot be stopped on its own."""
        self._tasks.stop()

    def cleanup(self) -> None:
        """Delete the tasks."""
        self._tasks.delete()

    def shutdown(self) -> None:
        """Stop and delete the tasks: the node stays in the graph, finalized, until the program ends (decision)."""
        self._tasks.stop()
        self._tasks.delete()

    def fail(self) -> None:
        """STOP ALL, so that no output stays on, and delete the module's tasks."""
        operations = self._rack_context.rack.operations
        if operations.powered:
            operations.stop_all(f"a transition of {self._node.get_name()} failed")
            self._tasks.delete()

    def _reload(self, names: list[str], finish: Callable[[Exception | None], None]) -> None:
        if not names:
            finish(None)
            self._node.follow_tasks()
            return
        name = names[0]

        def prepared(found: PreparedReload | None, error: Exception | None) -> None:
            with self._rack_context.between_scans():
                try:
                    if error is not None:
                        raise error
                    assert found is not None
                    if self._reloads.is_current(found):
                        self._reloads.install(found)
                    still = [item for item in names if item in self._tasks.deleted]
                except Exception as fault:
                    finish(self._given_up(name, fault))
                    self._node.follow_tasks()
                    return
                self._reload(still, finish)

        self._node.work.do(lambda: self._reloads.prepare(name, self._tasks.source(name)), prepared)

    def _given_up(self, name: str, fault: Exception) -> Exception:
        """Delete the tasks reloaded so far, and return the error of the transition."""
        with suppress(OperationRefused):  # one was put into RUN meanwhile
            self._tasks.delete()
        for text in getattr(fault, "findings", ()) if isinstance(fault, ReloadRefused) else ():
            self._node.get_logger().error(text)
        if isinstance(fault, OperationRefused):
            return TransitionRefused(f"task {name}: {fault}")
        return fault
