"""The node ``network_SLOT``: a network module 57C404, whose cable is a topic.

Publishes: ``/dcsnet/NETWORK`` (automax_msgs/NetworkDrop), one message for each drop that the module sends, once per
cycle of 5.5 ms; ``/diagnostics`` (diagnostic_msgs/DiagnosticArray) once per second, and immediately when a drop is lost
or received again, or another module uses its drops.

Subscribes: ``/dcsnet/NETWORK``. Messages are taken as bytes by ``MessageIntake``, which discards unread those longer
than any of a station; the last ``MOST_WAITING`` wait for the next cycle, are decoded then, and passed to the module
between two scans.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence

from diagnostic_msgs.msg import DiagnosticStatus

from automax_ros.messages.cdr.cdr import MAX_TRAILING, CdrError, decode, encode
from automax_ros.messages.types.messages import NetworkDrop
from automax_ros.messages.types.topics import NETWORK, Topic
from automax_ros.rack.modules.module import Module
from automax_ros.rack.modules.network import CYCLE_NS, NetworkModule
from automax_ros.rack.modules.network_drops import DropMessage, NetworkStatus, Sender
from automax_ros.rackfile.model.ros_names import network_topic
from automax_ros.rackfile.modules.network import HALF
from automax_ros.rackfile.reading.names import is_rack_name
from automax_ros.ros.base.node import ModuleNode, RackContext
from automax_ros.ros.base.qos import message_class, ros_qos
from automax_ros.ros.intake.guard import Throttle
from automax_ros.ros.intake.rcl import TopicReader
from automax_ros.runtime.time.scheduler import EventClass, EventKey

LOG_INTERVAL_S = 0.2
"""Changes on the network are logged at most this often."""
TYPE = "automax_msgs/msg/NetworkDrop"
MOST_WAITING = NETWORK.depth
"""Most messages that wait for the next cycle; of more the oldest are discarded, as DDS would do."""
MOST_BYTES = len(encode(NetworkDrop(0, 0, "R" * 8, 0, 0, 0, False, 0, 0, (0,) * HALF))) + MAX_TRAILING
"""Length of the longest message that a station sends, with the bytes that a DDS may append."""


class NetworkNode(ModuleNode):
    """Serves one network module."""

    def __init__(self, rack_context: RackContext, module: Module) -> None:
        super().__init__(rack_context, module.config.name)
        assert isinstance(module, NetworkModule)
        self._module, self._slot, self._model = module, module.config.slot, module.config.model
        name = network_topic(rack_context.rack.config.namespace, module.network)
        self._waiting: deque[bytes] = deque(maxlen=MOST_WAITING)
        self._logged: tuple[object, ...] = ("", (), ())
        self._throttle = Throttle(LOG_INTERVAL_S)
        self._publish = self.outlet(Topic(name, TYPE, NETWORK, self._slot))
        subscription = self.own_subscription(message_class(TYPE), name, ros_qos(NETWORK))
        # Messages wait for the next cycle; b"" replaces one that is too long.
        rack_context.intake.add(
            TopicReader(subscription, MOST_BYTES, lambda taken: self._waiting.append(taken.payload or b""))
        )
        module.connect(self._send)
        scheduler, key = rack_context.rack.scheduler, EventKey(EventClass.IO, self._slot, "arrivals")
        scheduler.every(CYCLE_NS, scheduler.now_ns, key, lambda *_: self._check())
        self.diagnose(self._health)

    def _send(self, now_ns: int, frames: Sequence[DropMessage]) -> None:
        stream, rack = self.rack_context.stream, self.rack_context.rack.config.name
        stamp = stream.stamp(now_ns)
        for item in frames:
            message = NetworkDrop(
                stamp,
                stream.run_id,
                rack,
                self._slot,
                item.station,
                item.depth,
                item.defined,
                item.sequence,
                item.drop,
                item.words,
            )
            self._publish(stamp, encode(message))

    def _check(self) -> None:
        waiting = [self._waiting.popleft() for _ in range(len(self._waiting))]
        if waiting:
            arrived = [_read(payload) for payload in waiting]
            own = (self.rack_context.stream.run_id, self._slot)
            known = [item for item in arrived if item is not None and (item[0].run_id, item[0].slot) != own]
            self._module.receive(known, damaged=arrived.count(None))
        status = self._module.status()
        shown = (status.code, status.lost, status.rivals)
        if shown != self._logged and self._throttle.passes():
            self._logged = shown
            self._log_status(status)
            self.rack_context.diagnostics.look()

    def _log_status(self, status: NetworkStatus) -> None:
        network, log = self._module.network, self.get_logger()
        if status.rivals:
            who = ", ".join(map(str, status.rivals))
            text = f"network {network}: drops of another module are used by {who}: give each module drops of its own"
            self.rack_context.health.note("two modules with one drop", network, lambda: text)
            log.error(text)
        if status.lost:
            log.warning(f"network {network}: {_sentence(status)}")
        elif not status.rivals:
            log.info(f"network {network}: {_sentence(status)}")

    def _health(self, _: int) -> list[DiagnosticStatus]:
        """Return the module's health: ERROR where two modules have one drop, WARN with the code C, else OK."""
        status = self._module.status()
        level = DiagnosticStatus.WARN if status.code else DiagnosticStatus.OK
        text = _sentence(status)
        if status.rivals:
            level = DiagnosticStatus.ERROR
            text = f"drops of another module are used by {', '.join(map(str, status.rivals))}; {text}"
        values = {
            "network": self._module.network,
            "drop": str(status.drop),
            "depth": str(status.depth),
            "depth_defined": str(status.defined).lower(),
            "heard": _list_text(status.heard),
            "lost": _list_text(status.lost),
            "code": status.code,
            **{name: str(count) for name, count in status.counters},
        }
        return [self.status(self._model, level, text, self._slot, values)]


def _read(payload: bytes) -> tuple[Sender, DropMessage] | None:
    """Return sender and content of a message; None if it is malformed."""
    try:
        found = decode(TYPE, payload)
    except CdrError:
        return None
    assert isinstance(found, NetworkDrop)
    rack = found.rack if is_rack_name(found.rack) else ""
    words = tuple(found.registers)
    frame = DropMessage(found.station, found.depth, found.defined, found.drop, found.sequence, words)
    return Sender(found.run_id, found.slot, rack), frame


def _sentence(status: NetworkStatus) -> str:
    if status.lost:
        return f"code {status.code}: nothing comes from drops {_list_text(status.lost)}"
    return f"receives from drops {_list_text(status.heard)}" if status.heard else "receives from no drop yet"


def _list_text(drops: Sequence[int]) -> str:
    return ", ".join(map(str, drops))
