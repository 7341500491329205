"""What is wrong with a cluster, as errors that say what to do."""

from __future__ import annotations

from automax_ros.core.faults import Fault
from automax_ros.core.text import printable


class ClusterFault(Fault):
    """Pieces cannot be handed to a cluster: ``place`` is the scheduler's address.

    ``code`` is AMX6851 to AMX6854, AMX6857 or AMX6858.
    """

    def __init__(self, code: str, place: str, message: str, hint: str) -> None:
        super().__init__(printable(message), printable(hint), code=code, place=printable(place))
