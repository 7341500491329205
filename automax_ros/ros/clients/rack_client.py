"""Operates a rack that runs in another process, through the services of its node ``operator``."""

from __future__ import annotations

import os
import time
from array import array
from collections.abc import Callable, Mapping
from typing import Any

from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter

from automax_ros.core.ticks import NS_PER_S
from automax_ros.core.user_error import UserError
from automax_ros.rack.operator.requests import VERBS
from automax_ros.ros.base.qos import message_class
from automax_ros.ros.clients import recorded_run as participants
from automax_ros.ros.clients.recorded_run import racks_of
from automax_ros.ros.setup.arguments import NO_ARGUMENTS, RosArguments
from automax_ros.ros.setup.process import joined_context

_LOOK_S = 0.05
_SETTLED_NS = 2 * NS_PER_S
"""A rack whose nodes have been seen this long without its operator has none (decision)."""
ALONE_NS = participants.ALONE_NS
_TABLE_TYPE = "automax_msgs/msg/VariableTable"
_MEMORY_NODE, _OPERATOR = "common_memory", "operator"


class NotOperable(UserError):
    """The rack is not found, has no operator, does not answer, or there are several of its name."""


class Interrupted(Exception):
    """The user has stopped waiting."""


class RackClient:
    """Client of a rack's operator; a context manager. ``space`` is the rack's namespace with its slash.

    ``should_stop`` ends all waiting.

    Raises:
        RosUnavailable: ROS cannot be initialised.
        Interrupted: by ``find`` and ``call``, if asked to stop.
    """

    def __init__(
        self, space: str, arguments: RosArguments = NO_ARGUMENTS, should_stop: Callable[[], bool] = lambda: False
    ) -> None:
        self._space, self._should_stop = space, should_stop
        self._context = joined_context(arguments)
        quiet = [Parameter("start_type_description_service", value=False)]
        self._node = Node(
            arguments.name_of(f"ctl_{os.getpid()}", main=True),
            context=self._context,
            enable_rosout=False,
            start_parameter_services=False,
            parameter_overrides=quiet,
        )
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)
        self._clients: dict[str, Any] = {}

    def __enter__(self) -> RackClient:
        return self

    def __exit__(self, *_: object) -> None:
        self._executor.shutdown()
        self._node.destroy_node()
        self._context.try_shutdown()

    def find(self, wait_ns: int, alone_ns: int = 0) -> None:
        """Wait until the rack and its operator are seen, and no other rack of its name for ``alone_ns`` from then on.

        Raises:
            NotOperable: no such rack within the time, one without an operator, or several of the name.
        """
        deadline = time.monotonic_ns() + wait_ns
        seen: int | None = None
        met: int | None = None
        while True:
            now = time.monotonic_ns()
            racks, operators = self._racks(), self._nodes(_OPERATOR)
            # Node names arrive in a separate message, on a busy host long after the topics.
            if seen is None and racks and self._nodes(_MEMORY_NODE):
                seen = now
            self.refuse_several(max(racks, operators))
            if operators:
                met = met or now
                if now - met >= alone_ns:
                    return
            elif (seen is not None and now - seen > _SETTLED_NS) or (racks and now > deadline):
                hint = "say `operator: true` in its YAML file and start it again"
                raise NotOperable(f"rack {self._space} has no operator's services", hint)
            elif now > deadline:
                raise self._absent(wait_ns)
            self._go_on()
            time.sleep(_LOOK_S)

    def refuse_twins(self, node: str) -> None:
        """Check for ``ALONE_NS`` that a node of the rack, which may have no operator, exists only once.

        Raises:
            NotOperable: there are several racks of the name.
        """
        until = time.monotonic_ns() + ALONE_NS
        while True:
            self.refuse_several(max(self._racks(), self._nodes(node)))
            if time.monotonic_ns() > until:
                return
            self._go_on()
            time.sleep(_LOOK_S)

    @property
    def has_operator(self) -> bool:
        """Whether the rack's operator is seen."""
        return self._nodes(_OPERATOR) > 0

    def refuse_several(self, racks: int) -> None:
        """Check that at most one rack of the name is known.

        Raises:
            NotOperable: there are several.
        """
        if racks > 1:
            hint = "stop one of them, or give one another ROS_DOMAIN_ID"
            raise NotOperable(f"{racks} racks are called {self._space}", hint)

    def call(self, kind: Any, name: str, request: Any, wait_ns: int) -> Any:
        """Call a service of the rack and return its response.

        Raises:
            NotOperable: no response within the time, or an unreadable one.
        """
        asking = self._clients.get(name)
        if asking is None:
            asking = self._clients[name] = self._node.create_client(kind, f"{self._space}/{name}")
        deadline = time.monotonic_ns() + wait_ns
        while not asking.service_is_ready():
            self._spin(deadline, name)
        future = asking.call_async(request)
        while not future.done():
            self._spin(deadline, name)
        return future.result()

    def ask(self, verb: str, fields: Mapping[str, Any], wait_ns: int) -> dict[str, Any]:
        """Send a request of ``VERBS`` with the fields of its type; return the fields of the answer, as plain data.

        Raises:
            NotOperable: as ``call``.
        """
        package, _, kind = VERBS[verb].type_name.partition("/")
        service = message_class(f"{package}/srv/{kind}")
        return plain_fields(self.call(service, verb, service.Request(**fields), wait_ns))

    def _go_on(self) -> None:
        if self._should_stop():
            raise Interrupted

    def _spin(self, deadline: int, name: str) -> None:
        self._go_on()
        if time.monotonic_ns() > deadline:
            hint = "it may be busy or gone; --timeout waits longer. The request may still be executed"
            raise NotOperable(f"rack {self._space} does not answer on {name}", hint)
        try:
            self._executor.spin_once(timeout_sec=_LOOK_S)
        except Exception as error:  # rclpy raises different ones for malformed bytes
            if not self._context.ok():
                raise
            hint = "look who else serves its operator's services in this ROS domain"
            raise NotOperable(f"what rack {self._space} answers on {name} cannot be read", hint) from error

    def _racks(self) -> int:
        return len(racks_of(self._node, self._space))

    def _nodes(self, name: str) -> int:
        """Return how many nodes of this name the rack has."""
        count: int = self._node.get_node_names_and_namespaces().count((name, self._space))
        return count

    def _absent(self, wait_ns: int) -> NotOperable:
        tables = [name for name, types in self._node.get_topic_names_and_types() if _TABLE_TYPE in types]
        there = sorted(name.removesuffix("/variables") for name in tables if self._node.count_publishers(name))
        hint = f"there are {', '.join(there)}" if there else "start it first, or set its ROS_DOMAIN_ID"
        return NotOperable(f"no rack {self._space} is seen within {wait_ns / NS_PER_S:g} s", hint)


def plain_fields(message: Any) -> dict[str, Any]:
    """Return the fields of a message of rclpy, sequences as lists, messages in them likewise as fields."""
    found = {name: getattr(message, name) for name in message.get_fields_and_field_types()}
    return {name: list(map(_plain, value)) if isinstance(value, _SEQUENCES) else value for name, value in found.items()}


def _plain(value: Any) -> Any:
    return plain_fields(value) if hasattr(value, "get_fields_and_field_types") else value


_SEQUENCES = (list, tuple, array)
