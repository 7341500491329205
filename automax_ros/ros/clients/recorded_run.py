"""Binds a recorder to the run that it records: only messages from this run's programs are recorded.

The rack's program is the participant that publishes all topics of a rack (``racks_of``); in a distributed rack, the
other processes are those whose presence on the bus names the same run. Messages of other programs on the rack's topics
are discarded, counted and reported once per topic. Where the middleware does not identify senders (rcl is not found)
all messages pass, and the user is told.

Publishers are distinguished by their GID. Its first 12 bytes identify the DDS participant, which is a program's
context; the graph and each message contain them. A program can only pass for another one's participant by sending
with its GID; only SROS 2 prevents that (docs/ros.md).
"""

from __future__ import annotations

import time
from collections import Counter
from dataclasses import dataclass, field

from rclpy.node import Node

from automax_ros.core.ticks import NS_PER_S
from automax_ros.ros.intake.rcl import TakenMessage, library

PREFIX_BYTES = 12
ALONE_NS = NS_PER_S
"""A rack to be operated must be the only one of its name for this long (decision): programs of a host answer a new one
at once, but not in the same moment."""
HOME_TOPICS = ("variables", "config", "backplane", "backplane/snapshot", "operations")
"""The participant that publishes all of these in a namespace is the rack, or its process with common memory."""


SILENT_NS = 3 * NS_PER_S
"""If a rack is silent this long while another of its name publishes its variable table, it was restarted (decision: one
that was killed stands in the graph for up to 20 s)."""
LOOK_NS = NS_PER_S // 4
GRACE_NS = NS_PER_S
"""Messages of a process of the rack may arrive this long before its presence."""
MOST_TABLES = 16
"""Most tables of other programs that are kept."""
MOST_PROCESSES = 64
"""Most processes of one rack."""


def participant(gid: bytes) -> bytes:
    """Return the part of a GID that all publishers of one program share; empty if the GID is unknown."""
    return gid[:PREFIX_BYTES]


def publishing(node: Node, topic: str) -> set[bytes]:
    """Return the participants that publish a topic."""
    return {participant(bytes(info.endpoint_gid)) for info in node.get_publishers_info_by_topic(topic)}


def racks_of(node: Node, space: str) -> set[bytes]:
    """Return the participants that are a rack of a namespace (with its slash): one, unless two have the same name."""
    found: set[bytes] | None = None
    for topic in HOME_TOPICS:
        there = publishing(node, f"{space}/{topic}")
        found = there if found is None else found & there
        if not found:
            return set()
    return found or set()


@dataclass
class UnknownPublisher:
    """A program not known to be the rack's: when it was first seen (ns), and its number of messages per topic."""

    since_ns: int
    sent: Counter[str] = field(default_factory=Counter)


class RecordedRun:
    """The programs of one run of one rack."""

    def __init__(self, node: Node, space: str) -> None:
        self._node, self._space = node, space
        self._main_participant = b""
        self._others: set[bytes] = set()
        self._last_ns = self._next_ns = 0
        self._has_rival = False
        self._tables: dict[bytes, TakenMessage] = {}
        self._unknown: dict[bytes, UnknownPublisher] = {}
        self._reported: set[str] = set()
        self.news: list[str] = []
        self.knows_senders = library() is not None

    def racks(self) -> set[bytes]:
        """Return the participants that are racks of this name."""
        return racks_of(self._node, self._space)

    def bind(self, sender: bytes) -> None:
        """Bind to the program that published a rack's table."""
        self._main_participant, self._others, self._last_ns = participant(sender), set(), time.monotonic_ns()

    def admit(self, sender: bytes) -> None:
        """Accept another process of the same run."""
        if len(self._others) < MOST_PROCESSES:
            self._others.add(participant(sender))
            self._unknown.pop(participant(sender), None)

    @property
    def is_there(self) -> bool:
        """Whether the rack's program is in the graph. Another rack of its name is reported once."""
        racks = self.racks()
        if self._main_participant in racks and len(racks) > 1 and not self._has_rival:
            self._has_rival = True
            self.news.append(f"another rack is called {self._space} too: it is not recorded")
        return not self.knows_senders or self._main_participant in racks

    def is_ours(self, topic: str, taken: TakenMessage) -> bool:
        """Return whether a message comes from the rack; those of other programs are counted for ``look``."""
        if not self.knows_senders:
            return True
        sender = participant(taken.sender)
        if sender == self._main_participant or sender in self._others:
            self._last_ns = time.monotonic_ns()
            return True
        if sender not in self._unknown and len(self._unknown) >= MOST_PROCESSES:
            sender = b""
        self._unknown.setdefault(sender, UnknownPublisher(time.monotonic_ns())).sent[topic] += 1
        return False

    @property
    def refused(self) -> int:
        """Number of messages of other programs that were discarded."""
        return sum(publisher.sent.total() for publisher in self._unknown.values())

    def look(self) -> None:
        """Report programs that publish on the rack's topics but are not processes of the rack."""
        now = time.monotonic_ns()
        for publisher in self._unknown.values():
            if now - publisher.since_ns > GRACE_NS:
                for topic in publisher.sent.keys() - self._reported:
                    self._reported.add(topic)
                    self.news.append(
                        f"left out what another program publishes on {topic}: it is not of the recorded rack"
                    )

    def keep(self, table: TakenMessage) -> None:
        """Keep the table of another program: it may be that of the rack's next run."""
        self._tables[participant(table.sender)] = table
        if len(self._tables) > MOST_TABLES:
            racks = self.racks()
            self._tables = {sender: kept for sender, kept in self._tables.items() if sender in racks}

    def successor(self) -> TakenMessage | None:
        """Return the table of the rack's next run, once the present one has left the graph or is silent."""
        now = time.monotonic_ns()
        if not self._tables or now < self._next_ns:
            return None
        self._next_ns = now + LOOK_NS
        racks = self.racks()
        if self._main_participant in racks and now - self._last_ns < SILENT_NS:
            return None
        found = next((sender for sender in self._tables if sender in racks), None)
        return None if found is None else self._tables.pop(found)
