"""The node of a module with tasks, as a managed one.

*configure* reads, checks and compiles the sources of its tasks again; *activate* puts them into RUN; *deactivate* stops
them between two scans; *cleanup* deletes them. A running rack begins with all of them active. The state follows what
is done to the tasks otherwise (decision): a module all of whose tasks were deleted is unconfigured, and one of whose
tasks somebody has put into RUN is active. Stopping tasks one by one, or a STOP ALL, leaves it active (decision: as the
node ``rack``).

Work that takes long: on a thread of its own, and back to the node's executor with what came of it.
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
from automax_ros.rack.operator.requests import OperatorRequests, ReloadRefused
from automax_ros.rack.tasks.installation import PreparedReload
from automax_ros.ros.base.lifecycle import ACTIVE, INACTIVE, UNCONFIGURED, LifecycleNode, Pending, TransitionRefused
from automax_ros.ros.base.node import ModuleNode, RackContext


class Background:
    """Does long work for one node while the rack scans.

    The thread keeps no program from ending: what it works at then is lost.
    """

    def __init__(self, node: Node) -> None:
        """Take the node whose executor is to go on."""
        self._node, self._closed = node, False

    def do(self, work: Callable[[], Any], finish: Callable[[Any, Exception | None], None]) -> None:
        """Let a thread do ``work``; then the executor calls ``finish`` with what it returned, and what it raised."""
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
        """Forget what is under way."""
        self._closed = True


NOT_OPERATED = "the rack's YAML file does not say `operator: true`"
"""Why nobody outside may ask for a transition that stops or runs tasks."""
DEACTIVATED = "the node rack was deactivated"
"""The reason of the STOP ALL that makes the modules' nodes inactive too, in whatever process they are."""
_BEFORE_THE_RACK = "the rack has not been activated yet: activate its node rack first"


class ManagedModuleNode(LifecycleNode, ModuleNode):
    """Serves one module and lets a lifecycle manager stop, delete, reload and run its tasks."""

    def __init__(self, site: RackContext, module: Module) -> None:
        """Join the graph: the tasks are installed, so the node is inactive."""
        ModuleNode.__init__(self, site, module.config.name)
        self.work = Background(self)
        self._duties_of_tasks = ModuleLifecycle(self, module)
        self.manage(self._duties_of_tasks, self.guard, self._enter)
        self.adopt_services()
        self.follow(INACTIVE)

    def follow_operation(self, operation: Operation) -> None:
        """Take the state that an operation has brought the tasks into."""
        if operation.what == "stop_all" and operation.reason == DEACTIVATED:
            self.follow(INACTIVE)
        elif operation.ok:
            self.follow_tasks()

    def follow_tasks(self) -> None:
        """Take the state that the tasks are in."""
        state = self._duties_of_tasks.state
        if state is not None:
            self.follow(state)

    def destroy_node(self) -> None:
        """Leave the graph; a source that is being compiled is not installed."""
        self.work.close()
        super().destroy_node()

    def _enter(self, action: Callable[[], None]) -> None:
        with self.site.between_scans():
            action()


class ModuleLifecycle:
    """What the transitions of a module's node do to its tasks."""

    def __init__(self, node: ManagedModuleNode, module: Module) -> None:
        self._node, self._site = node, node.site
        self._tasks, self._orders = ModuleTasks(node.site.rack, module), OperatorRequests(node.site.rack)

    @property
    def state(self) -> str | None:
        """The state that the tasks alone tell, None where every state is as good."""
        if self._tasks.are_deleted:
            return UNCONFIGURED
        if self._tasks.is_running:
            return ACTIVE
        return INACTIVE if self._node.state == UNCONFIGURED else None

    def refusal(self, _: str) -> str | None:
        """Only an operated rack's modules may be stopped, and not before it was started."""
        if not self._site.rack.config.operator:
            return NOT_OPERATED
        return None if self._site.stream.has_begun else _BEFORE_THE_RACK

    def configure(self) -> Pending:
        """Reload the deleted tasks from their files; with an error in one of them none is there."""
        return Pending(lambda finish: self._reload(self._tasks.deleted, finish))

    def activate(self) -> None:
        """Put the tasks into RUN."""
        self._asked(self._tasks.run)

    def deactivate(self) -> None:
        """Stop the tasks; a critical one does not stop alone."""
        self._asked(self._tasks.stop)

    def cleanup(self) -> None:
        """Delete the tasks."""
        self._asked(self._tasks.delete)

    def shutdown(self) -> None:
        """Stop and delete the tasks: the node stays in the graph, finalized, until the program ends (decision)."""
        self._asked(self._tasks.stop)
        self._asked(self._tasks.delete)

    def fail(self) -> None:
        """STOP ALL, so that no output stays on, and leave no task of the module."""
        operations = self._site.rack.operations
        if operations.powered:
            operations.stop_all(f"a transition of {self._node.get_name()} failed")
            self._tasks.delete()

    def _asked(self, operation: Callable[[], None]) -> None:
        try:
            operation()
        except OperationRefused as refused:
            raise TransitionRefused(str(refused)) from refused

    def _reload(self, names: list[str], finish: Callable[[Exception | None], None]) -> None:
        """Reload tasks one after the other, and ``finish``."""
        if not names:
            finish(None)
            self._node.follow_tasks()
            return
        name = names[0]

        def prepared(found: PreparedReload | None, error: Exception | None) -> None:
            with self._site.between_scans():
                try:
                    if error is not None:
                        raise error
                    assert found is not None
                    if self._orders.is_current(found):
                        self._orders.install(found)
                    still = [item for item in names if item in self._tasks.deleted]
                except Exception as fault:
                    finish(self._given_up(name, fault))
                    self._node.follow_tasks()
                    return
                self._reload(still, finish)

        self._node.work.do(lambda: self._orders.prepare(name, self._tasks.source(name)), prepared)

    def _given_up(self, name: str, fault: Exception) -> Exception:
        """Take those that are there again out, and return what the transition ends with."""
        with suppress(OperationRefused):  # somebody has put one into RUN meanwhile
            self._tasks.delete()
        for text in getattr(fault, "findings", ()) if isinstance(fault, ReloadRefused) else ():
            self._node.get_logger().error(text)
        if isinstance(fault, OperationRefused):
            return TransitionRefused(f"task {name}: {fault}")
        return fault
