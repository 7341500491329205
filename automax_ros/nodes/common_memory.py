"""The node ``common_memory``: the rack's common variables as topics.

Publishes: ``variables`` (automax_msgs/VariableTable, latched), ``config`` (std_msgs/String, latched: the rack's YAML
file and the tasks' sources as JSON), ``backplane`` (automax_msgs/CommonWrite), ``backplane/snapshot``
(automax_msgs/CommonImage, latched, sent anew to each late joiner of either), ``common/NAME`` (std_msgs, latched) for
each variable with ``ros: out`` or ``ros: in``.

Subscribes: ``common/NAME/set`` (std_msgs, reliable) for each variable with ``ros: in``, and for no other.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rclpy.context import Context
from rclpy.event_handler import QoSPublisherMatchedInfo, SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.publisher import Publisher
from std_msgs.msg import String

from automax_ros.core.kinds import Direction
from automax_ros.core.types import Value
from automax_ros.nodes.throttle import Throttle
from automax_ros.nodes.topics import COMMAND_QOS, incompatible, message_class, publisher, ros_qos
from automax_ros.rack.config import CommonVariable
from automax_ros.rack.rack import Rack
from automax_ros.rack.ros_names import set_topic
from automax_ros.rack.writers import ROS_WRITER
from automax_ros.running.health import Health
from automax_ros.running.views import MemoryValueError
from automax_ros.wire.qos import LATCHED
from automax_ros.wire.rack_files import files_of, files_text
from automax_ros.wire.stream import RackStream, Topic

REFUSAL_INTERVAL_S = 1.0
"""A variable's refused writes are reported at most this often."""


class CommonMemoryNode(Node):  # type: ignore[misc]
    """Serves the topics of common memory; its callbacks run between scans, on the thread that scans."""

    def __init__(
        self,
        rack: Rack,
        stream: RackStream,
        context: Context,
        catch_up: Callable[[], None] = lambda: None,
        health: Health | None = None,
    ) -> None:
        """Create publishers and subscriptions; messages flow once the stream begins.

        ``catch_up`` brings rack time to the present, ``health`` counts what is refused.
        """
        super().__init__("common_memory", namespace=f"/{rack.config.namespace}", context=context)
        self._rack, self._stream, self._catch_up = rack, stream, catch_up
        self._health = health or Health()
        self._publishers_by_name: dict[str, Publisher[Any]] = {}
        for own in stream.topics:
            if own.slot is None:
                joined = own in (stream.snapshot_topic, stream.backplane_topic)
                self._publishers_by_name[own.name] = publisher(self, own, self._health, self._join if joined else None)
        self._config = self.create_publisher(String, "config", ros_qos(LATCHED))
        self._config.publish(String(data=files_text(rack.config.name, files_of(rack))))
        for view, variable in enumerate(rack.config.variables):
            topic = stream.value_topic(view)
            if variable.direction is Direction.IN and topic is not None:
                self._subscribe(view, variable, topic)
        stream.add_sink(self._publish)

    def _publish(self, topic: Topic, _: int, payload: bytes) -> None:
        found = self._publishers_by_name.get(topic.name)
        if found is not None:
            found.publish(payload)

    def _join(self, matched: QoSPublisherMatchedInfo) -> None:
        """Send the image anew to a late joiner: the one that waits for it may be as old as the run."""
        if matched.total_count_change > 0:
            self._catch_up()
            self._stream.send_image()

    def _subscribe(self, view: int, variable: CommonVariable, topic: Topic) -> None:
        name = set_topic(topic.name)
        lost = incompatible(self, f"what a writer of {name} sends is lost", self._health)
        events = SubscriptionEventCallbacks(incompatible_qos=lost)
        kind = message_class(topic.type_name)
        self.create_subscription(kind, name, self._writer(view, variable), COMMAND_QOS, event_callbacks=events)

    def _writer(self, view: int, variable: CommonVariable) -> Callable[[Any], None]:
        """Return the callback that writes a variable."""
        throttle = Throttle(REFUSAL_INTERVAL_S)

        def write(message: Any) -> None:
            self._catch_up()
            try:
                self._rack.write_view(view, _elements(variable, message), ROS_WRITER)
            except MemoryValueError as error:
                refusal = f"write refused: {error}"
                self._health.note("refused write", variable.name, lambda: refusal)
                if throttle.passes():
                    self.get_logger().warning(refusal)

        return write


def _elements(variable: CommonVariable, message: Any) -> list[tuple[int, Value]]:
    """Return what a message writes: (element, value) of the whole variable.

    Raises:
        MemoryValueError: an array message of another length than the variable's.
    """
    if not variable.is_array:
        return [(0, message.data)]
    data = list(message.data)
    if len(data) != variable.elements:
        raise MemoryValueError(f"{variable.name} has {variable.elements} elements, the message has {len(data)}")
    return list(enumerate(data))
