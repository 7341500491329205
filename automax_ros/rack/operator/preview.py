"""What an operation would do, in a sentence, before it is executed: nothing changes, and observers are not notified."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from automax_ros.core.names import NameFault
from automax_ros.core.text import near_or_listed, quoted
from automax_ros.core.types import DataType, Value
from automax_ros.core.values import source_text, value_of, wanted
from automax_ros.drive.base.errors import ParameterError
from automax_ros.language.program import tunable_value
from automax_ros.rack.base.stop_cause import OperationRefused
from automax_ros.rack.operator.plant_verbs import read_values
from automax_ros.rackfile.model.rack_names import LocalName, RackNames, SignalName
from automax_ros.runtime.tasks.task import Status

_WORDS = {
    "run": "put task {task} into RUN",
    "stop": "stop task {task}",
    "delete": "take task {task} out of the rack; a reload brings it back",
    "clear": "clear the error log of {task}",
    "clear_errors": "clear the error log of {task}",
    "run_all": "put all tasks into RUN",
    "stop_all": "STOP ALL: stop all tasks, and make outputs 0",
    "pause": "halt the rack: rack time stands still",
    "resume": "let rack time go on",
    "step": "step by {count} {what} {task}",
    "power": "switch the power {what}",
    "unforce": "end the force of {names}",
    "module": "module in slot {name}: {control} to {value}",
    "plant": "plant {name}: {control} {value}",
    "web": "{control} {value} of web {name}",
}
_WEB_WORDS = {
    "break": "break web {name}",
    "thread": "thread web {name} again, without tension",
    "stiffness_n": "give web {name} a stiffness of {value} N, at the strain that it has",
}
_NEEDS_TASK = ("run", "stop", "delete")


@dataclass(frozen=True)
class Present:
    """The present of a rack: the status of its tasks by their names, what is forced, whether the power is on.

    ``look`` returns the value of a name, None if it is not known.
    """

    tasks: Mapping[str, str]
    forced: Sequence[str]
    powered: bool
    look: Callable[[str], Value | None]


def preview(names: RackNames, verb: str, fields: Mapping[str, Any], present: Present) -> str:
    """Return what a verb of ``VERBS`` with the fields of its request would do, and what it would change.

    Names and values are checked; whether the rack is in a state for it, it says when it is asked.

    Raises:
        OperationRefused: there is no such name, or the value is not one for it.
    """
    if verb in ("set", "force", "tune"):
        return _assignment(names, verb, fields["name"], fields["value"], present)
    usual = {"task": "", "count": 1, "what": "", "value": "", "names": ["all that is forced"]}
    given = {**usual, **{key: value for key, value in fields.items() if value}}
    task = given["task"].strip().upper()
    if verb in ("plant", "web"):
        _check_work(names, verb, given["name"], given["control"], given["value"])
    now = _now(verb, task, present)
    words = {**given, "task": task or "all tasks", "names": ", ".join(given["names"])}
    form = _WORDS[verb]
    if verb == "web":
        words["name"] = given["name"].strip().upper()
        form = _WEB_WORDS.get(given["control"].strip(), form)
    return ": ".join(filter(None, (form.format(**words).strip(), now)))


def _now(verb: str, task: str, present: Present) -> str:
    if task or verb in _NEEDS_TASK:
        if task not in present.tasks:
            raise _absent("task", task, present.tasks)
        return f"it is {present.tasks[task]} now"
    if verb == "unforce":
        return f"{', '.join(present.forced) or 'nothing'} is forced now"
    if verb == "power":
        return f"it is {'on' if present.powered else 'off'} now"
    if verb not in ("run_all", "stop_all"):
        return ""
    running = list(present.tasks.values()).count(Status.RUNNING.value)
    return f"{running} of {len(present.tasks)} tasks run now"


def _assignment(names: RackNames, verb: str, name: str, text: str, present: Present) -> str:
    try:
        meant = names.find(name)
    except NameFault as fault:
        raise OperationRefused(f"{fault.message}: {fault.hint}" if fault.hint else fault.message) from fault
    if isinstance(meant, SignalName):
        raise OperationRefused(f"{meant.label} is measured at the plant: nobody can {verb} it")
    local = meant.element.variable if isinstance(meant, LocalName) else None
    if verb == "set" and local is not None:
        raise OperationRefused(f"{meant.label} is a variable of a task: only common variables can be set")
    if verb == "tune" and (local is None or local.tuning is None):
        raise OperationRefused(f"{meant.label} is not a tunable")
    variable = meant.element.variable if isinstance(meant, LocalName) else meant.variable
    kind, length = variable.type, variable.length
    value = value_of(text if kind is DataType.STRING else text.strip(), kind, length)
    if value is None:
        raise OperationRefused(f"{quoted(text)} is not a value for {meant.label}: it takes {wanted(kind, length)}")
    if verb == "tune" and local is not None:
        try:
            value = tunable_value(local, meant.label, value)
        except ValueError as fault:
            raise OperationRefused(str(fault)) from fault
    now = present.look(meant.label)
    before = "not known" if now is None else source_text(now)
    return f"{verb} {meant.label} to {source_text(value)}: it is {before} now"


def _check_work(names: RackNames, what: str, name: str, control: str, value: str) -> None:
    known = list(names.webs) if what == "web" else [*dict.fromkeys((*names.plants, *names.ends))]
    if name.strip().upper() not in known:
        raise _absent(what, name, known)
    try:
        read_values(what, control.strip(), value.strip())
    except ParameterError as fault:
        raise OperationRefused(str(fault)) from fault


def _absent(what: str, name: str, known: Mapping[str, str] | Sequence[str]) -> OperationRefused:
    hint = near_or_listed(name, list(known))
    return OperationRefused(f"the rack has no {what} {quoted(name)}" + (f": {hint}" if hint else ""))
