"""The check of whether a recording is sound, shared by `bag info --check`, `bag repair` and `replay`.

Readers themselves refuse damaged or malformed messages and those out of order (``BagReader``, ``CommonLog``); here all
messages are read once, and a recording of ours is checked for what a rack's recording must have. Missing writes for
which an image makes up do not make it unsound: a replay continues after them, and they are reported.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from automax_ros.core.kinds import WriterKind
from automax_ros.core.types import Value
from automax_ros.messages.types.definitions import message_types
from automax_ros.messages.types.messages import CommonImage, CommonWrite, Scan, TaskState, VariableTable
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.recordings.read.common_log import CommonLog
from automax_ros.recordings.read.reader import BagReader
from automax_ros.recordings.read.run_facts import run_facts


@dataclass(frozen=True)
class Soundness:
    """The result of checking a whole recording.

    ``fault`` is why it is not sound, None if it is; ``gaps`` lists writes that are missing nevertheless.
    """

    fault: BagError | None = None
    gaps: tuple[str, ...] = ()


def verdict_of(reader: BagReader) -> Soundness:
    """Read all messages of the known types, and return the verdict."""
    log: CommonLog | None = None
    fault: BagError | None = None
    scans = _Scans()
    try:
        for entry in reader.messages(types=frozenset(message_types())):
            message = entry.message
            if isinstance(message, (CommonImage, CommonWrite, VariableTable)):
                log = log or (_StrictLog if reader.is_ours else CommonLog)(reader.path, run_facts(reader))
                if isinstance(message, VariableTable):
                    log.check_table(message)
                else:
                    log.take(message)
            elif isinstance(message, (Scan, TaskState)):
                scans.take(message)
                if isinstance(message, Scan) and isinstance(log, _StrictLog):
                    for values in (message.read, message.written, message.committed):
                        log.reads(values, message.stamp)
        if reader.is_ours:
            require_tasks(reader.path, (log.facts if log else run_facts(reader)).table)
            scans.require(reader.path)
    except BagError as error:
        fault = error
    return Soundness(fault, tuple(log.missing_writes) if log else ())


class _StrictLog(CommonLog):
    """The write log of a recording of ours: a number that a variable cannot have was not written by a rack."""

    def _odd(self, name: str, value: float) -> Value:
        raise ValueError(f"{name} cannot be {value!r}")


class _Scans:
    """Checks whether any scan can be executed again: one that is a task's first, or follows a state of its task."""

    def __init__(self) -> None:
        self._states: dict[str, int] = {}
        self._can_begin = False

    def take(self, message: Scan | TaskState) -> None:
        """Add the next scan or state of a task."""
        if isinstance(message, TaskState):
            self._states[message.task] = message.scan
        elif not message.scan or self._states.get(message.task) == message.scan - 1:
            self._can_begin = True

    def require(self, bag: Path) -> None:
        """Refuse a recording of which no scan can be executed again."""
        if not self._can_begin:
            raise BagError("AMX6832", bag, "no scan of any task can be executed again", "see `automax bag info`")


def require_tasks(bag: Path, table: VariableTable) -> None:
    """Refuse the recording of a rack without tasks: nothing of it can be executed again.

    Raises:
        BagError: the rack has no tasks.
    """
    if not any(writer.kind == WriterKind.TASK for writer in table.writers):
        text = "the recorded rack has no tasks, so no scan can be executed again"
        raise BagError("AMX6832", bag, text, "`automax export` makes a table of its common memory")
