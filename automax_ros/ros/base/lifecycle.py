"""Managed nodes: the states and transitions of ROS 2 lifecycle managers, applied to a rack.

Transitions are requested through the services that rclpy gives a lifecycle node (``~/change_state`` and others) and
executed by ``LifecycleCallbacks``. rclpy's own driver is not used: it swallows the exceptions of a transition and
cannot wait for a thread.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

from lifecycle_msgs.msg import Transition
from rclpy.lifecycle import LifecycleNodeMixin, TransitionCallbackReturn

from automax_ros.core.text import printable
from automax_ros.rack.base.stop_cause import OperationRefused
from automax_ros.ros.intake.guard import MOST_SHOWN, RequestGuard
from automax_ros.ros.intake.service_requests import DeferredResponse, Respond, allow_deferred

UNCONFIGURED, INACTIVE, ACTIVE, FINALIZED = "unconfigured", "inactive", "active", "finalized"
"""The primary states."""
CONFIGURE, CLEANUP, ACTIVATE, DEACTIVATE, SHUTDOWN = "configure", "cleanup", "activate", "deactivate", "shutdown"
"""The transitions."""
_IDS = {
    Transition.TRANSITION_CONFIGURE: CONFIGURE,
    Transition.TRANSITION_CLEANUP: CLEANUP,
    Transition.TRANSITION_ACTIVATE: ACTIVATE,
    Transition.TRANSITION_DEACTIVATE: DEACTIVATE,
    Transition.TRANSITION_UNCONFIGURED_SHUTDOWN: SHUTDOWN,
    Transition.TRANSITION_INACTIVE_SHUTDOWN: SHUTDOWN,
    Transition.TRANSITION_ACTIVE_SHUTDOWN: SHUTDOWN,
}
_STEPS: Mapping[tuple[str, str], tuple[str, ...]] = {
    (UNCONFIGURED, INACTIVE): (CONFIGURE,),
    (UNCONFIGURED, ACTIVE): (CONFIGURE, ACTIVATE),
    (INACTIVE, ACTIVE): (ACTIVATE,),
    (INACTIVE, UNCONFIGURED): (CLEANUP,),
    (ACTIVE, INACTIVE): (DEACTIVATE,),
    (ACTIVE, UNCONFIGURED): (DEACTIVATE, CLEANUP),
}
_SUCCESS, _FAILURE, _ERROR = (
    TransitionCallbackReturn.SUCCESS,
    TransitionCallbackReturn.FAILURE,
    TransitionCallbackReturn.ERROR,
)

Done = Callable[[Exception | None], None]
"""Called at the end of a transition: with None if it succeeded, else with the error."""


class TransitionRefused(Exception):
    """A transition cannot be executed now; the node keeps its state, and the text says why."""


@dataclass(frozen=True)
class Pending:
    """A transition that ends later: ``begin`` gets the function to call, once, at its end."""

    begin: Callable[[Done], None]


class LifecycleCallbacks(Protocol):
    """The actions of a node's transitions.

    Raises:
        TransitionRefused, OperationRefused: by any of them, if it cannot be executed; the node keeps its state.
        Exception: an unforeseen error of the program: ``fail`` is called, and the node becomes unconfigured.
    """

    def refusal(self, transition: str) -> str | None:
        """Return why a transition may not be requested from outside; None if it may."""
        ...

    def configure(self) -> Pending | None:
        """Read and compile."""
        ...

    def activate(self) -> Pending | None:
        """Put tasks into RUN."""
        ...

    def deactivate(self) -> None:
        """Stop tasks between two scans."""
        ...

    def cleanup(self) -> None:
        """Release what ``configure`` created."""
        ...

    def shutdown(self) -> None:
        """Shut down."""
        ...

    def fail(self) -> None:
        """Switch everything off after an error; then the node is unconfigured."""
        ...


class LifecycleNode(LifecycleNodeMixin):  # type: ignore[misc]
    """Mixin that makes a node managed; it precedes the node class, which is initialised first."""

    def manage(
        self, duties: LifecycleCallbacks, guard: RequestGuard, enter: Callable[[Callable[[], None]], None]
    ) -> None:
        """Create the services of a lifecycle node; its state is unconfigured.

        Args:
            duties: the actions of its transitions.
            guard: keeps requests from ending the program.
            enter: executes a request between two scans, immediately or later.
        """
        LifecycleNodeMixin.__init__(self)
        self._duties, self._guard, self._enter = duties, guard, enter
        change = self._service_change_state
        change.callback = self._handle_request
        allow_deferred(change)
        for service in (
            change,
            self._service_get_state,
            self._service_get_available_states,
            self._service_get_available_transitions,
            self._service_get_transition_graph,
        ):
            guard.service(service)

    @property
    def state(self) -> str:
        """The node's state: a primary one, such as ``active``, or a transition state, such as ``configuring``."""
        return str(self._state_machine.current_state[1])

    def change(self, transition: str, done: Done = lambda _: None) -> None:
        """Execute a transition; ``done`` is called at its end, later if it must wait.

        Raises:
            TransitionRefused: the node's state does not have this transition.
        """
        self._trigger(transition)
        duty: Callable[[], Pending | None] = getattr(self._duties, transition)
        try:
            pending = duty()
        except OperationRefused as refused:
            self._conclude(transition, TransitionRefused(str(refused)), done)
            return
        except Exception as error:
            self._conclude(transition, error, done)
            return
        if pending is None:
            self._conclude(transition, None, done)
        else:
            pending.begin(lambda error: self._conclude(transition, error, done))

    def follow(self, state: str) -> None:
        """Enter a primary state that was reached by other means, as when an operator puts tasks into RUN."""
        for transition in _STEPS.get((self.state, state), ()):
            self._trigger(transition)
            self._trigger(_SUCCESS.to_label())

    def destroy_node(self) -> None:
        """Leave the graph."""
        super().destroy_node()
        self._state_machine.destroy_when_not_in_use()

    def _trigger(self, label: str) -> None:
        try:
            self._state_machine.trigger_transition_by_label(label, True)
        except Exception as error:  # rclpy's own class has no public name
            raise TransitionRefused(f"a node that is {self.state} has no transition {label}") from error

    def _conclude(self, transition: str, error: Exception | None, done: Done) -> None:
        """End a transition: with success, failure, or, after an unforeseen exception, error processing."""
        result = _SUCCESS if error is None else _FAILURE if isinstance(error, TransitionRefused) else _ERROR
        if result is _FAILURE:
            self._refuse(transition, str(error))
        self._trigger(result.to_label())
        if result is _ERROR and error is not None:
            self._guard.report(f"transition {transition} failed, everything is stopped", error)
            self._trigger(self._stop().to_label())
        done(error)

    def _stop(self) -> TransitionCallbackReturn:
        try:
            self._duties.fail()
        except Exception as error:
            self._guard.report("stopping everything failed as well", error)
            return _FAILURE
        return _SUCCESS

    def _handle_request(self, request: Any, response: Any) -> Any:
        name = _name(request.transition)
        reason = self._duties.refusal(name) if name else "it is not a transition that can be asked for"
        if reason is not None:
            self._refuse(name or printable(request.transition.label[:MOST_SHOWN]), reason)
            return response

        def begin(respond: Respond) -> None:
            def done(error: Exception | None) -> None:
                response.success = error is None
                respond(response)

            self._enter(lambda: self._try(name, done))

        return DeferredResponse(begin)

    def _try(self, transition: str, done: Done) -> None:
        try:
            self.change(transition, done)
        except TransitionRefused as refused:
            self._refuse(transition, str(refused))
            done(refused)
        except Exception as error:
            self._guard.report(f"transition {transition}", error)
            done(error)

    def _refuse(self, transition: str, reason: str) -> None:
        self.get_logger().warning(f"transition {transition} refused: {reason}")
        self._guard.refused(transition, reason[:MOST_SHOWN], reason[:MOST_SHOWN])


def _name(transition: Any) -> str:
    """Return the transition that a request names, "" if none; its label takes precedence over its number."""
    if transition.label:
        known = set(_IDS.values())
        return transition.label if transition.label in known else ""
    return _IDS.get(transition.id, "")
