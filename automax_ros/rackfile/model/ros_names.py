"""The ROS 2 names of a rack and of its variables, plants and networks.

The rack's own names have upper-case letters, digits and underscores only. All additions are in lower case, so they can
never make two names equal:

- the namespace is the rack's name in lower case; one that begins with a digit, which ROS does not allow, gets ``rack_``
  in front (decision: a rack's name has no underscore, so no other looks like it);
- the topic of a variable is its name without the type character: ``common/LINE_SPEED``;
- commons that differ only in type get the type's word: ``common/SPEED_int`` and ``common/SPEED_bool``;
- the topic of a plant is its name: ``plants/UNWIND``; the topic that commands its joint is a controller's:
  ``UNWIND_velocity_controller/commands``; that of its roll or roller is ``rolls/UNWIND``, that of a web ``webs/W1``;
- the topic of a network of racks is ``/dcsnet/PAPER``, next to their namespaces and in none of them (decision);
- a name that begins with an underscore gets ``u`` in front, since ROS tools hide such topics: ``common/u_SPARE``
  (decision). Repeated underscores, which the ROS design page advises against and ROS accepts, stay as they are.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable

from automax_ros.core.types import DataType, bare_name, type_of_name

TYPE_WORDS = {
    DataType.INTEGER: "int",
    DataType.DOUBLE: "dint",
    DataType.REAL: "real",
    DataType.BOOLEAN: "bool",
    DataType.STRING: "string",
}
"""Suffixes of the topics of variables that differ only in type."""


def namespace(rack_name: str) -> str:
    """Return a rack's namespace without the slash: ``LINE1`` is ``line1``, ``2A`` is ``rack_2a``."""
    lower = rack_name.lower()
    return f"rack_{lower}" if lower[:1].isdigit() else lower


def topic_names(names: Iterable[str]) -> dict[str, str]:
    """Return the topic of each variable, relative to the rack's namespace.

    ``names`` are the names of all commons of a rack with their type characters, each once.
    """
    every = list(names)
    shared = Counter(bare_name(name) for name in every)
    found = {}
    for name in every:
        bare = bare_name(name)
        visible = f"u{bare}" if bare.startswith("_") else bare
        found[name] = f"common/{visible}_{TYPE_WORDS[type_of_name(name)]}" if shared[bare] > 1 else f"common/{visible}"
    return found


def set_topic(topic: str) -> str:
    """Return the topic on which a variable with ``ros: in`` is written."""
    return f"{topic}/set"


JOINTS = "joint_states"
"""The topic of the shafts of all plants, relative to the rack's namespace."""


def plant_topic(name: str) -> str:
    """Return the topic of a plant's state, relative to the rack's namespace."""
    return f"plants/{name}"


def roll_topic(plant: str) -> str:
    """Return the topic of the roll or roller of a plant, relative to the rack's namespace."""
    return f"rolls/{plant}"


def web_topic(web: str) -> str:
    """Return the topic of a web's state, relative to the rack's namespace."""
    return f"webs/{web}"


def tension_topic(topic: str) -> str:
    """Return the topic of a web's tension alone, next to that of its state."""
    return f"{topic}/tension"


def roll_joint(joint: str) -> str:
    """Return the name of the joint of a roll or roller by that of its motor's shaft."""
    return f"{joint}_roll"


def load_topic(name: str) -> str:
    """Return the topic on which the load torque of a plant with ``ros: in`` is set."""
    return set_topic(f"{plant_topic(name)}/load_torque")


def command_topic(joint: str, interface: str) -> str:
    """Return the topic that commands a joint, named as a controller of ros2_control names its own (decision)."""
    return f"{joint}_{interface}_controller/commands"


def network_topic(namespace: str, network: str) -> str:
    """Return the full name of a network's topic, its cable: ``/dcsnet/PAPER``.

    It is next to the racks' namespaces and belongs to none: for ``plant/line1`` it is ``/plant/dcsnet/PAPER``.
    """
    outside = namespace.rpartition("/")[0]
    return f"/{outside}/dcsnet/{network}" if outside else f"/dcsnet/{network}"
