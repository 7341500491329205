"""Counts the messages of a recording, or of one of its files, by topic, and finds the span of their times."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass
class TopicCount:
    """A topic: the type and the number of its messages."""

    type_name: str
    messages: int = 0


@dataclass(kw_only=True)
class Tally:
    """How many messages there are, and the span of their stamps and of their log times in ns; 0 without a message."""

    messages: int = 0
    topics: dict[str, TopicCount] = field(default_factory=dict)
    first_stamp: int = 0
    last_stamp: int = 0
    first_log: int = 0
    last_log: int = 0

    def add(self, topic: str, type_name: str, log_time: int, stamp: int) -> None:
        """Count a message."""
        if not self.messages:
            self.first_log = self.last_log = log_time
            self.first_stamp = self.last_stamp = stamp
        self.messages += 1
        if log_time > self.last_log:
            self.last_log = log_time
        elif log_time < self.first_log:
            self.first_log = log_time
        if stamp > self.last_stamp:
            self.last_stamp = stamp
        elif stamp < self.first_stamp:
            self.first_stamp = stamp
        counted = self.topics.get(topic)
        if counted is None:
            counted = self.topics[topic] = TopicCount(type_name)
        counted.messages += 1
