"""The first fields of a rack's messages, read from their CDR bytes without decoding the rest.

A recorder of a live rack needs these fields to sort a message in, and stores its bytes unchanged.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, TypeVar

from automax_ros.messages.cdr.cdr import decode, head_reader
from automax_ros.messages.types.messages import JointState, PlantState, RollState, VariableTable, WebState

_Head = TypeVar("_Head", bound="tuple[object, ...]")


class WriteHead(NamedTuple):
    """The head of a CommonWrite or CommonImage: its stamp in ns, its run, its number in the write log."""

    stamp: int
    run_id: int
    sequence: int


class ScanHead(NamedTuple):
    """The head of a Scan: its stamp in ns, its task, its number, and whether it contains the whole latch."""

    stamp: int
    task: str
    scan: int
    full: bool


class StateHead(NamedTuple):
    """The head of a TaskState: its stamp in ns, its task, the number of the last scan that it contains."""

    stamp: int
    task: str
    scan: int


class OperationHead(NamedTuple):
    """The head of an Operation: its stamp in ns, its run."""

    stamp: int
    run_id: int


def table_of(payload: bytes) -> VariableTable:
    """Return a VariableTable.

    Raises:
        CdrError: the bytes are not one.
    """
    table = decode("automax_msgs/msg/VariableTable", payload)
    assert isinstance(table, VariableTable)
    return table


def plant_stamp(type_name: str, payload: bytes) -> int:
    """Return the stamp of a PlantState, RollState, WebState or JointState, ns.

    Raises:
        CdrError: the bytes are not one.
    """
    message = decode(type_name, payload)
    assert isinstance(message, PlantState | RollState | WebState | JointState)
    return message.header.stamp if isinstance(message, JointState) else message.stamp


def _head_of(name: str, head: type[_Head]) -> Callable[[bytes], _Head]:
    """Return a function that reads the head of a message; it raises CdrError if the bytes are not one."""

    def read(payload: bytes) -> _Head:
        found: _Head = head_reader(f"automax_msgs/msg/{name}", head)(payload)
        return found

    return read


state_head = _head_of("TaskState", StateHead)
operation_head = _head_of("Operation", OperationHead)
write_head = _head_of("CommonWrite", WriteHead)
image_head = _head_of("CommonImage", WriteHead)
scan_head = _head_of("Scan", ScanHead)
"""These return the head of a message; they raise CdrError if the bytes are not one, or a task's name in it is not short
ASCII text."""
