"""Does to a rack what came from outside in a recording, each act at its time and in its place."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field

from automax_ros.core.diagnostics import SourceText
from automax_ros.core.text import printable
from automax_ros.core.ticks import seconds_text
from automax_ros.core.types import DataType, Value
from automax_ros.core.values import value_of, value_text
from automax_ros.rack.base.observers import Operation
from automax_ros.rack.base.stop_cause import KEEP_STATE, WITHOUT_BATTERY, OperationRefused
from automax_ros.rack.operator.switches import SwitchOperations
from automax_ros.rack.rack import Rack
from automax_ros.rack.tasks.installation import RackError
from automax_ros.rackfile.model.writers import OPERATOR_WRITER, ROS_WRITER
from automax_ros.replay.rerun.events import Event, Operated, Order, Tuned, Written
from automax_ros.runtime.memory.views import MemoryValueError, WriteGroup
from automax_ros.runtime.tasks.task import ScanRecord, Task
from automax_ros.runtime.time.scheduler import EventClass, EventKey

MOST_NOTES = 20
"""Most notes on acts that the rack refused (decision)."""
_KEYS = {
    Order.FIRST: EventKey(EventClass.OUTSIDE, 1, "rerun"),
    Order.AFTER_IO: EventKey(EventClass.IO, 1000, "rerun"),
    Order.AFTER_SCAN: EventKey(EventClass.OBSERVE, 1000, "rerun"),
    Order.LAST: EventKey(EventClass.OBSERVE, 1000, "rerun"),
}

_REPORTED = (OPERATOR_WRITER, ROS_WRITER)


@dataclass
class OutsidePlayer:
    """Plays the events of a recorded run on a rack; it observes the rack, after the stream.

    ``edits`` are sources that take the place of those with which their tasks were reloaded (decision: an edit stays,
    whatever was loaded in the recording). ``refused`` counts acts that the rack of the recording took and this one
    refused, ``notes`` tells the first.
    """

    rack: Rack
    events: Sequence[Event]
    edits: Mapping[str, SourceText] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    refused: int = 0

    def __post_init__(self) -> None:
        """Prepare; nothing is scheduled yet."""
        self._waiting = deque(self.events)
        self._tuned: dict[tuple[str, str], Value | None] = {}
        self._switches = SwitchOperations(self.rack)

    def begin(self) -> None:
        """Do what came before the tasks were put into RUN, and schedule the rest: for ``Rack.start``."""
        while self._waiting and self._waiting[0].order is Order.START:
            self._do(self._waiting.popleft())
        self._post()

    def watch(self, tunables: Iterable[tuple[str, str]]) -> None:
        """Note when an event replaces the value that an edit has just given to a tunable: task and name."""
        self._tuned = {tunable: self._value_of(tunable) for tunable in tunables}

    def _value_of(self, tunable: tuple[str, str]) -> Value | None:
        """Return the value of a tunable, None if the task has it no more."""
        task, name = tunable
        try:
            value = self.rack.task(task).value(name)
        except KeyError:
            return None
        return None if isinstance(value, list) else value

    def _note_replaced(self, event: Event) -> None:
        for tunable, edited in list(self._tuned.items()):
            value = self._value_of(tunable)
            if value != edited:
                del self._tuned[tunable]
                what = "is gone" if value is None else f"becomes {value_text(value)}"
                full = ".".join(tunable)
                when = seconds_text(event.at_ns)
                self.notes.append(f"{full} {what} at {when} s, as in the recording: that ends its edit")

    def _post(self) -> None:
        """Schedule the next event; one that follows a scan comes after it, at the end of the instant at the latest."""
        if self._waiting:
            event, scheduler = self._waiting[0], self.rack.scheduler
            key = _KEYS.get(event.order, _KEYS[Order.FIRST])
            scheduler.at(max(event.at_ns, scheduler.now_ns), key, lambda _: self._happen(event))

    def _happen(self, expected: Event) -> None:
        """Do an event if it still waits, and those that follow it at its place."""
        if not self._waiting or self._waiting[0] is not expected:
            return
        while self._waiting and self._is_now(self._waiting[0], expected):
            self._do(self._waiting.popleft())
        self._post()

    @staticmethod
    def _is_now(event: Event, expected: Event) -> bool:
        return event is expected or (
            (event.at_ns, event.order) == (expected.at_ns, expected.order) and event.scan == expected.scan
        )

    # RackObserver

    def scanned(self, task: Task, record: ScanRecord, writes: list[WriteGroup]) -> None:  # noqa: ARG002
        """Do what followed on this scan in the recording."""
        now_ns, found = self.rack.now_ns, (task.name, record.scan)
        done = False
        while self._waiting and self._waiting[0].at_ns == now_ns and self._waiting[0].scan == found:
            self._do(self._waiting.popleft())
            done = True
        if done:
            self._post()

    def written(self, writes: list[WriteGroup]) -> None:
        """Do nothing."""

    def tuned(self, task: Task, now_ns: int) -> None:
        """Do nothing."""

    def operated(self, operation: Operation) -> None:
        """Do nothing."""

    def _do(self, event: Event) -> None:
        act = event.act
        try:
            if isinstance(act, Written):
                self._write(act, report=event.order is not Order.START or act.writer in _REPORTED)
            elif isinstance(act, Tuned):
                self._tune(act)
            else:
                self._operate(act)
        except (OperationRefused, RackError, MemoryValueError) as error:
            if not isinstance(act, Operated) or act.ok:
                self._note(event, str(error))
        if self._tuned and not isinstance(act, Written):
            self._note_replaced(event)

    def _note(self, event: Event, why: str) -> None:
        self.refused += 1
        if len(self.notes) < MOST_NOTES:
            act = event.act
            what = act.what if isinstance(act, Operated) else "write" if isinstance(act, Written) else "tune"
            of = f" {act.task}" if not isinstance(act, Written) and act.task else ""
            self.notes.append(f"{what}{of} at {seconds_text(event.at_ns)} s is refused here: {printable(why)}")

    def _write(self, act: Written, *, report: bool) -> None:
        """Write; what a network module shows at power-up is reported with what comes next."""
        rack = self.rack
        rack.memory.now_ns = rack.now_ns
        for view, element, value in act.entries:
            rack.inputs.write(view, element, rack.memory.accepted(view, value, element), act.writer)
        if report:
            rack.observers.report_writes()

    def _tune(self, act: Tuned) -> None:
        try:
            self.rack.tune(self.rack.task(act.task), act.name, act.value)
        except KeyError as error:
            raise OperationRefused(f"there is no tunable {act.task}.{act.name}") from error
        except ValueError as error:
            raise OperationRefused(str(error)) from error

    def _operate(self, act: Operated) -> None:
        """Do an operation; where its message does not hold all of it, report what was recorded."""
        operation = self._operation(act)
        if operation is not None:
            operation()
        elif act.ok:
            self.rack.operations.reports.done(act.what, act.task, reason=act.reason, detail=act.detail)
        else:
            self.rack.operations.reports.failed(act.what, act.reason, act.task, act.detail)

    def _operation(self, act: Operated) -> Callable[[], None] | None:
        """Return what carries an operation out; None for one on time alone, and for a refused one without its values.

        One that was refused is tried again (decision: in the edited run it may not be refused).
        """
        operations, adjust, name, detail = self.rack.operations, self.rack.adjust, act.task, act.detail
        switches = self._switches
        simple: dict[str, Callable[[], None]] = {
            "run": lambda: operations.run(name),
            "stop": lambda: operations.stop(name),
            "delete": lambda: operations.delete(name),
            "clear_errors": lambda: operations.clear_errors(name or None),
            "run_all": operations.run_all,
            "stop_all": lambda: operations.stop_all(act.reason),
            "power_off": operations.power_off,
            "power_on": lambda: operations.power_on(battery=detail != WITHOUT_BATTERY),
        }
        with_values: dict[str, Callable[[], None]] = {
            "reload": lambda: self._reload(act),
            "set": lambda: self._set(act),
            "force": lambda: self._give("force", detail),
            "tune": lambda: self._give("tune", detail),
            "unforce": lambda: adjust.unforce(detail.split() or None),
            "module": lambda: switches.module(*_three(detail)),
            "plant": lambda: switches.plant(*_three(detail)),
            "web": lambda: switches.web(*_three(detail)),
        }
        return simple.get(act.what) or (with_values.get(act.what) if act.ok else None)

    def _reload(self, act: Operated) -> None:
        source = self.edits.get(act.task, act.source)
        assert source is not None
        self.rack.operations.reload(act.task, source, keep_state=act.detail == KEEP_STATE)

    def _set(self, act: Operated) -> None:
        if act.written is None:
            self._give("set", act.detail)
            return
        view, _, value = act.written.entries[0]
        variable = self.rack.config.variables[view]
        label = act.detail.partition(" = ")[0]
        if variable.type is DataType.STRING:
            self.rack.adjust.set(label, value)
        else:
            self._give("set", act.detail)

    def _give(self, what: str, detail: str) -> None:
        """Force, set or tune by the text ``NAME = VALUE``."""
        name, _, text = detail.partition(" = ")
        target = self.rack.adjust.find(what, name)
        value = value_of(text, target.variable.type)
        if value is None:
            raise OperationRefused(f"{printable(detail)}: not a value of {name}")
        act = {"force": self.rack.adjust.force, "set": self.rack.adjust.set, "tune": self.rack.adjust.tune}[what]
        act(target, value)


def _three(detail: str) -> tuple[str, str, str]:
    """Return the words of ``7 test_switch A``; the last may be empty, or have blanks."""
    first, _, rest = detail.partition(" ")
    second, _, third = rest.partition(" ")
    return first, second, third
