"""Managed nodes: the states and transitions that ROS 2 lifecycle managers know, over what a rack can do.

A transition is asked of the services that rclpy gives a lifecycle node (``~/change_state`` and others). What it does is
``LifecycleCallbacks``; rclpy's own driver is not used, since it swallows what a transition raises and cannot wait for a
thread.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

from lifecycle_msgs.msg import Transition
from rclpy.lifecycle import LifecycleNodeMixin, TransitionCallbackReturn

from automax_ros.core.text import printable
from automax_ros.ros.intake.guard import MOST_TOLD, RequestGuard
from automax_ros.ros.intake.service_requests import DeferredResponse, Respond, allow_deferred

UNCONFIGURED, INACTIVE, ACTIVE, FINALIZED = "unconfigured", "inactive", "active", "finalized"
"""The states that last."""
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
"""Is told how a transition has ended: None where it succeeded."""


class TransitionRefused(Exception):
    """A transition cannot be carried out now; the node keeps its state, and the text says why."""


@dataclass(frozen=True)
class Pending:
    """The rest of a transition that goes on elsewhere: ``begin`` gets what is called, once, with how it ended."""

    begin: Callable[[Done], None]


class LifecycleCallbacks(Protocol):
    """What the transitions of a node do.

    Raises:
        TransitionRefused: every one of them, where it cannot be done; the node keeps its state.
        Exception: something unforeseen, our own error: ``fail`` is called, and the node is unconfigured.
    """

    def refusal(self, transition: str) -> str | None:
        """Return why a transition may not be asked for from outside, None where it may."""
        ...

    def configure(self) -> Pending | None:
        """Read and compile."""
        ...

    def activate(self) -> Pending | None:
        """RUN."""
        ...

    def deactivate(self) -> None:
        """Stop between two scans."""
        ...

    def cleanup(self) -> None:
        """Leave what ``configure`` has made."""
        ...

    def shutdown(self) -> None:
        """End."""
        ...

    def fail(self) -> None:
        """Leave nothing on, whatever has failed; then the node is unconfigured."""
        ...


class LifecycleNode(LifecycleNodeMixin):  # type: ignore[misc]
    """Lets a node be managed; to be inherited from before a class of nodes, which is initialised first."""

    def manage(
        self, duties: LifecycleCallbacks, guard: RequestGuard, enter: Callable[[Callable[[], None]], None]
    ) -> None:
        """Offer the services of a lifecycle node; its state is unconfigured.

        Args:
            duties: what its transitions do.
            guard: what keeps requests from ending the program.
            enter: carries out what a request asks for, at once or later, between two scans.
        """
        LifecycleNodeMixin.__init__(self)
        self._duties, self._guard, self._enter = duties, guard, enter
        asked = self._service_change_state
        asked.callback = self._asked
        allow_deferred(asked)
        for service in (asked, self._service_get_state, *self._descriptions()):
            guard.service(service)

    @property
    def state(self) -> str:
        """The node's state, such as ``active``; between two that last, such as ``configuring``."""
        return str(self._state_machine.current_state[1])

    def change(self, transition: str, done: Done = lambda _: None) -> None:
        """Carry out a transition; ``done`` is called with what it ended with, later if it must wait.

        Raises:
            TransitionRefused: the node's state does not have this transition.
        """
        self._trigger(transition)
        duty: Callable[[], Pending | None] = getattr(self._duties, transition)
        try:
            pending = duty()
        except Exception as error:
            self._conclude(transition, error, done)
            return
        if pending is None:
            self._conclude(transition, None, done)
        else:
            pending.begin(lambda error: self._conclude(transition, error, done))

    def follow(self, state: str) -> None:
        """Take a lasting state that has come about otherwise, as when an operator has put tasks into RUN."""
        for transition in _STEPS.get((self.state, state), ()):
            self._trigger(transition)
            self._trigger(_SUCCESS.to_label())

    def destroy_node(self) -> None:
        """Leave the graph."""
        super().destroy_node()
        self._state_machine.destroy_when_not_in_use()

    def _descriptions(self) -> tuple[Any, ...]:
        return (
            self._service_get_available_states,
            self._service_get_available_transitions,
            self._service_get_transition_graph,
        )

    def _trigger(self, label: str) -> None:
        try:
            self._state_machine.trigger_transition_by_label(label, True)
        except Exception as error:  # rclpy's own class has no public name
            raise TransitionRefused(f"a node that is {self.state} has no transition {label}") from error

    def _conclude(self, transition: str, error: Exception | None, done: Done) -> None:
        """End a transition: by success, by failure, or by error processing where something unforeseen was raised."""
        result = _SUCCESS if error is None else _FAILURE if isinstance(error, TransitionRefused) else _ERROR
        if result is _FAILURE:
            self._tell(transition, str(error))
        self._trigger(result.to_label())
        if result is _ERROR and error is not None:
            self._guard.report(f"transition {transition} failed, everything is stopped", error)
            self._trigger(self._failed().to_label())
        done(error)

    def _failed(self) -> TransitionCallbackReturn:
        try:
            self._duties.fail()
        except Exception as error:
            self._guard.report("stopping everything failed as well", error)
            return _FAILURE
        return _SUCCESS

    def _asked(self, request: Any, response: Any) -> Any:
        name = _name(request.transition)
        reason = self._duties.refusal(name) if name else "it is not a transition that can be asked for"
        if reason is not None:
            self._tell(name or printable(request.transition.label[:MOST_TOLD]), reason)
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
            self._tell(transition, str(refused))
            done(refused)
        except Exception as error:
            self._guard.report(f"transition {transition}", error)
            done(error)

    def _tell(self, transition: str, reason: str) -> None:
        self.get_logger().warning(f"transition {transition} refused: {reason}")
        self._guard.refused(transition, reason[:MOST_TOLD], reason[:MOST_TOLD])


def _name(transition: Any) -> str:
    """Return the transition that a request means, "" if it is none: its label counts before its number."""
    if transition.label:
        known = set(_IDS.values())
        return transition.label if transition.label in known else ""
    return _IDS.get(transition.id, "")
