"""A place in the ROS domain that no killed process has left, for a process that is started again.

Fast DDS numbers the processes of a domain on a host, and takes the lowest number whose UDP port is free: after SIGKILL
that is the number of the dead one. But the others still send to its port in shared memory, for up to 20 s, all of them
find it broken in the same moment, and each repairs it: some send to a segment that nobody reads from then on, so the
new process stays deaf to them. With another number there is nothing to repair.
"""

from __future__ import annotations

import os
import socket
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

_SHARED = Path("/dev/shm")
_PLACES = 120
"""Numbers that a domain has ports for."""
_VARIABLE = "FASTRTPS_DEFAULT_PROFILES_FILE"
_PROFILE = """<?xml version="1.0" encoding="UTF-8"?>
<dds><profiles xmlns="http://www.eprosima.com/XMLSchemas/fastRTPS_Profiles">
<participant profile_name="automax_place" is_default_profile="true">
<rtps><participantID>{place}</participantID></rtps>
</participant></profiles></dds>
"""


def user_port(domain: int, place: int) -> int:
    """Return the port on which a participant takes messages (RTPS 2.2, 9.6.1.1)."""
    return 7411 + 250 * domain + 2 * place


def clean_place(domain: int) -> int | None:
    """Return the lowest number that is free and clean; None where that is the one which Fast DDS takes by itself."""
    free = [place for place in range(_PLACES) if _is_free(user_port(domain, place))]
    clean = next((place for place in free if not _is_left(user_port(domain, place))), None)
    return None if not free or clean == free[0] else clean


@contextmanager
def in_clean_place(domain: int) -> Iterator[None]:
    """Let participants that are made in the block have a clean place; where the environment names profiles, not.

    Fast DDS is told by a file of profiles, which is removed after the block (decision).
    """
    place = None if os.environ.get(_VARIABLE) else clean_place(domain)
    if place is None:
        yield
        return
    handle, name = tempfile.mkstemp(prefix="automax_place_", suffix=".xml")
    try:
        with open(handle, "w", encoding="utf-8") as file:
            file.write(_PROFILE.format(place=place))
        os.environ[_VARIABLE] = name
        yield
    finally:
        os.environ.pop(_VARIABLE, None)
        Path(name).unlink(missing_ok=True)


def _is_free(port: int) -> bool:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.bind(("", port))
        except (OSError, OverflowError):
            return False
    return True


def _is_left(port: int) -> bool:
    """Whether shared memory of a port is there that nobody can be listening to: its UDP port is free."""
    return (_SHARED / f"fastrtps_port{port}").exists()
