"""Who may publish and subscribe to what in a rack's graph: profiles of nodes, in enclaves.

An enclave represents one process in ROS 2 security: its certificate and its permissions. A profile has the full names
that one node needs.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass


@dataclass(frozen=True)
class Profile:
    """The topics and services that a node publishes, subscribes to, serves and calls: full names, in sorted order."""

    namespace: str
    node: str
    publish: tuple[str, ...] = ()
    subscribe: tuple[str, ...] = ()
    reply: tuple[str, ...] = ()
    request: tuple[str, ...] = ()


@dataclass(frozen=True)
class Enclave:
    """The permissions of one process; ``path`` is its argument of ``--ros-args --enclave``."""

    path: str
    profiles: tuple[Profile, ...]

    def names(self, part: str) -> tuple[str, ...]:
        """Return the names of all profiles in one of their parts, such as ``publish``, each once."""
        return tuple(sorted({name for profile in self.profiles for name in getattr(profile, part)}))


LOG, EVENTS = "/rosout", "/parameter_events"


def recorder_of(namespace: str, rack: Iterable[Enclave]) -> Enclave:
    """Return the enclave of observers and recorders, which subscribe to the rack's topics and publish nothing.

    ``namespace`` is the rack's, with its slash. Reading values, plots and layouts need no more than this.
    """
    heard = _said(rack)
    return Enclave(f"{namespace}/recorder", (Profile(namespace, "recorder", subscribe=heard),))


def operator_of(namespace: str, rack: Iterable[Enclave]) -> Enclave:
    """Return the enclave of operators, who subscribe to the rack, publish to ``/set`` topics, call its services."""
    enclaves = tuple(rack)
    inputs = sorted(
        name
        for enclave in enclaves
        for name in enclave.names("subscribe")
        if name.startswith(f"{namespace}/") and name not in _said(enclaves)
    )
    served = sorted({name for enclave in enclaves for name in enclave.names("reply")})
    profile = Profile(
        namespace, "operator_desk", publish=tuple(inputs), subscribe=_said(enclaves), request=tuple(served)
    )
    return Enclave(f"{namespace}/operator_desk", (profile,))


def _said(rack: Iterable[Enclave]) -> tuple[str, ...]:
    return tuple(sorted({name for enclave in rack for name in enclave.names("publish")} - {EVENTS}))
