"""Subscriptions to the bus: read by the message intake, with a length limit and the sender's participant."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from rclpy.qos import QoSProfile

from automax_ros.messages.cdr.cdr import CdrError, decode
from automax_ros.ros.base.node import ModuleNode
from automax_ros.ros.base.qos import message_class
from automax_ros.ros.intake.rcl import TakenMessage, TopicReader

PARTICIPANT_BYTES = 12
"""Length of the part of a GID that all publishers of one process share."""
Receive = Callable[[Any, bytes], None]
"""Called between two scans with a decoded message and its sender's participant, b"" if unknown."""


@dataclass(frozen=True)
class Terms:
    """How a topic of the bus is read.

    ``most_bytes``: longer messages are refused. ``share``: most messages per round of the intake, 0 for the common
    limit. ``then`` is called with each message after it was received, without the rack's lock: scans may come first.
    """

    most_bytes: int
    share: int = 0
    then: Callable[[Any], None] | None = None


class BusTopic:
    """One topic of the bus. ``refuse`` is called for messages that are malformed or too long."""

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
        subscription = node.own_subscription(message_class(type_name), topic, qos)
        self._topic, self._type_name, self._then = topic, type_name, terms.then
        self._receive, self._refuse = node.guarded_callback(topic, receive), refuse
        reader = TopicReader(subscription, terms.most_bytes, self._take)
        self.name, self.take = reader.name, reader.take
        node.rack_context.intake.add(reader, share=terms.share)

    def _take(self, taken: TakenMessage) -> None:
        if taken.payload is None:
            self._refuse(self._topic, f"a message of {taken.size:,} bytes")
            return
        try:
            message = decode(self._type_name, taken.payload)
        except CdrError as error:
            self._refuse(self._topic, str(error))
        else:
            self._receive(message, taken.sender[:PARTICIPANT_BYTES])
            if self._then is not None:
                self._then(message)
