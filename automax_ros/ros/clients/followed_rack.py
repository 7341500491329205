"""What is known of a rack elsewhere from its messages: memory, states of tasks and plants, errors, operations."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from automax_ros.core.names import Element
from automax_ros.core.ticks import NS_PER_S
from automax_ros.core.types import DataType, Value
from automax_ros.core.values import source_text
from automax_ros.drive.web.signals import END_KINDS, WEB_KINDS
from automax_ros.messages.cdr.cdr import CdrError, decode
from automax_ros.messages.types.messages import (
    NAMES,
    CommonImage,
    CommonWrite,
    Operation,
    PlantState,
    RollState,
    Scan,
    TaskState,
    TaskTable,
    VariableTable,
    WebState,
)
from automax_ros.messages.types.rack_files import RackFile
from automax_ros.messages.types.topics import LATCHED
from automax_ros.messages.types.webs_followed import WebsFollowed
from automax_ros.rack.base.observers import Operation as Operated
from automax_ros.rack.operator.rack_log import RackLog
from automax_ros.rackfile.model.config import RackConfig, driven_plants
from automax_ros.rackfile.model.rack_names import LocalName, Meant, SignalName
from automax_ros.recordings.live.topics import LiveTopics, TopicKind
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.recordings.read.run_facts import RunFacts
from automax_ros.replay.scans.commons import RecordedCommons, UnknownValue
from automax_ros.replay.scans.state import recorded_fields

Facts = Mapping[str, Any]
"""Fields of a message or of an answer."""
TASK_TABLE = TopicKind(NAMES[TaskTable], LATCHED)
_DRIVES = frozenset(NAMES[kind] for kind in (PlantState, RollState, WebState))
_MOST_NOTES = 20
_RUNS = ("run", "run_all")


class FollowedRack:
    """One run of a rack elsewhere; ``LiveRecorder`` calls ``take``. ``restarted``: messages of a later run have come.

    ``files`` are those that the rack has sent since, None until it sends them again.
    """

    files_begun = 1
    wants_states = False

    def __init__(self, config: RackConfig, table: VariableTable, topics: LiveTopics, log: RackLog) -> None:
        topics.values.clear()  # the write log has the values of all commons
        topics.plants = {name: kind for name, kind in topics.plants.items() if kind.type_name in _DRIVES}
        self._config, self._table, self._log = config, table, log
        self._kinds = {**topics.all, topics.variables.removesuffix("variables") + "tasks": TASK_TABLE}
        self._place = Path(config.name)
        self._memory = RecordedCommons(self._place, RunFacts(table, f"/{config.namespace}"), config)
        self._views = {variable.name: view for view, variable in enumerate(config.variables)}
        self._plants: dict[str, PlantState] = {}
        self._rolls: dict[str, RollState] = {}
        self._webs: dict[str, WebState] = {}
        self._parting = WebsFollowed(config.plants)
        self._states: dict[str, tuple[int, dict[str, tuple[Value, ...]]]] = {}
        self._scans: dict[str, int] = {}
        self._stop: Operation | None = None
        self._powered, self._noted = True, 0
        self.tasks: list[Facts] = []
        self.notes: list[str] = []
        self.files: Sequence[RackFile] | None = None
        self.wants_image, self.restarted, self.now_ns = True, False, 0

    # Receiver

    def take(self, topic: str, sent_ns: int, payload: bytes) -> None:  # noqa: ARG002
        """Take a message; one that cannot be read is noted."""
        try:
            message: Any = decode(self._kinds[topic].type_name, payload)
            if getattr(message, "run_id", self._table.run_id) != self._table.run_id:
                self.restarted = self.restarted or isinstance(message, VariableTable)
                return
            at_ns = max(0, message.stamp - self._table.stamp)
            self._take(message, at_ns)
            self.now_ns = max(self.now_ns, at_ns)
        except (CdrError, BagError, ValueError) as error:
            self._noted += 1
            if self._noted <= _MOST_NOTES:
                self._log.note(self.now_ns, f"left out a message on {topic}: {error}")

    def store(self, files: Sequence[RackFile]) -> None:
        """Take the rack's files again."""
        self.files = files

    def flush(self, passed_ns: int) -> None:
        """Do nothing: nothing waits."""

    def close(self) -> None:
        """Do nothing: nothing is open."""

    def _take(self, message: Any, at_ns: int) -> None:
        if isinstance(message, (CommonImage, CommonWrite)):
            gaps = self._memory.gaps
            self._memory.take(message)
            self.wants_image = not isinstance(message, CommonImage) and (self.wants_image or self._memory.gaps > gaps)
        elif isinstance(message, Scan):
            self._scans[message.task] = message.scan
            for error in message.errors:
                self._log.error(at_ns, message.task, error.line, error.code, message.scan)
        elif isinstance(message, TaskState):
            self._states[message.task] = message.scan, recorded_fields(self._place, message)
        elif isinstance(message, Operation):
            text = message.reason, message.detail
            self._log.operation(Operated(at_ns, message.what, message.task, message.ok, *text))
            self._follow(message)
        elif isinstance(message, PlantState):
            self._plants[message.plant] = message
        elif isinstance(message, (RollState, WebState)):
            if isinstance(message, RollState):
                self._rolls[message.plant] = message
            else:
                self._webs[message.web] = message
            if told := self._parting.take(message):
                self._log.note(at_ns, told)
        elif isinstance(message, TaskTable):
            self.tasks = [item._asdict() for item in message.tasks]

    def _follow(self, operation: Operation) -> None:
        if operation.ok and operation.what == "stop_all":
            self._stop = operation
        elif operation.ok and operation.what in _RUNS:
            self._stop = None
        elif operation.ok and operation.what in ("power_off", "power_on"):
            self._powered, self._stop = operation.what == "power_on", None

    # What is known

    def value(self, meant: Meant) -> Value | None:
        """Return a value, None if it is not known: a local is known from a state until its task has scanned again."""
        if isinstance(meant, SignalName):
            name, signal = meant.plant, meant.signal
            states = self._webs if signal in WEB_KINDS else self._rolls if signal in END_KINDS else self._plants
            return getattr(states.get(name), signal, None)
        if isinstance(meant, LocalName):
            return self._local(meant)
        return self._common(self._views[meant.name], meant.index)

    def word(self, view: int, register: int) -> int | None:
        """Return a register of a module, None if it is not known."""
        value = self._common(view, register)
        return None if value is None else int(value)

    def forced(self) -> Iterable[tuple[str, str]]:
        """Return the commons that are forced, with their values."""
        for view, index in sorted(self._memory.forced):
            value = self._common(view, index)
            yield (
                Element(self._config.variables[view], index).label,
                "" if value is None else source_text(value),
            )

    def drives(self) -> Iterable[tuple[PlantState, RollState | None]]:
        """Return the last states of the plants that drives turn, and of their rolls, as far as they have been sent."""
        names = [item.name for item in driven_plants(self._config) if item.name in self._plants]
        return [(self._plants[name], self._rolls.get(name)) for name in names]

    def webs(self) -> Iterable[WebState]:
        """Return the last states of the webs, as far as they have been sent."""
        return [self._webs[web.name] for web in self._config.webs if web.name in self._webs]

    def status(self) -> Facts:
        """Return the fields of ReadStatus, as far as messages tell."""
        found: dict[str, Any] = {
            "time_s": self.now_ns / NS_PER_S,
            "powered": self._powered,
            "halted": False,
            "stopped": self._stop is not None,
            "drive_faults": [],
            "display_modules": [],
            "display_codes": [],
            "display_meanings": [],
        }
        if self._stop is not None:
            found |= {
                "stopped_at_s": (self._stop.stamp - self._table.stamp) / NS_PER_S,
                "stopped_code": self._stop.detail,
                "stopped_task": self._stop.task,
                "stopped_reason": self._stop.reason,
            }
        return found

    def _common(self, view: int, index: int) -> Value | None:
        try:
            return self._memory.value((view, index))
        except UnknownValue:
            return None

    def _local(self, meant: LocalName) -> Value | None:
        symbol, index = meant.element.variable, meant.element.index
        scan, fields = self._states.get(meant.task, (-1, {}))
        found = fields.get(symbol.name, ())
        if index >= len(found) or (symbol.tuning is None and self._scans.get(meant.task, scan) > scan):
            return None
        value = found[index]
        if symbol.type is DataType.BOOLEAN:
            return bool(value)
        return int(value) if symbol.type.is_integer else value
