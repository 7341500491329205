"""The requests of an operator to a rack: names and values as texts, from services; one table has all of them.

Text that cannot be parsed is refused with a reason, and observers receive the refusal, as they do the rack's own.
Everything but ``prepare`` must be called between two scans.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum, auto
from typing import Any

from automax_ros.core.problems import PROBLEMS
from automax_ros.core.text import count_of, printable, quoted
from automax_ros.core.ticks import NS_PER_S, seconds_ns
from automax_ros.core.types import DataType
from automax_ros.core.values import source_text, value_of, wanted
from automax_ros.rack.base.local_names import LocalElement
from automax_ros.rack.base.stop_cause import OperationRefused
from automax_ros.rack.operations.forces import Target
from automax_ros.rack.operator.faults import DriveTrips, displays_of
from automax_ros.rack.operator.halting import Halting
from automax_ros.rack.operator.readings import MAX_NAME, MAX_NAMES, Reading, Readings
from automax_ros.rack.operator.reloads import Reloads
from automax_ros.rack.operator.switches import SwitchOperations
from automax_ros.rack.rack import Rack
from automax_ros.runtime.tasks.task import Status

MAX_VALUE = 1000
"""Longest text of a value that is accepted, in characters (decision: a bound on what strangers send)."""
MOST_OFF_S = 86_400
"""Longest time for which the power is switched off, s (decision: a day)."""
PLACES = ("first", "second", "last")
"""The entries that the error log keeps."""
DELETED = "deleted"

Fields = Mapping[str, Any]
"""Fields of an answer; those of a list of messages are mappings again."""


class OperatorRequests:
    """Executes an operator's requests to one rack. Arguments have the names of the requests' fields.

    ``reloads`` has the parts of a reload. Methods return the fields of the answer that the execution determines. Those
    named ``..._now`` return what is true afterwards, for the same arguments.

    Raises:
        OperationRefused: all methods, if the rack refuses or a text cannot be parsed.
    """

    def __init__(self, rack: Rack, pace: object = None) -> None:
        self._rack, self._reports = rack, rack.operations.reports
        self._readings, self._halting, self.reloads = Readings(rack), Halting(rack, pace), Reloads(rack)
        self._trips = DriveTrips(rack)

    def run(self, task: str) -> None:
        """Put a task into RUN."""
        self._rack.operations.run(self._task("run", task))

    def stop(self, task: str) -> None:
        """Stop a task."""
        self._rack.operations.stop(self._task("stop", task))

    def delete(self, task: str) -> None:
        """Delete a resting task; a reload brings it back."""
        self._rack.operations.delete(self._task("delete", task))

    def clear_errors(self, task: str = "") -> None:
        """Clear the error log of a task, or of all without a name."""
        self._rack.operations.clear_errors(self._task("clear_errors", task) if task.strip() else None)

    def task_now(self, task: str, **_: object) -> Fields:
        """Return the status of a task; nothing for an empty name."""
        if not task.strip():
            return {}
        (name,) = self.tasks_named(task)
        deleted = name in self._rack.operations.deleted
        return {"status": DELETED if deleted else self._rack.task(name).status.value}

    def run_all(self) -> None:
        """Put all tasks into RUN."""
        self._rack.operations.run_all()

    def stop_all(self) -> None:
        """Stop the rack."""
        self._rack.operations.stop_all("STOP ALL by the operator")

    def running_now(self) -> Fields:
        """Return how many tasks run."""
        return {"message": f"{self._running} of {count_of(len(self._rack.tasks), 'task')} run"}

    def pause(self) -> None:
        """Halt the rack."""
        self._halting.halt()

    def resume(self) -> None:
        """Let a halted rack continue."""
        self._halting.resume()

    def time_now(self) -> Fields:
        """Return whether rack time runs."""
        state = "is frozen" if self._halting.halted else "runs"
        return {"message": f"rack time {state} at {self._now_s:.9g} s"}

    def step(self, what: str, task: str = "", count: int = 1, until_s: float = 0.0) -> Fields:
        """Execute scans or ticks of a halted rack, one for a ``count`` of 0, or run until a rack time."""
        try:
            until_ns = seconds_ns(until_s) if what == "until" else 0
        except ValueError as error:
            raise OperationRefused(str(error)) from error
        stepped = self._halting.step(what, self._task("step", task), count or 1, until_ns)
        return {"why": stepped.why, "scans": stepped.scans, "time_s": self._now_s}

    def step_now(self, **_: object) -> Fields:
        """Return the rack time."""
        return {"time_s": self._now_s}

    def power(self, what: str, off_for_s: float = 0.0, *, without_battery: bool = False) -> None:
        """Switch the power ``off``, ``on``, or off for a time: ``cycle``."""
        operations, battery = self._rack.operations, not without_battery
        switched = self._short("power", what, MAX_NAME).strip().lower()
        if switched == "off":
            operations.power_off()
        elif switched == "on":
            operations.power_on(battery=battery)
        elif switched != "cycle":
            self._reports.refuse("power", f"{quoted(what)} is not off, on or cycle")
        elif not 0.0 <= off_for_s <= MOST_OFF_S:
            self._reports.refuse("power", f"the power cannot be off for {off_for_s:g} s: it takes 0 to {MOST_OFF_S}")
        else:
            operations.power(seconds_ns(off_for_s), battery=battery)

    def power_now(self, **_: object) -> Fields:
        """Return whether the power is on."""
        return {"powered": self._rack.operations.powered}

    def set(self, name: str, value: str) -> Fields:
        """Write a common or an array's element once."""
        return self._give("set", name, value, self._rack.adjust.set)

    def force(self, name: str, value: str) -> Fields:
        """Hold a common, or a task's own variable (``TASK.NAME``), at a value."""
        return self._give("force", name, value, self._rack.adjust.force)

    def tune(self, name: str, value: str) -> Fields:
        """Set a tunable, ``TASK.NAME``."""
        return self._give("tune", name, value, self._rack.adjust.tune)

    def value_now(self, name: str, **_: object) -> Fields:
        """Return the value of a variable; nothing for an empty name."""
        return {"now": self.get([name])[0][1]} if name.strip() else {}

    def unforce(self, names: Sequence[str]) -> None:
        """End forces, all of them without names."""
        for name in self._few("unforce", names):
            self._short("unforce", name, MAX_NAME)
        self._rack.adjust.unforce(list(names) or None)

    def forces_now(self, **_: object) -> Fields:
        """Return what is forced."""
        return {"forced": [name for name, _ in self.forces()]}

    def module(self, name: str, control: str, value: str) -> None:
        """Move a control of the module in a slot: ``7``, ``test_switch``, ``A``."""
        for text in (name, control, value):
            self._short("module", text, MAX_NAME)
        SwitchOperations(self._rack).module(name.strip(), control.strip(), value.strip())

    def plant(self, name: str, control: str, value: str) -> None:
        """Break, mend or load a plant: ``UNWIND``, ``short_scr``, ``3``."""
        for text in (name, control, value):
            self._short("plant", text, MAX_NAME)
        SwitchOperations(self._rack).plant(name.strip().upper(), control.strip(), value.strip())

    def web(self, name: str, control: str, value: str = "") -> None:
        """Break, thread or change a web: ``W1``, ``break``; ``W1``, ``stiffness_n``, ``1.5e5``."""
        for text in (name, control, value):
            self._short("web", text, MAX_NAME)
        SwitchOperations(self._rack).web(name.strip().upper(), control.strip(), value.strip())

    def reload(self, task: str, source: str, *, keep_state: bool = False) -> Fields:
        """Replace a task's source by a text.

        Raises:
            ReloadRefused: the source has errors; the old one continues.
        """
        prepared = self.reloads.prepare(*self.reloads.admit(task, source))
        return {"lost": self.reloads.install(prepared, keep_state=keep_state)}

    def get(self, names: Sequence[str]) -> list[tuple[str, str]]:
        """Return commons, their elements, and variables of tasks (``TASK.NAME``): each name with its value's text."""
        return [(item.name, item.value) for item in self.read(names)]

    def read(self, names: Sequence[str]) -> list[Reading]:
        """Return the same with units; names may be patterns."""
        return self._readings.get(self._few("get", names))

    def forces(self) -> list[tuple[str, str]]:
        """Return the force table."""
        return [(item.name, source_text(item.value)) for item in self._rack.forces()]

    def tasks_named(self, task: str) -> list[str]:
        """Return a task, or all of the rack without a name."""
        return self._readings.tasks_named(task)

    def errors(self, task: str) -> Fields:
        """Return the error logs of a task, or of all without a name."""
        found = [
            {
                "task": name,
                "place": place,
                "line": entry.line,
                "code": entry.problem,
                "text": problem.title if (problem := PROBLEMS.get(entry.problem)) else "unknown problem",
                "scan": entry.scan,
            }
            for name in self.tasks_named(task)
            for place, entry in zip(PLACES, self._rack.task(name).errors.entries, strict=False)
        ]
        return {"errors": found}

    def status(self, **_: object) -> Fields:
        """Return the state of the rack, of its drives and of its Processors' displays."""
        rack, operations = self._rack, self._rack.operations
        fields = {
            "rack": rack.config.name,
            "time_s": self._now_s,
            "powered": operations.powered,
            "halted": self._halting.halted,
            "stopped": operations.stopped is not None,
            "tasks": len(rack.tasks),
            "running": self._running,
            "ended": sum(task.is_done for task in rack.tasks),
            "forced": len(rack.forces()),
            "drive_faults": self._trips.lines(),
        }
        if (cause := operations.stopped) is not None:
            fields |= {
                "stopped_at_s": cause.time_ns / NS_PER_S,
                "stopped_code": cause.code or "",
                "stopped_task": cause.task,
                "stopped_reason": cause.reason,
            }
        displays = displays_of(rack)
        fields["display_modules"] = [item.module for item in displays]
        fields["display_codes"] = [item.code for item in displays]
        fields["display_meanings"] = [item.meaning for item in displays]
        return fields

    @property
    def _now_s(self) -> float:
        return self._rack.now_ns / NS_PER_S

    @property
    def _running(self) -> int:
        return sum(task.status is Status.RUNNING for task in self._rack.tasks)

    def _give(self, what: str, name: str, text: str, act: Callable[[Target, Any], None]) -> Fields:
        """Give a variable the value that a text means; return the texts of its values before and now."""
        self._short(what, name, MAX_NAME)
        if not name.strip():
            wants = "TASK.NAME" if what == "tune" else "a common, an element, or TASK.NAME to force"
            self._reports.refuse(what, f"the name is empty: it takes {wants}")
        target = self._rack.adjust.find(what, name)
        kind, length = target.variable.type, target.variable.length
        self._short(what, text, MAX_VALUE)
        value = value_of(text if kind is DataType.STRING else text.strip(), kind, length)
        if value is None:
            reason = f"{quoted(text)} is not a value for {printable(name)}: it takes {wanted(kind, length)}"
            self._reports.refuse(what, reason)
        before = self._text(target)
        act(target, value)
        return {"before": before, "now": self._text(target)}

    def _text(self, target: Target) -> str:
        if isinstance(target, LocalElement):
            return source_text(target.value)
        return source_text(self._rack.value(target.name, target.index))

    def _task(self, what: str, name: str) -> str:
        return self._short(what, name, MAX_NAME).strip().upper()

    def _few(self, what: str, names: Sequence[str]) -> Sequence[str]:
        if len(names) > MAX_NAMES:
            self._reports.refuse(what, f"{len(names)} names: at most {MAX_NAMES} are taken at once")
        return names

    def _short(self, what: str, text: str, most: int) -> str:
        if len(text) > most:
            self._reports.refuse(what, f"a text of {len(text)} characters: at most {most} are read")
        return text


def _readings(found: Sequence[Reading]) -> Fields:
    return {
        "found": [item.name for item in found],
        "values": [item.value for item in found],
        "shown": [item.shown for item in found],
    }


class Concerns(Enum):
    """The processes of a distributed rack that a request concerns, by its fields."""

    COMMON_MEMORY = auto()
    """The one with common memory."""
    ALL = auto()
    TASK = auto()
    """That of ``task``; all for an empty name."""
    NAME = auto()
    """That of ``name``, a common or ``TASK.NAME``."""
    NAMES = auto()
    """Those of ``names``; all without names."""
    SLOT = auto()
    """That of the module in the slot ``name``."""
    PLANT = auto()
    """That of the plant or web ``name``."""
    STATUS = auto()
    """All, or the one with common memory if the request is ``home_only``."""
    NONE = auto()
    """A distributed rack refuses it: its processes share the wall clock."""


def _nothing(_: OperatorRequests, **__: object) -> Fields:
    return {}


@dataclass(frozen=True)
class Verb:
    """A request that an operator may send, a service of the rack.

    ``type_name`` is the service's type, ``package/Type``. ``act`` gets the fields of the request and returns fields of
    the answer; ``now`` returns what is true afterwards, of a refused request too.
    """

    type_name: str
    concerns: Concerns
    act: Callable[..., Fields | None]
    now: Callable[..., Fields] = _nothing


def _on_task(act: Callable[..., None]) -> Verb:
    return Verb("automax_msgs/OperateTask", Concerns.TASK, act, OperatorRequests.task_now)


def _on_value(concerns: Concerns, act: Callable[..., Fields]) -> Verb:
    return Verb("automax_msgs/SetValue", concerns, act, OperatorRequests.value_now)


def _on_rack(concerns: Concerns, act: Callable[..., None], now: Callable[..., Fields]) -> Verb:
    return Verb("std_srvs/Trigger", concerns, act, now)


VERBS: Mapping[str, Verb] = {
    "run": _on_task(OperatorRequests.run),
    "stop": _on_task(OperatorRequests.stop),
    "delete": _on_task(OperatorRequests.delete),
    "clear": _on_task(OperatorRequests.clear_errors),
    "clear_errors": _on_task(OperatorRequests.clear_errors),
    "run_all": _on_rack(Concerns.ALL, OperatorRequests.run_all, OperatorRequests.running_now),
    "stop_all": _on_rack(Concerns.COMMON_MEMORY, OperatorRequests.stop_all, OperatorRequests.running_now),
    "pause": _on_rack(Concerns.NONE, OperatorRequests.pause, OperatorRequests.time_now),
    "resume": _on_rack(Concerns.NONE, OperatorRequests.resume, OperatorRequests.time_now),
    "step": Verb("automax_msgs/Step", Concerns.NONE, OperatorRequests.step, OperatorRequests.step_now),
    "power": Verb("automax_msgs/Power", Concerns.ALL, OperatorRequests.power, OperatorRequests.power_now),
    "set": _on_value(Concerns.COMMON_MEMORY, OperatorRequests.set),
    "force": _on_value(Concerns.NAME, OperatorRequests.force),
    "tune": _on_value(Concerns.NAME, OperatorRequests.tune),
    "unforce": Verb("automax_msgs/Unforce", Concerns.NAMES, OperatorRequests.unforce, OperatorRequests.forces_now),
    "module": Verb("automax_msgs/OperateControl", Concerns.SLOT, OperatorRequests.module),
    "plant": Verb("automax_msgs/OperateControl", Concerns.PLANT, OperatorRequests.plant),
    "web": Verb("automax_msgs/OperateControl", Concerns.PLANT, OperatorRequests.web),
    "reload": Verb("automax_msgs/Reload", Concerns.TASK, OperatorRequests.reload, OperatorRequests.task_now),
    "get": Verb("automax_msgs/ReadValues", Concerns.NAMES, lambda requests, names: _readings(requests.read(names))),
    "forces": Verb(
        "automax_msgs/ReadValues",
        Concerns.ALL,
        lambda requests, **_: _readings([Reading(name, text) for name, text in requests.forces()]),
    ),
    "errors": Verb("automax_msgs/ReadErrors", Concerns.TASK, OperatorRequests.errors),
    "tasks": Verb("automax_msgs/ReadTasks", Concerns.ALL, _nothing),
    "status": Verb("automax_msgs/ReadStatus", Concerns.STATUS, OperatorRequests.status),
}
"""All requests by the names of their services; the node adds to ``tasks`` and ``status`` what only the graph knows."""
