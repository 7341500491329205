"""Operations of an operator on values: force and release, set, tune. Observers receive each, refused ones too.

Names are full ones: ``REF%``, ``TABLE%(3)``, a local or a tunable with its task: ``SPEED.COUNT%``, ``SPEED.KP``.
``Rack.force``, ``Rack.write`` and ``Rack.tune`` do the same for programs, without reporting an operation.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NoReturn

from automax_ros.core.names import PREDEFINED, NameFault
from automax_ros.core.text import near_or_listed, quoted
from automax_ros.core.types import Value
from automax_ros.core.values import source_text
from automax_ros.rack.base.observers import Observers, Operation
from automax_ros.rack.base.stop_cause import OperationRefused
from automax_ros.rack.operations.forces import ForceTable
from automax_ros.rack.operations.operations import Operations
from automax_ros.rackfile.model.config import CommonElement, RackConfig
from automax_ros.rackfile.model.value_names import common_named
from automax_ros.rackfile.model.writers import OPERATOR_WRITER
from automax_ros.runtime.memory.memory import CommonMemory
from automax_ros.runtime.memory.process_inputs import ProcessInputs
from automax_ros.runtime.memory.views import MemoryValueError
from automax_ros.runtime.tasks.task import Task
from automax_ros.runtime.tasks.tuning_steps import stepped
from automax_ros.runtime.time.scheduler import Scheduler

Tune = Callable[[Task, str, object], None]
_UNTOLD = ""
"""Name of an operation that is not reported to observers."""


class ValueOperations:
    """Adjusts the values of one rack, between scans. ``forcing`` has the force table."""

    def __init__(
        self,
        config: RackConfig,
        operations: Operations,
        memory: CommonMemory,
        inputs: ProcessInputs,
        forcing: ForceTable,
        scheduler: Scheduler,
        observers: Observers,
        tune: Tune,
    ) -> None:
        """Create from the parts of a rack; ``tune`` sets a tunable."""
        self._config, self._operations = config, operations
        self._memory, self._inputs = memory, inputs
        self._forcing, self._scheduler, self._observers, self._tune = forcing, scheduler, observers, tune

    def force(self, name: str, value: Value) -> None:
        """Hold a common or a local at a value against every write; one that is forced already gets the new value.

        Raises:
            OperationRefused: there is no such variable, it cannot be forced, the value does not fit, as many are forced
                as the Executive allows, or the power is off.
        """
        task, label = self._forceable("force", name)
        self._carry_out("force", lambda: self._forcing.force(label, value, OPERATOR_WRITER), task)
        self._tell("force", task, detail=_assignment(label, value))

    def unforce(self, names: Sequence[str] | None = None) -> None:
        """End forces, all of them if ``names`` is None; the values stay until the next write.

        Raises:
            OperationRefused: one of the names is not a variable or not forced, or the power is off; nothing is
                released.
        """
        self._need_power("unforce")
        forced = [item.name for item in self._forcing.table()]
        released = forced if names is None else [self._forceable("unforce", name)[1] for name in names]
        for name in released:
            if name not in forced:
                self._refuse("unforce", f"{name} is not forced")
        self._memory.now_ns = self._scheduler.now_ns
        for name in released:
            self._forcing.release(name, OPERATOR_WRITER)
        self._tell("unforce", detail=" ".join(released))

    def set(self, name: str, value: Value) -> None:
        """Write a common, or an array's element, once; the next scan may write it again.

        Raises:
            OperationRefused: there is no such common, it is forced (J2-3093 p. 5-17) or written by the rack itself, the
                value does not fit, or the power is off. The process does not need the rack's power: inputs can be set
                (decision).
        """
        label = self._write("set", name, value)
        self._tell("set", detail=_assignment(label, value))

    def write(self, name: str, value: Value) -> None:
        """Do the same as ``set`` for one of many samples: no operation is reported, the write log has it (decision).

        Raises:
            OperationRefused: as ``set``.
        """
        self._write(_UNTOLD, name, value)

    def tune(self, name: str, value: float) -> None:
        """Set a tunable, ``TASK.NAME``, to any value within its limits (decision: STEP binds only ``tune_step``).

        Raises:
            OperationRefused: there is no such tunable, the value lies outside its limits or is not of its type, or the
                power is off.
        """
        task, tunable = self._tunable("tune", name)
        self._change("tune", task, tunable, value)

    def tune_step(self, name: str, steps: int) -> None:
        """Raise a tunable by whole steps of its STEP, or lower it by negative ones; it stops at its limits (decision).

        Raises:
            OperationRefused: there is no such tunable, or the power is off.
        """
        task, tunable = self._tunable("tune", name)
        self._change("tune", task, tunable, stepped(task, tunable, steps))

    def _write(self, what: str, name: str, value: Value) -> str:
        """Write a common or an element; return its full name."""
        found = self._named(what, name)
        if not self._config.is_input(found.variable):
            self._need_power(what)
        view = self._memory.view(found.name)
        if found.name in PREDEFINED:
            self._refuse(what, f"{found.name} cannot be set: the rack itself writes it")
        if (view, found.index) in self._memory.forced:
            held = source_text(self._memory.read_now(view, found.index))
            self._refuse(what, f"{found.name} cannot be set: it is forced at {held}; force another value or release it")
        write = self._inputs.write_from_outside
        self._carry_out(what, lambda: write(view, value, OPERATOR_WRITER, found.index))
        return found.label

    def _change(self, what: str, task: Task, tunable: str, value: float) -> None:
        try:
            self._tune(task, tunable, value)
        except ValueError as error:
            self._refuse(what, str(error), task.name)
        self._tell(what, task.name, detail=_assignment(f"{task.name}.{tunable}", value))

    def _tunable(self, what: str, name: str) -> tuple[Task, str]:
        self._need_power(what)
        owner, dot, bare = "".join(name.upper().split()).partition(".")
        if not dot:
            self._refuse(what, f"{quoted(name)} is not TASK.TUNABLE")
        task = self._operations.find(what, owner).task
        tunables = {item.name for item in task.compiled.program.symbols.values() if item.tuning is not None}
        if bare not in tunables:
            hint = near_or_listed(bare, sorted(tunables)) or "it has none"
            self._refuse(what, f"task {owner} has no tunable {quoted(bare)}: {hint}", owner)
        return task, bare

    def _forceable(self, what: str, name: str) -> tuple[str, str]:
        """Return task and full name of a variable to force; a common's task is ""."""
        if "." not in name:
            found = self._common(what, name)
            if found.variable.is_array and what == "force":
                self._refuse(what, f"{found.label} cannot be forced: it is an element of an array")
            return "", found.label
        self._need_power(what)
        try:
            meant = self._forcing.local(name)
        except NameFault as fault:
            self._refuse(what, f"{fault.message}: {fault.hint}" if fault.hint else fault.message)
        return meant.task.name, meant.label

    def _common(self, what: str, name: str) -> CommonElement:
        self._need_power(what)
        return self._named(what, name)

    def _named(self, what: str, name: str) -> CommonElement:
        owner = name.partition(".")[0].strip().upper()
        if owner != name.strip().upper() and owner in {task.name for _, task in self._config.placed_tasks}:
            reason = f"{quoted(name)} is a variable of task {owner}: only common variables can be set"
            self._refuse(what, reason, owner)
        try:
            return common_named(self._config, name)
        except NameFault as fault:
            self._refuse(what, f"{fault.message}: {fault.hint}" if fault.hint else fault.message)

    def _need_power(self, what: str) -> None:
        if not self._operations.powered:
            self._refuse(what, "the power is off: switch it on first")

    def _carry_out(self, what: str, call: Callable[[], None], task: str = "") -> None:
        self._memory.now_ns = self._scheduler.now_ns
        try:
            call()
        except MemoryValueError as error:
            self._refuse(what, str(error), task)
        self._observers.tell_writes()

    def _tell(self, what: str, task: str = "", *, ok: bool = True, reason: str = "", detail: str = "") -> None:
        self._observers.operated(Operation(self._scheduler.now_ns, what, task, ok, reason, detail))

    def _refuse(self, what: str, reason: str, task: str = "") -> NoReturn:
        if what != _UNTOLD:
            self._tell(what, task, ok=False, reason=reason)
        raise OperationRefused(reason)


def _assignment(name: str, value: Value) -> str:
    return f"{name} = {source_text(value)}"
