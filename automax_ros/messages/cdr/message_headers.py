"""The first fields of a rack's messages, read from their CDR bytes without decoding the rest.

A recorder of a live rack needs these fields to sort a message in, and stores its bytes unchanged.
"""

from __future__ import annotations

from typing import NamedTuple

from automax_ros.messages.cdr.cdr import decode, head_reader
from automax_ros.messages.types.messages import JointState, PlantState, VariableTable


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
    """Return the stamp of a PlantState or of a JointState, ns.

    Raises:
        CdrError: the bytes are not one.
    """
    message = decode(type_name, payload)
    assert isinstance(message, PlantState | JointState)
    return message.stamp if isinstance(message, PlantState) else message.header.stamp


def state_head(payload: bytes) -> StateHead:
    """Return the head of a TaskState.

    Raises:
        CdrError: the bytes are not one, or the task's name is not short ASCII text.
    """
    head: StateHead = head_reader("automax_msgs/msg/TaskState", StateHead)(payload)
    return head


def operation_head(payload: bytes) -> OperationHead:
    """Return the head of an Operation.

    Raises:
        CdrError: the bytes are not one.
    """
    head: OperationHead = head_reader("automax_msgs/msg/Operation", OperationHead)(payload)
    return head


def write_head(payload: bytes) -> WriteHead:
    """Return the head of a CommonWrite.

    Raises:
        CdrError: the bytes are not one.
    """
    head: WriteHead = head_reader("automax_msgs/msg/CommonWrite", WriteHead)(payload)
    return head


def image_head(payload: bytes) -> WriteHead:
    """Return the head of a CommonImage.

    Raises:
        CdrError: the bytes are not one.
    """
    head: WriteHead = head_reader("automax_msgs/msg/CommonImage", WriteHead)(payload)
    return head


def scan_head(payload: bytes) -> ScanHead:
    """Return the head of a Scan.

    Raises:
        CdrError: the bytes are not one, or the task's name is not short ASCII text.
    """
    head: ScanHead = head_reader("automax_msgs/msg/Scan", ScanHead)(payload)
    return head
