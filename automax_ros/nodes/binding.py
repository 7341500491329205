"""Binds a recorder to the run that it records: only what this run's programs send is the rack's.

The rack's program is the participant that publishes all topics of a rack (``racks_of``); where it is cut into
processes, the others are those whose presence on the bus names the same run. What others publish on the rack's topics
is left out, counted and told once for each topic. Where the middleware does not tell senders (rcl is not found) all
pass, and the person is told.
"""

from __future__ import annotations

import time
from collections import Counter

from rclpy.node import Node

from automax_ros.core.ticks import NS_PER_S
from automax_ros.nodes.participants import participant, racks_of
from automax_ros.nodes.rcl import library
from automax_ros.nodes.taking import Taken

SILENT_NS = 3 * NS_PER_S
"""A rack that sends nothing for so long while another of its name sends a table has been started again (decision: one
that was killed stands in the graph for up to 20 s)."""
LOOK_NS = NS_PER_S // 4
MOST_TABLES = 16
"""Most tables of others that are kept."""
MOST_PROCESSES = 64
"""Most processes of one rack."""


class Binding:
    """The programs of one run of one rack."""

    def __init__(self, node: Node, space: str) -> None:
        """Bound to nobody; ``space`` is the rack's namespace with its slash."""
        self._node, self._space = node, space
        self._home = b""
        self._others: set[bytes] = set()
        self._last_ns = self._next_ns = 0
        self._has_rival = False
        self._tables: dict[bytes, Taken] = {}
        self.refused: Counter[str] = Counter()
        self.news: list[str] = []
        self.tells_senders = library() is not None

    def racks(self) -> set[bytes]:
        """Return the participants that are racks of this name."""
        return racks_of(self._node, self._space)

    def bind(self, sender: bytes) -> None:
        """Bind to the program that sent a rack's table."""
        self._home, self._others, self._last_ns = participant(sender), set(), time.monotonic_ns()

    def admit(self, sender: bytes) -> None:
        """Let another process of the same run be one of the rack's."""
        if len(self._others) < MOST_PROCESSES:
            self._others.add(participant(sender))

    @property
    def is_there(self) -> bool:
        """Whether the rack's program is in the graph. Another rack of its name is told once."""
        racks = self.racks()
        if self._home in racks and len(racks) > 1 and not self._has_rival:
            self._has_rival = True
            self.news.append(f"another rack is called {self._space} too: it is not recorded")
        return not self.tells_senders or self._home in racks

    def is_ours(self, topic: str, taken: Taken) -> bool:
        """Return whether a message comes from the rack; one of another's is counted and told."""
        if not self.tells_senders:
            return True
        sender = participant(taken.sender)
        if sender == self._home or sender in self._others:
            self._last_ns = time.monotonic_ns()
            return True
        if not self.refused[topic]:
            self.news.append(f"left out what another program publishes on {topic}: it is not the rack that is recorded")
        self.refused[topic] += 1
        return False

    def keep(self, table: Taken) -> None:
        """Keep a table that is not ours: it may turn out to be that of the rack's next run."""
        self._tables[participant(table.sender)] = table
        if len(self._tables) > MOST_TABLES:
            racks = self.racks()
            self._tables = {sender: kept for sender, kept in self._tables.items() if sender in racks}

    def successor(self) -> Taken | None:
        """Return the table of the rack's next run once there is one: ours has gone, or is silent."""
        now = time.monotonic_ns()
        if not self._tables or now < self._next_ns:
            return None
        self._next_ns = now + LOOK_NS
        racks = self.racks()
        if self._home in racks and now - self._last_ns < SILENT_NS:
            return None
        found = next((sender for sender in self._tables if sender in racks), None)
        return None if found is None else self._tables.pop(found)
