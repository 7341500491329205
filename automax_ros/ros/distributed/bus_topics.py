"""How a message of the bus comes in: through the rack's door, judged by its length and its sender's participant."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from rclpy.qos import QoSProfile

from automax_ros.messages.cdr.cdr import CdrError, decode
from automax_ros.ros.base.node import ModuleNode
from automax_ros.ros.base.qos import message_class
from automax_ros.ros.intake.raw_messages import taker_of
from automax_ros.ros.intake.rcl import library

PARTICIPANT_BYTES = 12
"""The part of a publisher's GID that all of one process share."""
Receive = Callable[[Any, bytes], None]
"""Gets a decoded message and its sender's participant, b"" where that is not known; in the rack's present."""


@dataclass(frozen=True)
class Terms:
    """How a topic of the bus is taken.

    ``most_bytes``: longer messages are refused. ``share``: most in a round of the door, 0 for what any topic has.
    ``then`` gets each message after it was received, outside the rack: scans may come before.
    """

    most_bytes: int
    share: int = 0
    then: Callable[[Any], None] | None = None


class BusTopic:
    """One topic of the bus. ``refuse`` is told what is not a message of it, or too long."""

    def __init__(
        self,
        node: ModuleNode,
        topic: str,
        type_name: str,
        qos: QoSProfile,
        receive: Receive,
        refuse: Callable[[str, str], None],
        terms: Terms,
    ) -> None:
        """Subscribe, and be served at the rack's door."""
        subscription = node.own_subscription(message_class(type_name), topic, qos)
        self.name, self.handle = subscription.topic_name, subscription.handle
        self._topic, self._type_name, self._then = topic, type_name, terms.then
        self._receive, self._refuse = node.guarded_callback(topic, receive), refuse
        self._taker = taker_of(subscription, terms.most_bytes)
        node.site.door.add(self, share=terms.share)

    def take(self) -> bool:
        """Take the next message; False where there is none."""
        taken = self._taker.take()
        if taken is None:
            return False
        if taken.payload is None:
            self._refuse(self._topic, f"a message of {taken.size:,} bytes")
            return True
        try:
            message = decode(self._type_name, taken.payload)
        except CdrError as error:
            self._refuse(self._topic, str(error))
        else:
            self._receive(message, taken.sender[:PARTICIPANT_BYTES])
            if self._then is not None:
                self._then(message)
        return True

    def wake(self, pointer: int, callback: Any, data: int | None) -> int:
        """Let rcl call a function for each message."""
        rcl = library()
        assert rcl is not None
        return int(rcl.on_message(pointer, callback, data))
