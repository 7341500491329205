"""A rack in this process as a source of the panel, on the wall clock or simulated; without ROS."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, suppress
from typing import Any

from automax_ros.core.diagnostics import SourceText
from automax_ros.core.names import Element, NameFault
from automax_ros.core.ticks import NS_PER_S, NS_PER_US
from automax_ros.core.types import Value
from automax_ros.drive.plant.signals import signals_of
from automax_ros.drive.web.signals import END_KINDS, WEB_KINDS, end_signals_of, web_signals_of
from automax_ros.language.program import Program, Symbol
from automax_ros.messages.stream.stream import RackStream
from automax_ros.messages.types.messages import NAMES, PlantState
from automax_ros.panel.present_rack import PresentRack
from automax_ros.panel.rack_status import Answers, RackStatus, drive_facts, web_facts
from automax_ros.panel.source import Asked, Facts, Frame
from automax_ros.rack.base.observers import Operation
from automax_ros.rack.base.stop_cause import OperationRefused
from automax_ros.rack.operator.drive_readings import read_drives
from automax_ros.rack.operator.rack_log import RackLog
from automax_ros.rack.operator.requests import DELETED, VERBS, OperatorRequests
from automax_ros.rack.operator.web_news import WebNews
from automax_ros.rack.rack import Rack
from automax_ros.rackfile.model.rack_names import LocalName, RackNames, SignalName
from automax_ros.runtime.memory.views import WriteGroup
from automax_ros.runtime.tasks.task import ScanRecord, Task

LOAD_NS = NS_PER_S
"""Shortest time on the wall clock for which a load is measured."""
_MOST_READERS = 10_000
_STATE = NAMES[PlantState]
Entrance = Callable[[], AbstractContextManager[None]]
"""Returns a context that holds off scans."""
_Reader = Callable[[], Value | None]


class RackSource(PresentRack):
    """A rack in this process. ``over`` is why its run has ended, empty while it goes on."""

    def __init__(
        self,
        rack: Rack,
        entrance: Entrance,
        *,
        title: str,
        pace: object = None,
        stream: RackStream | None = None,
        measured: bool = False,
        operators: Sequence[str] = (),
    ) -> None:
        """Observe the rack from now on; create it before ``stream`` begins.

        Args:
            rack: the rack.
            entrance: returns a context that holds off scans: the lock of ``RackNodes``, or ``Turns.turn``.
            title: what the page is called.
            pace: what can halt rack time (``Haltable``).
            stream: the rack's messages, for the means of currents; without one momentary values are shown.
            measured: whether execution times are those of this host, from which loads follow.
            operators: who else may operate the rack, in words.
        """
        programs = [task.compiled.program for task in rack.tasks]
        super().__init__(RackNames(rack.config, programs), RackLog(), "rack", title)
        self.over = ""
        self._rack, self._entrance, self._stream, self._measured = rack, entrance, stream, measured
        self._status = RackStatus(rack.config, operators)
        self._readers: dict[str, _Reader] = {}
        self._loads: dict[int, float] = {}
        self._busy: tuple[int, dict[int, int]] = (time.monotonic_ns(), {})
        with entrance():
            self._requests = OperatorRequests(rack, pace)
            if stream is not None and not stream.has_begun:
                stream.plants.route({topic: _nothing for topic in stream.plants.topics if topic.type_name == _STATE})
            rack.observe(self)
            WebNews(rack, self._log.note)

    @property
    def is_over(self) -> bool:
        """Whether the run has ended."""
        return bool(self.over)

    def frames(self, asked: Sequence[Asked]) -> list[Frame]:
        """Return the values for each browser, all of one instant."""
        readers = {name: self._reader(name) for item in asked for name in item.names}
        with self._entrance():
            now_ns, values = self._rack.now_ns, {name: read() for name, read in readers.items()}
        return [Frame(now_ns, tuple(values[name] for name in item.names)) for item in asked]

    def status(self, at_ns: int | None) -> Facts:  # noqa: ARG002
        """Return how the rack stands."""
        with self._entrance():
            rack, requests = self._rack, self._requests
            status = requests.status()
            answers = Answers(
                {**status, "battery_good": rack.operations.battery_good},
                {key: int(rack.memory.read_now(*key)) for key in self._status.registers},
                list(self._tasks()),
                requests.errors("")["errors"],
                requests.forces(),
                list(self._drives(status["drive_faults"])),
                [web_facts(name, web_signals_of(span)) for name, span in rack.plants.webs.items()],
                {
                    name: (item.mean_ns / NS_PER_US, item.longest_ns / NS_PER_US)
                    for name, item in rack.statistics.items()
                    if item.total_ns
                },
                self._present_loads(),
            )
        return self._status.facts(answers, self.over)

    def operate(self, verb: str, fields: Facts) -> Facts:
        """Operate the rack; return ``ok``, ``reason`` and what is true afterwards."""
        reason, found = "", {}
        with self._entrance():
            if self.over:
                return {"ok": False, "reason": self.over}
            try:
                found = {**(VERBS[verb].act(self._requests, **fields) or {})}
            except OperationRefused as refused:
                reason = str(refused)
            with suppress(OperationRefused):
                found = {**VERBS[verb].now(self._requests, **fields), **found}
        return {"ok": not reason, "reason": reason, **found}

    def close(self) -> None:
        """Do nothing: the rack is its owner's."""

    # RackObserver

    def scanned(self, task: Task, record: ScanRecord, writes: list[WriteGroup]) -> None:  # noqa: ARG002
        """Keep the errors of a scan."""
        for line, code in record.errors:
            self._log.error(record.time_ns, task.name, line, code, record.scan)

    def written(self, writes: list[WriteGroup]) -> None:
        """Ignore writes: values are read."""

    def tuned(self, task: Task, now_ns: int) -> None:
        """Ignore tunables: setting one is an operation."""

    def operated(self, operation: Operation) -> None:
        """Keep an operation."""
        self._log.operation(operation)

    def _versions(self) -> tuple[Mapping[str, Program], Mapping[str, SourceText]]:
        with self._entrance():
            return {task.name: task.compiled.program for task in self._rack.tasks}, self._rack.sources

    def _reader(self, name: str) -> _Reader:
        if name not in self._readers:
            if len(self._readers) > _MOST_READERS:
                self._readers.clear()
            self._readers[name] = self._make_reader(name)
        return self._readers[name]

    def _make_reader(self, name: str) -> _Reader:
        try:
            meant = self._names.find(name)
        except NameFault:
            return lambda: None
        if isinstance(meant, SignalName):
            return self._signal_reader(meant)
        if isinstance(meant, LocalName):
            task = self._rack.task(meant.task)
            return lambda: _local(task, meant.element)
        memory, view, index = self._rack.memory, self._rack.memory.view(meant.name), meant.index
        return lambda: memory.read_now(view, index)

    def _signal_reader(self, meant: SignalName) -> _Reader:
        name, signal = meant.plant, meant.signal
        if signal in WEB_KINDS or signal in END_KINDS:
            read = self._rack.plants.reader(name, signal)
            return read if signal != "broken" else lambda: bool(read())
        return lambda: getattr(self._plant(name), signal, None)

    def _plant(self, name: str) -> Any:
        state = None if self._stream is None else self._stream.plants.last(name)
        return signals_of(self._rack.plants[name]) if state is None else state

    def _tasks(self) -> Iterator[Facts]:
        for module in self._rack.task_modules:
            for item in module.tasks:
                task = item.task
                deleted = task.name in self._rack.operations.deleted
                yield {
                    "task": task.name,
                    "slot": module.config.slot,
                    "status": DELETED if deleted else task.status.value,
                    "scans": item.statistics.scans,
                    "skipped": item.statistics.skipped,
                    "errors": task.errors.count,
                }

    def _drives(self, trips: Sequence[str]) -> Iterator[Facts]:
        for item in read_drives(self._rack, trips):
            name, ends = item.driven.name, self._rack.plants.ends
            roll = end_signals_of(ends[name]) if name in ends else None
            more = {key: getattr(item, key) for key in ("conducting", "gates", "delta_deg", "state", "faults")}
            yield drive_facts(name, item.driven.slot, self._plant(name), roll, **more)

    def _present_loads(self) -> dict[int, float]:
        """Return the loads, measured again if the last ones are old."""
        now_ns, (since_ns, before) = time.monotonic_ns(), self._busy
        passed_ns = now_ns - since_ns
        if self._measured and passed_ns >= LOAD_NS:
            modules = {module.config.slot: module.tasks for module in self._rack.task_modules}
            busy = {slot: sum(item.statistics.total_ns for item in tasks) for slot, tasks in modules.items()}
            self._loads = {slot: 100.0 * (total - before.get(slot, 0)) / passed_ns for slot, total in busy.items()}
            self._busy = now_ns, busy
        return self._loads


def _local(task: Task, local: Element[Symbol]) -> Value | None:
    """Return a task's own value; None if a reload has taken it away."""
    try:
        value = task.value(local.name)
        return value[local.index] if isinstance(value, list) else value
    except LookupError:
        return None


def _nothing(stamp: int, payload: bytes) -> None:
    """Do nothing: the stream keeps the last state of a plant that somebody takes."""
