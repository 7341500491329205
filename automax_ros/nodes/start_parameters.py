"""Parameters with which a rack starts: tunables get the values that the command line gives; what has no use is told.

The order of what counts more (decision): a source's ``CURRENT=`` < the value kept from the last run < ``--params-file``
and ``-p``. They are set as a client would set them, before the rack runs, so that they are recorded with the states at
the start, and kept. One that the task refuses keeps the rack from starting. A whole number is taken for a REAL
(decision: ``KP: 1`` is meant, though ROS tells the types apart).

Names of tasks are unique in a rack, so a tunable reaches its task from the node ``rack`` as well (decision: launch
gives parameters to the node that it has named).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Protocol

from automax_ros.core.text import did_you_mean, quoted
from automax_ros.nodes.guarded_node import MAIN_NODE
from automax_ros.nodes.ros_arguments import RosArguments
from automax_ros.nodes.ros_parameters import GivenParameter, RosArgumentsError
from automax_ros.nodes.tunable_parameters import TunableParameters
from automax_ros.rack.config import RackConfig

MOST_TOLD = 10
"""Most parameters without use that are told one by one."""
_OWN_OF_ROS = ("use_sim_time", "start_type_description_service", "qos_overrides.")
"""Parameters that rclpy declares, or may."""


class Tuned(Protocol):
    """A node whose parameters are tunables."""

    own_name: str
    """Its name in the rack, whatever it is called."""
    tunables: TunableParameters


def tune_at_start(arguments: RosArguments, namespace: str, nodes: Iterable[Tuned]) -> None:
    """Give tunables what the command line says.

    Raises:
        RosArgumentsError: one of them is refused.
    """
    to_rack = arguments.given_to(MAIN_NODE, namespace, main=True)
    for node in nodes:
        given = {**to_rack, **arguments.given_to(node.own_name, namespace)}
        for item in [given[name] for name in node.tunables.names if name in given]:
            reason = node.tunables.begin_with(item.name, item.value)
            if reason:
                raise RosArgumentsError(f"{item.name}: {reason}", place=item.place)


def without_use(
    arguments: RosArguments, config: RackConfig, declared: Mapping[str, Iterable[str]]
) -> list[str]:
    """Return what to tell of parameters that reach nobody.

    Args:
        arguments: what gives them.
        config: of the rack.
        declared: the parameters of each node that is here, by its own name; other processes may have more nodes.
    """
    told = [text for item in _once(arguments.parameters) if (text := _complaint(item, arguments, config, declared))]
    return [*told[:MOST_TOLD], *([f"{len(told) - MOST_TOLD} more parameters reach nobody"] if told[MOST_TOLD:] else [])]


def _once(given: Iterable[GivenParameter]) -> list[GivenParameter]:
    """Return the parameters without those of a key that was there, if it names a node: one complaint a node is enough."""
    found = {(item.key, item.name): item for item in given}
    return list(found.values())


def _complaint(
    item: GivenParameter, arguments: RosArguments, config: RackConfig, declared: Mapping[str, Iterable[str]]
) -> str | None:
    if item.name.startswith(_OWN_OF_ROS):
        return None
    names = {MAIN_NODE, *declared, *(module.name for module in config.modules)}
    reached = {
        name for name in names if item.name in arguments.given_to(name, config.namespace, main=name == MAIN_NODE)
    }
    if not reached:
        return _no_node(item, [f"/{config.namespace}/{name}" for name in sorted(names)])
    known = {name for node in declared for name in declared[node]}
    elsewhere = reached - {MAIN_NODE} - set(declared)
    if item.name in known or elsewhere:
        return None
    hint = did_you_mean(item.name, known)
    if item.is_for_all and hint is None:
        return None  # one file for many programs
    return f"{item.place}: no node has the parameter {quoted(item.name)}{f': {hint}' if hint else ''}"


def _no_node(item: GivenParameter, known: list[str]) -> str | None:
    hint = did_you_mean(item.key, known)
    if item.is_for_all and hint is None:
        return None
    return f"{item.place}: the rack has no node {quoted(item.key)}{f': {hint}' if hint else ''}"
