"""Forwards an operator's requests to the processes of a distributed rack that have the objects concerned.

The operator calls the process with common memory, as if the rack were in one process. Each other process has the same
services under its first node, ``processor_3/operate/run``; ``RequestForwarder`` finds the processes that a request
concerns, calls them all at once and responds when all have answered, or after ``ANSWER_S``.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from rclpy.clock import Clock, ClockType

from automax_ros.core.diagnostics import SourceText
from automax_ros.core.text import quoted
from automax_ros.rack.operator.requests import VERBS, Concerns
from automax_ros.rackfile.processes import part_name
from automax_ros.ros.base.node import ModuleNode
from automax_ros.ros.distributed.bus import DistributedMemory
from automax_ros.ros.intake.guard import conclude
from automax_ros.ros.intake.service_requests import DeferredResponse, Respond

ANSWER_S = 2.0
"""Seconds to wait for another process."""
FIND_S = 0.02
"""Seconds between two checks for a service that is not discovered yet."""
RELOAD_ANSWER_S = 60.0
"""Seconds to wait for another process that has to compile."""
THIS_PROCESS = -1
"""This process, among those that a request concerns."""
NOT_TOGETHER = "a distributed rack runs on the wall clock and cannot be halted or stepped"
"""Why requests to halt or step a distributed rack are refused (decision)."""
Local = Callable[[Any, Any], Any]
"""Executes a request in this process and returns the response."""


_ADDED = ("tasks", "running", "ended")
"""Fields of a status that count for one process and are added up."""


def operate_name(module: str, service: str) -> str:
    """Return the service, in the rack's namespace, by which a process executes forwarded requests."""
    return f"{module}/operate/{service}"


@dataclass(frozen=True)
class PartRequest:
    """A request to one process: the slot that names it, ``THIS_PROCESS`` for this one, and the request."""

    process: int
    request: Any


class RequestForwarder:
    """Forwards the requests of the operator's node. ``bus`` knows which processes are present.

    ``reloaded`` is called when a task of another process has a new source.
    """

    def __init__(self, node: ModuleNode, bus: DistributedMemory, reloaded: Callable[[], None]) -> None:
        """Find the process of each task, slot, plant and web."""
        self._reloaded = reloaded
        config = node.rack_context.rack.config
        self._node, self._bus, self._config = node, bus, config
        own_slot = bus.peers.process_slot
        self._others = [slot for slot in bus.process_slots if slot != own_slot]
        process_of = {
            slot: THIS_PROCESS if process == own_slot else process
            for process, slots in bus.process_slots.items()
            for slot in slots
        }
        self._tasks = {task.name: process_of[module.slot] for module, task in config.placed_tasks}
        self._slots = {str(slot): process for slot, process in process_of.items()}
        self._plants = dict(bus.plants)
        self._clients: dict[tuple[int, str], Any] = {}

    def answer(self, service: str, kind: Any, request: Any, response: Any, local: Local) -> Any:
        """Answer a request: at once if it concerns this process alone, else when all processes have answered."""
        concerns = VERBS[service].concerns
        if concerns is Concerns.NONE:
            return conclude(response, ok=False, reason=NOT_TOGETHER)
        parts = self._parts(concerns, request, kind)
        if [part.process for part in parts] == [THIS_PROCESS]:
            return local(parts[0].request, response)
        absent = [
            self._name(part.process) for part in parts if part.process not in (THIS_PROCESS, *self._bus.peers.by_slot)
        ]
        if absent and len(parts) == 1:
            return conclude(response, ok=False, reason=f"{absent[0]} is not there: start its process again")
        answers: dict[int, Any] = {part.process: None for part in parts}
        for part in parts:
            if part.process == THIS_PROCESS:
                answers[THIS_PROCESS] = local(part.request, kind.Response())

        def begin(respond: Respond) -> None:
            _PendingRequest(self, service, kind, parts, answers, lambda: respond(end()))

        def end() -> Any:
            silent = [self._name(part.process) for part in parts if answers[part.process] is None]
            found = _merge(response, request, parts, answers, silent)
            if service == "reload" and _is_ok(found):
                self._note_source(request)
            return found

        return DeferredResponse(begin)

    def _note_source(self, request: Any) -> None:
        """Store the new source of a task of another process: recorders get the rack's files from this one."""
        name = request.task.strip().upper()
        sources = self._node.rack_context.rack.operations.installation.sources
        sources[name] = SourceText(sources[name].name, request.source)
        self._reloaded()

    def client(self, process: int, service: str, kind: Any) -> Any:
        """Return the client of a service of another process."""
        key = process, service
        if key not in self._clients:
            name = operate_name(self._name(process), service)
            self._clients[key] = self._node.create_client(kind, name)
        return self._clients[key]

    @property
    def node(self) -> ModuleNode:
        """The node that sends the requests."""
        return self._node

    def is_there(self, process: int) -> bool:
        """Return whether a process is present."""
        return process in self._bus.peers.by_slot

    def _parts(self, concerns: Concerns, request: Any, kind: Any) -> list[PartRequest]:
        """Return a request to each process that it concerns; this one refuses unknown names."""
        if concerns is Concerns.NAMES and request.names:
            groups: dict[int, list[str]] = {}
            for name in request.names:
                groups.setdefault(self._process_of_name(name), []).append(name)
            return [PartRequest(process, kind.Request(names=names)) for process, names in groups.items()]
        if (
            concerns in (Concerns.ALL, Concerns.NAMES)
            or (concerns is Concerns.TASK and not request.task.strip())
            or (concerns is Concerns.STATUS and not request.home_only)
        ):
            return [PartRequest(THIS_PROCESS, request), *(PartRequest(process, request) for process in self._others)]
        if concerns is Concerns.TASK:
            process = self._process_of_task(request.task)
        elif concerns is Concerns.NAME:
            process = self._process_of_name(request.name)
        elif concerns is Concerns.SLOT:
            process = self._slots.get(request.name.strip(), THIS_PROCESS)
        elif concerns is Concerns.PLANT:
            process = self._slots.get(str(self._plants.get(request.name.strip().upper(), "")), THIS_PROCESS)
        else:
            process = THIS_PROCESS
        return [PartRequest(process, request)]

    def _process_of_task(self, text: str) -> int:
        return self._tasks.get(text.strip().upper(), THIS_PROCESS)

    def _process_of_name(self, text: str) -> int:
        """Return the process that holds ``TASK.NAME``, this one for common variables."""
        task, point, _ = text.partition(".")
        return self._process_of_task(task) if point else THIS_PROCESS

    def _name(self, process: int) -> str:
        return (
            part_name(self._config, self._bus.process_slots[process])
            if process in self._bus.process_slots
            else quoted(str(process))
        )


class _PendingRequest:
    """A forwarded request: waits for all answers, up to a time limit.

    A process is called once its service is discovered: DDS drops a request that is sent before.
    """

    def __init__(
        self,
        forwarding: RequestForwarder,
        service: str,
        kind: Any,
        parts: Sequence[PartRequest],
        answers: dict[int, Any],
        done: Callable[[], None],
    ) -> None:
        self._answers, self._done, self._node = answers, done, forwarding.node
        called = [part for part in parts if part.process != THIS_PROCESS and forwarding.is_there(part.process)]
        self._open = {part.process for part in called}
        self._not_called = [(part, forwarding.client(part.process, service, kind)) for part in called]
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        wait_s = RELOAD_ANSWER_S if service == "reload" else ANSWER_S
        self._timers = [
            self._node.create_timer(wait_s, self._end, clock=steady),
            self._node.create_timer(FIND_S, self._call_discovered, clock=steady),
        ]
        if called:
            self._call_discovered()
        else:
            self._end()

    def _call_discovered(self) -> None:
        """Call the processes whose service is discovered by now."""
        waiting, self._not_called = self._not_called, []
        for part, client in waiting:
            if client.service_is_ready():
                future = client.call_async(part.request)
                future.add_done_callback(lambda found, process=part.process: self._take_answer(process, found))
            else:
                self._not_called.append((part, client))

    def _take_answer(self, process: int, future: Any) -> None:
        with self._node.rack_context.between_scans():
            if process in self._open:
                self._open.discard(process)
                self._answers[process] = future.result()
                if not self._open:
                    self._end()

    def _end(self) -> None:
        """Respond with the answers received."""
        timers, self._timers = self._timers, []
        if timers:
            for timer in timers:
                self._node.destroy_timer(timer)
            self._open.clear()
            self._done()


def _merge(
    response: Any, request: Any, parts: Sequence[PartRequest], answers: dict[int, Any], silent: Sequence[str]
) -> Any:
    """Return one response: lists concatenated, numbers of tasks added up, OK if all are.

    A common that is forced is forced in every process, and listed once. If processes are ``silent``, a response that
    can name them (``absent``) holds the answers received; any other is a refusal.
    """
    found = [answer for answer in answers.values() if answer is not None]
    if len(parts) == 1 and found:
        return found[0]
    reasons = [reason for answer in found if (reason := _reason_of(answer)) and not _is_ok(answer)]
    if silent:
        reasons.append(f"{', '.join(silent)} did not answer")
    first = found[0] if found else response
    for name in first.get_fields_and_field_types():
        values = [getattr(answer, name) for answer in found]
        if values and isinstance(values[0], (list, tuple)):
            items = [item for value in values for item in value]
            setattr(response, name, list(dict.fromkeys(items)) if name == "forced" else items)
        elif name in _ADDED:
            setattr(response, name, sum(values))
        elif values:
            setattr(response, name, values[0])
    if hasattr(response, "found"):
        _in_order(response, list(request.names))
    can_name = bool(found) and hasattr(response, "absent")
    if can_name:
        response.absent = list(silent)
    ok = (can_name or not silent) and all(map(_is_ok, found))
    return conclude(response, ok=ok, reason="; ".join(dict.fromkeys(reasons)))


def _in_order(response: Any, names: list[str]) -> None:
    """Sort the values into the order in which they were requested, each once."""
    places = {name.strip().upper(): place for place, name in reversed(list(enumerate(names)))}
    # A foreign program may answer with fewer values than names.
    read = {item[0]: item for item in zip(response.found, response.values, response.shown, strict=False)}
    items = sorted(read.values(), key=lambda item: places.get(item[0].upper(), len(places)))
    response.found, response.values, response.shown = ([item[column] for item in items] for column in range(3))


def _is_ok(answer: Any) -> bool:
    return bool(getattr(answer, "ok", getattr(answer, "success", True)))


def _reason_of(answer: Any) -> str:
    return str(getattr(answer, "reason", getattr(answer, "message", "")))
