"""What nodes publish of a web: its state, and its tension alone for tools that do not know the package's messages.

The tension is not recorded (decision): the state has it.
"""

from __future__ import annotations

from dataclasses import replace

from automax_ros.messages.cdr.cdr import decode, encode
from automax_ros.messages.types.messages import NAMES, Float32, WebState
from automax_ros.messages.types.topics import Take, Topic
from automax_ros.rackfile.model.ros_names import tension_topic
from automax_ros.ros.base.node import ModuleNode


def drive_outlet(node: ModuleNode, topic: Topic) -> Take:
    """Return a function that publishes messages of a topic of plants; for a web it publishes the tension (N), too."""
    publish = node.outlet(topic)
    if topic.type_name != NAMES[WebState]:
        return publish
    tell = node.outlet(replace(topic, name=tension_topic(topic.name), type_name=NAMES[Float32]))

    def send(stamp: int, payload: bytes) -> None:
        publish(stamp, payload)
        state = decode(topic.type_name, payload)
        assert isinstance(state, WebState)
        tell(stamp, encode(Float32(state.tension_n)))

    return send
