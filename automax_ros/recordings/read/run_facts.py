"""Facts of a recorded run that are needed to read its messages, wherever in the recording they are."""

from __future__ import annotations

from dataclasses import dataclass

from automax_ros.messages.types.messages import CommonWrite, String, VariableTable
from automax_ros.messages.types.rack_files import RackFile, RackFilesError, files_from_text
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.recordings.read.reader import BagReader

_TABLE, _WRITE = "automax_msgs/msg/VariableTable", "automax_msgs/msg/CommonWrite"
_TABLE_TOPIC = "/variables"
_HINT = "record the topics /<rack>/variables, /<rack>/backplane and /<rack>/backplane/snapshot"


@dataclass(frozen=True)
class RunFacts:
    """The first table of variables and the rack's namespace (with its slash); times of the run count from its stamp.

    ``first_write`` is the number of the first write of the run that another program's recorder received: an image
    older than the write before it does not show the memory at that time. 0 for recordings of ours: their image is not
    older.
    """

    table: VariableTable
    space: str
    first_write: int = 0


def run_facts(bag: BagReader) -> RunFacts:
    """Find the facts of a run in a recording.

    Raises:
        BagError: there is no table of variables, or the recording cannot be read as far as that.
    """
    reader = bag.again()
    found: RunFacts | None = None
    writes: dict[int, int] = {}
    for entry in reader.messages(types=frozenset({_TABLE} if reader.is_ours else {_TABLE, _WRITE})):
        message = entry.message
        if isinstance(message, VariableTable):
            if found is None:
                found = RunFacts(message, entry.topic.removesuffix(_TABLE_TOPIC))
        elif isinstance(message, CommonWrite) and len(writes) < _MOST_RUNS:
            writes.setdefault(message.run_id, message.sequence)
        if found is not None and (reader.is_ours or found.table.run_id in writes):
            return RunFacts(found.table, found.space, writes.get(found.table.run_id, 0))
    if found is None:
        raise BagError(_NO_TABLE, bag.path, "has no common memory: no table of variables (topic .../variables)", _HINT)
    return found


def sent_files(bag: BagReader) -> list[RackFile]:
    """Return the rack's file and its tasks' sources as the rack itself sent them, nothing if it did not.

    After a reload they are sent again: then a name has several texts, in this order.

    Raises:
        BagError: the message is not one that a rack sends, or the recording cannot be read as far as that.
    """
    try:
        space = run_facts(bag).space
    except BagError as error:
        if error.code == _NO_TABLE:
            return []
        raise
    files: dict[RackFile, None] = {}
    for entry in bag.again().messages(topics={f"{space}/config"}, types=frozenset({_STRING})):
        assert isinstance(entry.message, String)
        try:
            files.update(dict.fromkeys(files_from_text(entry.message.data)))
        except RackFilesError as error:
            raise BagError("AMX6813", bag.path, f"{entry.topic} is not what a rack sends: {error}") from error
        if len(files) > _MOST_FILES:
            break
    return list(files)


_NO_TABLE = "AMX6820"
_STRING = "std_msgs/msg/String"
_MOST_FILES = 1000
"""Most files that are read from the messages of a recording."""
_MOST_RUNS = 1000
"""Most runs whose first write is remembered until the table identifies the run."""
