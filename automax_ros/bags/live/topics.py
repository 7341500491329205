"""The topics of a running rack, as its VariableTable names them."""

from __future__ import annotations

from dataclasses import dataclass

from automax_ros.wire.messages import Direction, Variable, VariableTable, VariableType
from automax_ros.wire.qos import LATCHED, SCAN, VALUE, QosProfile

_SCALARS = {
    VariableType.INTEGER: "Int16",
    VariableType.DOUBLE_INTEGER: "Int32",
    VariableType.REAL: "Float32",
    VariableType.BOOLEAN: "Bool",
    VariableType.STRING: "String",
}
_ARRAYS = {
    VariableType.INTEGER: "Int16MultiArray",
    VariableType.DOUBLE_INTEGER: "Int32MultiArray",
    VariableType.REAL: "Float32MultiArray",
    VariableType.BOOLEAN: "UInt8MultiArray",
}


MAX_VALUE_TOPICS = 2000
"""Most topics of common variables that a recorder listens to (decision: ROS serves no more at the pace of scans)."""


@dataclass(frozen=True)
class TopicKind:
    """Type and quality of service of a topic."""

    type_name: str
    qos: QosProfile


class LiveTopics:
    """Topics by name, of the rack whose namespace is ``space`` (with its slash, such as ``/pm1``)."""

    def __init__(self, space: str, table: VariableTable | None = None) -> None:
        """Name the topics; without a table those of common variables are not known.

        ``left_out`` are so many topics of common variables beyond the limit.
        """
        self.variables = f"{space}/variables"
        self.snapshot = f"{space}/backplane/snapshot"
        self.backplane = f"{space}/backplane"
        self.scans = f"{space}/scans"
        self.states = f"{space}/states"
        self.config = f"{space}/config"
        found = _values(space, table) if table else {}
        self.values = dict(list(found.items())[:MAX_VALUE_TOPICS])
        self.left_out = len(found) - len(self.values)

    @property
    def all(self) -> dict[str, TopicKind]:
        """Every topic that is recorded."""
        return {
            self.variables: TopicKind("automax_msgs/msg/VariableTable", LATCHED),
            self.snapshot: TopicKind("automax_msgs/msg/CommonImage", LATCHED),
            self.backplane: TopicKind("automax_msgs/msg/CommonWrite", SCAN),
            self.scans: TopicKind("automax_msgs/msg/Scan", SCAN),
            self.states: TopicKind("automax_msgs/msg/TaskState", SCAN),
            **self.values,
        }


def _values(space: str, table: VariableTable) -> dict[str, TopicKind]:
    """The topics of common variables; a topic outside of the rack's ``common`` is none of a rack."""
    found = {}
    for variable in table.variables:
        type_name = value_type_name(variable)
        if variable.direction != Direction.CLOSED and type_name and variable.topic.startswith(f"{space}/common/"):
            found[variable.topic] = TopicKind(type_name, VALUE)
    return found


def value_type_name(variable: Variable) -> str | None:
    """Return the ROS type of a variable's topic, None for arrays of strings, which have none."""
    try:
        kind = VariableType(variable.type)
    except ValueError:
        return None
    name = (_ARRAYS if variable.dimensions else _SCALARS).get(kind)
    return f"std_msgs/msg/{name}" if name else None
