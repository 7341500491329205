"""The result of translating a task to C: its text with data for the host, or the reason why there is none."""

from __future__ import annotations

import ast
from collections.abc import Mapping
from dataclasses import dataclass

NOT_KEPT = "a run this short gains nothing by building it, and no other has (--native on)"
"""Reason why a task runs in Python when it was only looked up in the cache and is not there."""


class NotNative(Exception):
    """A task cannot be native, or not on this machine; it runs in Python, bit for bit the same.

    ``reason`` gives the cause and, where there is one, the remedy; ``line`` is the BASIC line that cannot be
    translated, 0 if the cause is not a line.
    """

    def __init__(self, reason: str, line: int = 0) -> None:
        super().__init__(f"line {line}: {reason}" if line else reason)
        self.reason, self.line = reason, line


@dataclass(frozen=True)
class NativeSource:
    """A task as C.

    Attributes:
        name: the task's name.
        text: the complete C text: it begins with ``abi.h`` and includes only headers of the C library.
        limits: for each field of the layout the least and the greatest integer that the translation assumes; a state
            beyond them, as from a snapshot, scans in Python. () where only 64 bits are assumed.
    """

    name: str
    text: str
    limits: tuple[tuple[int, int], ...] = ()


@dataclass(frozen=True)
class TaskFunction:
    """One of a task's functions as a tree, its statements with their BASIC lines; its callees, and its commons."""

    function: ast.FunctionDef
    known: Mapping[str, object]
    views: Mapping[str, int]
