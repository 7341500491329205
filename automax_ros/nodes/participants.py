"""Who sends what in the graph: publishers told apart by their GID, programs by the part of it that they share.

The first 12 bytes of a GID are the DDS participant's, which is a program's context; the graph and each message tell
them. A program that wants to be taken for another one's participant must send with its GID: against that helps SROS 2
alone (docs/ros.md).
"""

from __future__ import annotations

from rclpy.node import Node

from automax_ros.core.ticks import NS_PER_S

PREFIX_BYTES = 12
ALONE_NS = NS_PER_S
"""A rack that is to be operated must be the only one of its name for so long (decision): programs of a host answer one
that joins at once, but not in the same moment."""
HOME_TOPICS = ("variables", "config", "backplane", "backplane/snapshot", "operations")
"""Whoever publishes all of these below a namespace is the rack of that name, or its process of common memory."""


def participant(gid: bytes) -> bytes:
    """Return what the GIDs of one program have in common; empty where the GID is not known."""
    return gid[:PREFIX_BYTES]


def publishing(node: Node, topic: str) -> set[bytes]:
    """Return the participants that publish a topic."""
    return {participant(bytes(info.endpoint_gid)) for info in node.get_publishers_info_by_topic(topic)}


def racks_of(node: Node, space: str) -> set[bytes]:
    """Return the participants that are a rack with a namespace (with its slash): one, unless two have one name."""
    found: set[bytes] | None = None
    for topic in HOME_TOPICS:
        there = publishing(node, f"{space}/{topic}")
        found = there if found is None else found & there
        if not found:
            return set()
    return found or set()
