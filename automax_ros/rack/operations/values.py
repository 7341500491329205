"""Operations of an operator on values: force and release, set, tune. Observers receive each, refused ones too.

A variable is given by its full name, ``REF%``, ``TABLE%(3)``, a local or a tunable with its task, ``SPEED.COUNT%``,
``SPEED.KP``; or as ``find`` has returned it. ``Rack.force``, ``Rack.write`` and ``Rack.tune`` do the same for programs,
without reporting an operation.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NoReturn

from automax_ros.core.names import PREDEFINED, Element, NameFault
from automax_ros.core.text import near_or_listed, quoted
from automax_ros.core.types import Value
from automax_ros.core.values import source_text
from automax_ros.rack.base.local_names import LocalElement
from automax_ros.rack.base.observers import Observers
from automax_ros.rack.base.stop_cause import OperationRefused
from automax_ros.rack.operations.forces import ForceTable, Target
from automax_ros.rack.operations.operations import POWER_OFF, Operations
from automax_ros.rackfile.model.config import RackConfig
from automax_ros.rackfile.model.value_names import tunables_of
from automax_ros.rackfile.model.writers import OPERATOR_WRITER
from automax_ros.runtime.memory.memory import CommonMemory, ProcessInputs
from automax_ros.runtime.memory.views import MemoryValueError
from automax_ros.runtime.tasks.keep_values import stepped
from automax_ros.runtime.tasks.task import Task

Tune = Callable[[Task, str, object], None]
_NOT_REPORTED = ""
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
        observers: Observers,
        tune: Tune,
    ) -> None:
        """Create from the parts of a rack; ``tune`` sets a tunable."""
        self._config, self._operations = config, operations
        self._memory, self._inputs = memory, inputs
        self._forcing, self._observers, self._tune = forcing, observers, tune

    def find(self, what: str, name: str) -> Target:
        """Return the variable that a name means for an operation: ``force``, ``unforce``, ``set`` or ``tune``.

        Raises:
            OperationRefused: there is none that the operation takes.
        """
        if what == "tune":
            return self._tunable(what, name)
        owner, dot, _ = name.partition(".")
        try:
            if dot and what in ("force", "unforce"):
                return self._forcing.local(name)
            if dot and owner.strip().upper() in {task.name for _, task in self._config.placed_tasks}:
                reason = (
                    f"{quoted(name)} is a variable of task {owner.strip().upper()}: only common variables can be set"
                )
                self._refuse(what, reason, owner.strip().upper())
            return self._config.common(name)
        except NameFault as fault:
            self._refuse(what, f"{fault.message}: {fault.hint}" if fault.hint else fault.message)

    def force(self, variable: str | Target, value: Value) -> None:
        """Hold a common or a local at a value against every write; one that is forced already gets the new value.

        Raises:
            OperationRefused: there is no such variable, it cannot be forced, the value does not fit, as many are forced
                as the Executive allows, or the power is off.
        """
        self._operations.need_power("force")
        meant = self._find_target("force", variable)
        if isinstance(meant, Element) and meant.variable.is_array:
            self._refuse("force", f"{meant.label} cannot be forced: it is an element of an array")
        task = meant.task.name if isinstance(meant, LocalElement) else ""
        self._carry_out("force", lambda: self._forcing.force(meant, value, OPERATOR_WRITER), task)
        self._operations.reports.done("force", task, detail=_assignment(meant.label, value))

    def unforce(self, variables: Sequence[str | Target] | None = None) -> None:
        """End forces, all of them for None; the values stay until the next write.

        Raises:
            OperationRefused: one of the names is not a variable or not forced, or the power is off; nothing is
                released.
        """
        self._operations.need_power("unforce")
        forced = self._forcing.targets()
        released = (
            list(forced.values()) if variables is None else [self._find_target("unforce", item) for item in variables]
        )
        for target in released:
            if target.label not in forced:
                self._refuse("unforce", f"{target.label} is not forced")
        self._memory.now_ns = self._operations.now_ns
        for target in released:
            self._forcing.release(target, OPERATOR_WRITER)
        self._operations.reports.done("unforce", detail=" ".join(target.label for target in released))

    def set(self, variable: str | Target, value: Value) -> None:
        """Write a common, or an array's element, once; the next scan may write it again.

        Raises:
            OperationRefused: there is no such common, it is forced (J2-3093 p. 5-17) or written by the rack itself, the
                value does not fit, or the power is off. The process does not need the rack's power: inputs can be set
                (decision).
        """
        label = self._write("set", variable, value)
        self._operations.reports.done("set", detail=_assignment(label, value))

    def write(self, variable: str | Target, value: Value) -> None:
        """Do the same as ``set`` for one of many samples: no operation is reported, the write log has it (decision).

        Raises:
            OperationRefused: as ``set``.
        """
        self._write(_NOT_REPORTED, variable, value)

    def tune(self, variable: str | Target, value: Value) -> None:
        """Set a tunable, ``TASK.NAME``, to any value within its limits (decision: STEP binds only ``tune_step``).

        Raises:
            OperationRefused: there is no such tunable, the value lies outside its limits or is not of its type, or the
                power is off.
        """
        self._operations.need_power("tune")
        self._change(self._find_target("tune", variable), value)

    def tune_step(self, name: str, steps: int) -> None:
        """Raise a tunable by whole steps of its STEP, or lower it by negative ones; it stops at its limits (decision).

        Raises:
            OperationRefused: there is no such tunable, or the power is off.
        """
        self._operations.need_power("tune")
        meant = self._tunable("tune", name)
        self._change(meant, stepped(meant.task, meant.variable.name, steps))

    def _write(self, what: str, variable: str | Target, value: Value) -> str:
        """Write a common or an element; return its full name."""
        found = self._find_target(what, variable)
        assert isinstance(found, Element)
        if not self._config.is_input(found.variable) and not self._operations.powered:
            self._refuse(what, POWER_OFF)
        view = self._memory.view(found.name)
        if found.name in PREDEFINED:
            self._refuse(what, f"{found.name} cannot be set: the rack itself writes it")
        if (view, found.index) in self._memory.forced:
            held = source_text(self._memory.read_now(view, found.index))
            self._refuse(what, f"{found.name} cannot be set: it is forced at {held}; force another value or release it")
        write = self._inputs.write_from_outside
        self._carry_out(what, lambda: write(view, value, OPERATOR_WRITER, found.index))
        return found.label

    def _change(self, meant: Target, value: Value) -> None:
        assert isinstance(meant, LocalElement)
        try:
            self._tune(meant.task, meant.variable.name, value)
        except ValueError as error:
            self._refuse("tune", str(error), meant.task.name)
        self._operations.reports.done("tune", meant.task.name, detail=_assignment(meant.label, value))

    def _find_target(self, what: str, variable: str | Target) -> Target:
        if isinstance(variable, LocalElement) and not variable.is_current:
            variable = variable.label
        return self.find(what, variable) if isinstance(variable, str) else variable

    def _tunable(self, what: str, name: str) -> LocalElement:
        owner, dot, bare = "".join(name.upper().split()).partition(".")
        if not dot:
            self._refuse(what, f"{quoted(name)} is not TASK.TUNABLE")
        task = self._operations.find(what, owner).task
        tunables = tunables_of(task.compiled.program)
        if bare not in tunables:
            hint = near_or_listed(bare, sorted(tunables)) or "it has none"
            self._refuse(what, f"task {owner} has no tunable {quoted(bare)}: {hint}", owner)
        return LocalElement(task, Element(tunables[bare]))

    def _carry_out(self, what: str, call: Callable[[], None], task: str = "") -> None:
        self._memory.now_ns = self._operations.now_ns
        try:
            call()
        except MemoryValueError as error:
            self._refuse(what, str(error), task)
        self._observers.report_writes()

    def _refuse(self, what: str, reason: str, task: str = "") -> NoReturn:
        if what == _NOT_REPORTED:
            raise OperationRefused(reason)
        self._operations.reports.refuse(what, reason, task)


def _assignment(name: str, value: Value) -> str:
    return f"{name} = {source_text(value)}"
