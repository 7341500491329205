"""The discovery range of a process in its ROS domain, and the set-up of Fast DDS.

By default ROS reaches the whole subnet, and a rack publishes its sources on ``config``. So the range is this host
unless ROS_AUTOMATIC_DISCOVERY_RANGE, ROS_LOCALHOST_ONLY or ``--range`` says otherwise (decision). Peers of
ROS_STATIC_PEERS are reached in any range but ``off``.

A program announces itself five times at its start, then each 3 s: two that start at the same time may miss each other
for that long (measured on a quiet host: 2.4 to 3.4 s in half of the tries; 0.4 to 0.8 s with one each 250 ms).

The processes of a distributed rack communicate by UDP, not by shared memory. They may be killed and started again, and
shared memory does not support that: a restarted process gets the port of the killed one, which the others repair at
the same time, each on its own, so that some send to a segment that no process reads; or one waits for ever for a lock
that the killed one held.

UDP drops what arrives while a process is held up and its socket is full: the sockets are as large as the kernel allows,
and writers announce each 100 ms what they have sent, so that missing messages are sent again (measured with seven
processes on two cores: 1 % of the datagrams dropped, and scans of up to 2 s ago seen as the latest, without either).
"""

from __future__ import annotations

import os
from pathlib import Path

RANGE, PEERS = "ROS_AUTOMATIC_DISCOVERY_RANGE", "ROS_STATIC_PEERS"
_PROFILES, _TRANSPORTS, _MIDDLEWARE = (
    "FASTRTPS_DEFAULT_PROFILES_FILE",
    "FASTDDS_BUILTIN_TRANSPORTS",
    "RMW_IMPLEMENTATION",
)
_LOOPBACK, _NETWORK, _SOON = (
    Path(__file__).with_name(name) for name in ("loopback.xml", "network.xml", "announced_soon.xml")
)


RANGES = ("localhost", "subnet", "off")
"""The ranges to choose from; ``off`` reaches no other process."""
_OLD = "ROS_LOCALHOST_ONLY"
_WORDS = {"LOCALHOST": "this host", "SUBNET": "the whole subnet", "OFF": "nobody"}


def announce_soon() -> None:
    """Make this process announce itself each 250 ms; call it before rclpy is initialised (decision).

    Profiles that the environment names and other middleware are left as they are.
    """
    if not os.environ.get(_PROFILES) and _is_fast_dds() and _SOON.is_file():
        os.environ[_PROFILES] = str(_SOON)


def avoid_shared_memory() -> None:
    """Make this process use UDP alone; call it with its range chosen, before rclpy is initialised (decision).

    In the range of one host rmw_fastrtps adds shared memory whatever the profile of Fast DDS says. So the range is set
    to the subnet, and Fast DDS has the loopback alone: no other host is reached. Profiles or transports that the
    environment names take precedence; other middleware, and peers on other hosts, are left as they are.
    """
    chosen = [os.environ.get(name, "") for name in (_PROFILES, _TRANSPORTS)]
    if any(text not in ("", str(_SOON)) for text in chosen) or not _is_fast_dds():
        return
    if os.environ.get("ROS_LOCALHOST_ONLY") == "1":
        return
    if os.environ.get(RANGE, "").upper() != "LOCALHOST":
        os.environ.update({_PROFILES: str(_NETWORK)} if _NETWORK.is_file() else {_TRANSPORTS: "UDPv4"})
    elif not os.environ.get(PEERS) and _LOOPBACK.is_file():
        os.environ.update({RANGE: "SUBNET", PEERS: "127.0.0.1", _PROFILES: str(_LOOPBACK)})


def _is_fast_dds() -> bool:
    return (os.environ.get(_MIDDLEWARE) or "rmw_fastrtps_cpp").startswith("rmw_fastrtps")


def is_on_loopback() -> bool:
    """Whether this process uses the loopback alone, whatever its range says."""
    return os.environ.get(_PROFILES) == str(_LOOPBACK)


def choose_range(chosen: str | None) -> None:
    """Set the range for this process and its children, before rclpy is initialised; None keeps what is set."""
    if chosen is not None:
        os.environ[RANGE] = chosen.upper()
        os.environ.pop(_OLD, None)
    elif not os.environ.get(RANGE) and not os.environ.get(_OLD):
        os.environ[RANGE] = "LOCALHOST"


def is_this_host_alone() -> bool:
    """Return whether this process reaches no other host."""
    if is_on_loopback():
        return True
    local = os.environ.get(_OLD) == "1" or os.environ.get(RANGE, "").upper() == "LOCALHOST"
    return local and not os.environ.get(PEERS, "").strip("; ")


def range_text() -> str:
    """Return in words what this process reaches."""
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
