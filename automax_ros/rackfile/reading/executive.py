"""The version of the AutoMax Programming Executive that a rack was loaded with, and its limits.

Versions are whole numbers of tenths: 42 is 4.2.
"""

from __future__ import annotations

import re

from automax_ros.core.json_schema import number
from automax_ros.core.ticks import DEFAULT_TICK_NS
from automax_ros.core.yaml_text import Node, Scalar
from automax_ros.rackfile.reading.values import Key, ProblemList, wrong_kind

OLDEST, NEWEST = 20, 42
"""The versions that the manuals at hand describe: 2.0 (1.1) to 4.2 (J2-3045)."""
MOST_FORCES, FEWER_FORCES = 64, 16
"""Variables that may be forced at once, whatever the number of users: from 4.0 on, and before (J2-3106-1 p. 18-10)."""
_VERSION = re.compile(r"([0-9])(?:\.([0-9]))?\Z")
_TICK_CHOSEN = 31
"""From 3.1 on a Processor's tick can be chosen; before it was 5.5 ms (4.0)."""
_MORE_FORCES = 40


def _version(node: Node, what: str, findings: ProblemList) -> int | None:
    match = _VERSION.match(node.text) if isinstance(node, Scalar) and node.plain else None
    if match is None:
        wrong_kind(node, what, f"a version such as {version_text(NEWEST)}", findings)
        return None
    version = int(match[1]) * 10 + int(match[2] or 0)
    if not OLDEST <= version <= NEWEST:
        message = f"{what} is {version_text(version)}; it must be {version_text(OLDEST)} to {version_text(NEWEST)}"
        findings.add("AMX6701", message, node.span)
        return None
    return version


EXECUTIVE = Key(
    "executive",
    number("Version of the AutoMax Programming Executive.", OLDEST / 10, NEWEST / 10, NEWEST / 10),
    _version,
)
"""A version such as 3.8."""


def version_text(version: int) -> str:
    """Return a version as text: 42 is 4.2."""
    return f"{version // 10}.{version % 10}"


def most_forces(version: int) -> int:
    """Return how many variables of a rack may be forced at once."""
    return MOST_FORCES if version >= _MORE_FORCES else FEWER_FORCES


def tick_fault(version: int, tick_ns: int) -> str | None:
    """Return the error of a Processor's tick under a version, None if it is possible."""
    if version >= _TICK_CHOSEN or tick_ns == DEFAULT_TICK_NS:
        return None
    return f"with executive {version_text(version)} the tick is 5.5 ms; it can be chosen from 3.1 on"
