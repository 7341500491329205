"""The topics of a running rack, as named in its VariableTable, and the custom data of a live recording."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass

import automax_ros
from automax_ros.core.kinds import Direction
from automax_ros.core.types import DataType
from automax_ros.messages.stream.rack_messages import SCALED_TYPE, topic_type_name, value_type_name
from automax_ros.messages.types.messages import (
    NAMES,
    JointState,
    PlantState,
    RollState,
    Variable,
    VariableTable,
    WebState,
)
from automax_ros.messages.types.rack_files import RACK_FILE, RackFile, fingerprint
from automax_ros.messages.types.topics import LATCHED, OPERATION, PLANT, SCAN, VALUE, QosProfile
from automax_ros.rackfile.model.config import RackConfig, driven_plants
from automax_ros.rackfile.model.ros_names import JOINTS, plant_topic, roll_topic, topic_names, web_topic

MAX_VALUE_TOPICS = 2000
"""Most topics of common variables that a recorder subscribes to (decision: ROS serves no more at the pace of scans)."""

MAX_PLANT_TOPICS = 100
"""Most topics of plants that a recorder subscribes to, and of rolls, and of webs (decision: a rack has far fewer)."""


@dataclass(frozen=True)
class TopicKind:
    """Type and quality of service of a topic."""

    type_name: str
    qos: QosProfile


class LiveTopics:
    """The topics, by name, of the rack with the namespace ``space`` (with its slash, such as ``/pm1``)."""

    def __init__(
        self, space: str, table: VariableTable | None = None, offered: Mapping[str, Collection[str]] | None = None
    ) -> None:
        """Determine the topics; without a table those of common variables are unknown.

        ``offered`` are the types of topics in the ROS graph: the table does not show which variables have a scale, nor
        the plants and webs. ``left_out`` is the number of topics of common variables beyond the limit.
        """
        self.variables = f"{space}/variables"
        self.snapshot = f"{space}/backplane/snapshot"
        self.backplane = f"{space}/backplane"
        self.scans = f"{space}/scans"
        self.states = f"{space}/states"
        self.operations = f"{space}/operations"
        self.config = f"{space}/config"
        found = _values(space, table, offered or {}) if table else {}
        self.values = dict(list(found.items())[:MAX_VALUE_TOPICS])
        self.left_out = len(found) - len(self.values)
        self.plants = _plants(space, offered or {})

    @classmethod
    def expected(cls, space: str, config: RackConfig) -> LiveTopics:
        """Return the topics of a rack that need not run yet, from its file."""
        topics = cls(space)
        names = topic_names(variable.name for variable in config.variables)
        for variable in config.variables:
            type_name = topic_type_name(variable)
            if variable.direction is not Direction.CLOSED and type_name and len(topics.values) < MAX_VALUE_TOPICS:
                topics.values[f"{space}/{names[variable.name]}"] = TopicKind(type_name, VALUE)
        offered = {plant_topic(item.name): NAMES[PlantState] for item in driven_plants(config)}
        offered |= {roll_topic(plant.name): NAMES[RollState] for plant in config.plants if plant.surface is not None}
        offered |= {web_topic(web.name): NAMES[WebState] for web in config.webs}
        offered[JOINTS] = NAMES[JointState]
        topics.plants = _plants(space, {f"{space}/{topic}": [kind] for topic, kind in offered.items()})
        return topics

    @property
    def in_order(self) -> list[str]:
        """Every topic, in the order of subscriptions.

        The rack responds to each new subscriber of the last three: with an image first, then with states and full scans
        that follow it.
        """
        first = [self.variables, self.backplane, *self.values, *self.plants, self.operations]
        return [*first, self.snapshot, self.scans, self.states]

    @property
    def all(self) -> dict[str, TopicKind]:
        """Every topic that is recorded."""
        return {
            self.variables: TopicKind("automax_msgs/msg/VariableTable", LATCHED),
            self.snapshot: TopicKind("automax_msgs/msg/CommonImage", LATCHED),
            self.backplane: TopicKind("automax_msgs/msg/CommonWrite", SCAN),
            self.scans: TopicKind("automax_msgs/msg/Scan", SCAN),
            self.states: TopicKind("automax_msgs/msg/TaskState", SCAN),
            self.operations: TopicKind("automax_msgs/msg/Operation", OPERATION),
            **self.values,
            **self.plants,
        }


def _values(space: str, table: VariableTable, offered: Mapping[str, Collection[str]]) -> dict[str, TopicKind]:
    """Return the topics of common variables, ignoring those outside of the rack's ``common``."""
    found = {}
    for variable in table.variables:
        type_name = _value_type_name(variable)
        if type_name and not variable.dimensions and SCALED_TYPE in offered.get(variable.topic, ()):
            type_name = SCALED_TYPE
        if variable.direction != Direction.CLOSED and type_name and variable.topic.startswith(f"{space}/common/"):
            found[variable.topic] = TopicKind(type_name, VALUE)
    return found


def _plants(space: str, offered: Mapping[str, Collection[str]]) -> dict[str, TopicKind]:
    """Return the topics of plants: states of each, of its roll and of each web; the joint states of all shafts."""
    joint = NAMES[JointState]
    found: dict[str, TopicKind] = {}
    for topic_of, kind in ((plant_topic, PlantState), (roll_topic, RollState), (web_topic, WebState)):
        begin, state = f"{space}/{topic_of('')}", NAMES[kind]
        names = sorted(name for name, types in offered.items() if name.startswith(begin) and state in types)
        found |= {name: TopicKind(state, PLANT) for name in names[:MAX_PLANT_TOPICS]}
    if found and joint in offered.get(f"{space}/{JOINTS}", ()):
        found[f"{space}/{JOINTS}"] = TopicKind(joint, PLANT)
    return found


def _value_type_name(variable: Variable) -> str | None:
    try:
        return value_type_name(DataType.numbered(variable.type), is_array=bool(variable.dimensions))
    except ValueError:  # a table that was not written by a rack
        return None


GAPS_NAMED = 20
"""Number of gaps that the bag lists; it also has the number of all."""


def provenance(
    rack: str,
    files: Sequence[RackFile],
    lacks: Sequence[str],
    replayable_s: float | None,
    gaps: Sequence[str],
    ended: str | None,
) -> dict[str, str]:
    """Return the custom data of the bag; times in s since the start of the run, None if not applicable."""
    data = {"rack": rack, "version": automax_ros.__version__, "recorder": "automax record"}
    if not any("file" in item or "source" in item for item in lacks):
        data["fingerprint"] = f"{fingerprint(files):016x}"
    if lacks:
        data["lacks"] = "; ".join(lacks)
    if replayable_s is not None:
        data["replayable_from_s"] = f"{replayable_s:.6f}"
    if gaps:
        data["gaps"] = f"{len(gaps)}: " + "; ".join(gaps[:GAPS_NAMED])
    if ended is not None:
        data["ended"] = ended
    return data


def lacking(
    files: Sequence[RackFile], tasks: Iterable[str], wrong: Iterable[str], left_out: int, waiting: Iterable[str]
) -> list[str]:
    """Return the parts that a bag lacks for a replay without the repository.

    ``wrong`` are tasks that run another source than the stored one, ``left_out`` counts omitted topics of commons,
    ``waiting`` are tasks that cannot be executed again yet.
    """
    owners = {file.owner for file in files}
    wanted = {RACK_FILE: RACK_FILE, **{task: f"{task}.BLK" for task in tasks}}
    found = [f"the file {name}" for owner, name in wanted.items() if owner not in owners]
    found += [f"the source that task {task} runs (another one is stored)" for task in wrong]
    if left_out:
        found.append(f"the topics of {left_out} common variables beyond the first {MAX_VALUE_TOPICS}")
    return found + [f"a full scan and a state of task {task} to begin with" for task in waiting]
