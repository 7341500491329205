"""How far a process speaks in its ROS domain.

ROS itself speaks to the whole subnet, and a rack hands out its sources on ``config``. So the range is this host unless
ROS_AUTOMATIC_DISCOVERY_RANGE, ROS_LOCALHOST_ONLY or ``--range`` says otherwise (decision). Peers of ROS_STATIC_PEERS
are reached in any range but ``off``.
"""

from __future__ import annotations

import os

from automax_ros.nodes.transports import PEERS, RANGE, is_on_loopback

RANGES = ("localhost", "subnet", "off")
"""What can be chosen; ``off`` finds nobody."""
_OLD = "ROS_LOCALHOST_ONLY"
_WORDS = {"LOCALHOST": "this host", "SUBNET": "the whole subnet", "OFF": "nobody"}


def choose_range(chosen: str | None) -> None:
    """Set the range for this process and its children, before rclpy is initialised; None keeps what is set."""
    if chosen is not None:
        os.environ[RANGE] = chosen.upper()
        os.environ.pop(_OLD, None)
    elif not os.environ.get(RANGE) and not os.environ.get(_OLD):
        os.environ[RANGE] = "LOCALHOST"


def is_this_host_alone() -> bool:
    """Return whether this process reaches nobody on other hosts."""
    if is_on_loopback():
        return True
    local = os.environ.get(_OLD) == "1" or os.environ.get(RANGE, "").upper() == "LOCALHOST"
    return local and not os.environ.get(PEERS, "").strip("; ")


def range_text() -> str:
    """Return in words whom this process reaches."""
    name = os.environ.get(RANGE, "").upper()
    if os.environ.get(_OLD) == "1":
        return f"this host ({_OLD})"
    if is_on_loopback():
        return _WORDS["LOCALHOST"]
    text = _WORDS.get(name, "the whole subnet" if not name else f"range {name[:40]}")
    peers = [peer for peer in os.environ.get(PEERS, "").split(";") if peer.strip()]
    if peers and name != "OFF":
        text += f" and {', '.join(peers)[:200]}"
    return text
