"""Parameters at the start of a rack: tunables get the values of the command line; unused ones are reported.

Order of precedence, lowest first (decision): a source's ``CURRENT=`` < the value kept from the last run <
``--params-file`` and ``-p`` < ``--set`` of the command. They are set as a client would set them, before the rack runs,
so that they are recorded with the states at the start, and kept. If a task refuses one, the rack does not start. A
whole number is accepted for a REAL (decision: ``KP: 1`` is meant, though ROS tells the types apart).

Names of tasks are unique in a rack, so a tunable can also be given to the node ``rack`` (decision: launch
gives parameters to the node that it has named).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace

from automax_ros.core.text import did_you_mean, quoted
from automax_ros.rackfile.model.config import RackConfig
from automax_ros.ros.base.node import MAIN_NODE, SIM_TIME
from automax_ros.ros.nodes.processor import ProcessorNode
from automax_ros.ros.setup.arguments import RosArguments
from automax_ros.ros.setup.parameter_files import GivenParameter, RosArgumentsError

MOST_SHOWN = 10
"""Most unused parameters that are reported one by one."""
_ONE_TIME = "use_sim_time is for a whole rack: give it to all nodes, or to the node rack"
_OWN_OF_ROS = (SIM_TIME, "start_type_description_service", "qos_overrides.")
"""Parameters that rclpy declares, or may."""


def tune_at_start(arguments: RosArguments, namespace: str, nodes: Iterable[ProcessorNode]) -> None:
    """Set tunables to the values of the command line.

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


def without_use(arguments: RosArguments, config: RackConfig, declared: Mapping[str, Iterable[str]]) -> list[str]:
    """Return the messages about parameters that reach no node.

    Args:
        arguments: the command line that gives them.
        config: the rack's configuration.
        declared: the parameters of each node in this process, by its own name; other processes may have more nodes.
    """
    names = {MAIN_NODE, *declared, *(module.name for module in config.modules)}  # other processes' included
    found: dict[tuple[str, str], str] = {}
    for item in arguments.parameters:
        only = replace(arguments, parameters=(item,))
        reached = {name for name in names if only.given_to(name, config.namespace, main=name == MAIN_NODE)}
        if item.name == SIM_TIME and item.value is True and MAIN_NODE not in reached:
            found[item.key, item.name] = f"{item.place}: {_ONE_TIME}"
        if item.name.startswith(_OWN_OF_ROS):
            continue
        if not reached:
            found.setdefault((item.key, ""), _without_node(item, config, names))
        elif not reached - {MAIN_NODE} - set(declared):
            found[item.key, item.name] = _without_name(item, reached, declared)
    texts = [text for text in found.values() if text]
    more = [f"{len(texts) - MOST_SHOWN} more parameters match no node"] if texts[MOST_SHOWN:] else []
    return [*texts[:MOST_SHOWN], *more]


def _without_node(item: GivenParameter, config: RackConfig, names: Iterable[str]) -> str:
    """Return the message about a key that no node has; "" if it may be for another program."""
    space = f"/{config.namespace}/" if item.key.startswith("/") else ""
    known = [f"{space}{name}" for name in sorted(names)]
    hint = did_you_mean(item.key, known)
    if item.is_for_all and hint is None:
        return ""
    return f"{item.place}: the rack has no node {quoted(item.key)}{f': {hint}' if hint else ''}"


def _without_name(item: GivenParameter, reached: set[str], declared: Mapping[str, Iterable[str]]) -> str:
    """Return the message about a name that its nodes do not declare; "" if it may be for another program."""
    having = [node for node, names in declared.items() if item.name in names]
    if reached.intersection(having) or (having and MAIN_NODE in reached):
        return ""
    known = sorted({name for names in declared.values() for name in names})
    hint = f"{having[0]} has it" if having else did_you_mean(item.name, known)
    if item.is_for_all and hint is None:
        return ""
    nodes = ", ".join(sorted(reached)) if not item.is_for_all else "the rack"
    return f"{item.place}: {nodes} has no parameter {quoted(item.name)}{f': {hint}' if hint else ''}"
