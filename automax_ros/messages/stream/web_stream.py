"""Webs, and the rolls and rollers of plants, as messages, at the instants at which the plants of a rack are sampled.

The node of the drive that turns a plant publishes its roll. Of a web it is that of the end from which it comes, else of
the other end, so far as a drive turns one (decision). What no drive turns is published by common memory's node, or in a
process without it by that of its first drive.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field

from automax_ros.drive.web.end import WebEnd
from automax_ros.drive.web.signals import END_SIGNALS, WEB_SIGNALS, WEB_UNITS
from automax_ros.drive.web.span import WebSpan
from automax_ros.messages.cdr.cdr import encoder
from automax_ros.messages.types.messages import NAMES, RollState, WebState
from automax_ros.messages.types.topics import PLANT, Take, Takes, Topic
from automax_ros.rack.base.part import RackPart
from automax_ros.rack.rack import Rack
from automax_ros.rackfile.model.ros_names import roll_topic, web_topic
from automax_ros.rackfile.model.webs import WebConfig

_ROLL = [*END_SIGNALS.values()]
_WEB = [WEB_SIGNALS[name] for name in WEB_UNITS]


@dataclass
class _Sent:
    """One topic, what makes its messages, and the sinks that take them."""

    topic: Topic
    fields: Callable[[int], tuple[object, ...]]
    takes: list[Take] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.encode = encoder(self.topic.type_name)


class WebStream:
    """Streams rolls, rollers and webs of one rack to sinks. ``stamp`` returns the stamp of an instant of rack time."""

    def __init__(self, rack: Rack, space: str, stamp: Callable[[int], int]) -> None:
        self._rack, self._stamp, plants = rack, stamp, rack.plants
        self._sent: list[_Sent] = []
        for name, end in plants.ends.items():
            topic = Topic(f"{space}/{roll_topic(name)}", NAMES[RollState], PLANT, *_sender(rack.part, name))
            self._sent.append(_Sent(topic, _roll_maker(name, end)))
        for web in rack.part.webs:
            sender = _sender(rack.part, web.start, web.end)
            topic = Topic(f"{space}/{web_topic(web.name)}", NAMES[WebState], PLANT, *sender)
            self._sent.append(_Sent(topic, _web_maker(web, plants.webs[web.name])))

    @property
    def topics(self) -> list[Topic]:
        """All topics: one per roll or roller, one per web; none in a rack without them."""
        return [item.topic for item in self._sent]

    def route(self, takes: Takes) -> None:
        """Send a sink the messages of the topics that it takes."""
        for item in self._sent:
            if item.topic in takes:
                item.takes.append(takes[item.topic])

    def begin(self) -> None:
        """Begin to send what a sink takes."""
        taken = [item for item in self._sent if item.takes]
        if taken:
            self._rack.sampling.observe(lambda now_ns: _send(taken, self._stamp(now_ns)))


def _send(items: Iterable[_Sent], stamp: int) -> None:
    for item in items:
        payload = item.encode(item.fields(stamp))
        for take in item.takes:
            take(stamp, payload)


def _sender(part: RackPart, *plants: str) -> tuple[int | None, str]:
    """Return slot and plant of the drive whose node publishes, None and "" for common memory's node."""
    driven = {item.name: item for item in part.driven}
    found = [driven[name] for name in plants if name in driven]
    if not found and not part.holds_common_memory:
        found = list(part.driven)
    return (found[0].slot, found[0].name) if found else (None, "")


def _roll_maker(name: str, end: WebEnd) -> Callable[[int], tuple[object, ...]]:
    return lambda stamp: (stamp, name, *(signal(end) for signal in _ROLL))


def _web_maker(web: WebConfig, span: WebSpan) -> Callable[[int], tuple[object, ...]]:
    ends, broken = (web.name, web.start, web.end), WEB_SIGNALS["broken"]
    return lambda stamp: (stamp, *ends, *(signal(span) for signal in _WEB), bool(broken(span)))
