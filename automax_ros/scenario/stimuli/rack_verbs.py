"""Reads the verbs that operate a rack: force, tune, run, stop, reload, power and the others."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from automax_ros.core.diagnostics import Diagnostic, SourceText
from automax_ros.core.names import PREDEFINED, Element, NameFault, element
from automax_ros.core.problems import Severity
from automax_ros.core.text import did_you_mean, near_or_listed, quoted
from automax_ros.core.types import DataType
from automax_ros.core.values import value_of, wanted
from automax_ros.core.yaml_text import Node, Scalar, YamlMapping, YamlSequence
from automax_ros.rack.base.local_names import LocalElement, local_named
from automax_ros.rack.base.stop_cause import OperationRefused
from automax_ros.rack.operations.forces import Target
from automax_ros.rack.rack import Rack
from automax_ros.rack.tasks.installation import RackError
from automax_ros.rackfile.model.config import CommonElement
from automax_ros.rackfile.reading.files import FileFault, read_task_source
from automax_ros.rackfile.reading.values import (
    ProblemList,
    Section,
    boolean_value,
    is_plain_word,
    kind_of,
    text_value,
    wrong_kind,
)
from automax_ros.runtime.tasks.task import Task
from automax_ros.scenario.stimuli.control_verbs import control_verbs
from automax_ros.scenario.stimuli.player import Action, Operate, WavePlayer
from automax_ros.scenario.stimuli.signals import RackSignals
from automax_ros.scenario.stimuli.table import Places, table_verb
from automax_ros.scenario.stimuli.values import Read, StimuliVerb, cut_short, named, time_of, value_for, value_verbs


@dataclass(frozen=True)
class Reload:
    """Replaces the source of a task."""

    of: str
    source: SourceText
    keep_state: bool
    rack: Rack

    def do(self, _: WavePlayer) -> None:
        """Install it; if it has errors the old one continues."""
        try:
            self.rack.operations.reload(self.of, self.source, keep_state=self.keep_state)
        except RackError as error:
            raise OperationRefused(f"{error}{_first_error(error)}") from error


def _first_error(error: RackError) -> str:
    for source, diagnostics in error.findings:
        found: Diagnostic | None = next((item for item in diagnostics if item.severity is Severity.ERROR), None)
        if found is not None:
            return f": {source.name}:{found.span.line}: {found.code}: {found.message}"
    return ""


ALL = "all"
_PATH_LIMIT = 200


def rack_verbs(rack: Rack, stimuli_file: Path, *, allow_outside: bool) -> Mapping[str, StimuliVerb]:
    """Return all verbs of a rack. Sources and tables must be in the folder of the stimuli file or of the rack file."""
    tasks = _Tasks(rack)
    places = Places((stimuli_file, rack.config.path), allow_outside)
    sources, signals = _Sources(rack, places), RackSignals(rack)
    operations = rack.operations
    return {
        **value_verbs(signals),
        "table": table_verb(signals, places),
        "force": StimuliVerb(partial(_force, rack), everywhere=True),
        "unforce": StimuliVerb(partial(_unforce, rack), everywhere=True),
        "tune": StimuliVerb(tasks.tune),
        "run": StimuliVerb(tasks.each(operations.run)),
        "stop": StimuliVerb(tasks.each(operations.stop)),
        "delete": StimuliVerb(tasks.each(operations.delete)),
        "reload": StimuliVerb(sources.reload),
        "run_all": StimuliVerb(_switch(operations.run_all)),
        "stop_all": StimuliVerb(_switch(partial(operations.stop_all, "STOP ALL of the stimuli"))),
        "clear_errors": StimuliVerb(tasks.each(operations.clear_errors, every=operations.clear_errors)),
        "power": StimuliVerb(partial(_power, rack)),
        **control_verbs(rack),
    }


def _switch(operation: Callable[[], None]) -> Read:
    """Return the reader of a verb that accepts only ``true``."""

    def read(node: Node, what: str, findings: ProblemList) -> list[Action]:
        if boolean_value(node, what, findings) is False:
            findings.add("AMX6736", f"{what} must be true: leave the entry out if it must not happen", node.span)
        return [Operate("", operation)]

    return read


def names_of(node: Node, what: str, findings: ProblemList) -> list[Scalar]:
    """Return the names of a list; a single name needs no list."""
    items = node.items if isinstance(node, YamlSequence) else (node,)
    found = [item for item in items if isinstance(item, Scalar) and not item.is_null]
    for item in items:
        if not isinstance(item, Scalar) or item.is_null:
            wrong_kind(item, what, "a name or a list of names", findings)
    if not items:
        findings.add("AMX6008", f"{what} names nothing", node.span)
    return found


@dataclass(frozen=True)
class _Tasks:
    rack: Rack

    def task(self, key: Scalar, findings: ProblemList) -> Task | None:
        """Return a task; None for one in another process of a distributed rack, which executes the entry (decision)."""
        name = findings.upper_case(key.text, key.span)
        known = {task.name: task for task in self.rack.tasks}
        if name not in known and not self.rack.part.is_elsewhere("task", name):
            message = f"the rack has no task {quoted(key.text)}"
            findings.add("AMX6739", message, key.span, near_or_listed(name, known))
        return known.get(name)

    def each(self, operation: Callable[[str], None], every: Callable[[], None] | None = None) -> Read:
        """Return the reader of a verb on tasks; with ``every`` the word ``all`` means the whole rack."""

        def read(node: Node, what: str, findings: ProblemList) -> list[Action]:
            if every is not None and isinstance(node, Scalar) and node.text == ALL:
                return [Operate("", every)]
            tasks = [self.task(name, findings) for name in names_of(node, what, findings)]
            return [Operate(task.name, partial(operation, task.name)) for task in tasks if task is not None]

        return read

    def tune(self, node: Node, what: str, findings: ProblemList) -> list[Action]:
        """Read names TASK.NAME with values."""
        found = (self._tune(key, value, findings) for key, value in named(node, what, findings))
        return [item for item in found if item is not None]

    def _tune(self, key: Scalar, node: Node, findings: ProblemList) -> Operate | None:
        owner, dot, name = key.text.partition(".")
        if not dot:
            hint = "write TASK.NAME, such as SPEED.KP"
            findings.add("AMX6741", f"{quoted(key.text)} is not a task and its tunable", key.span, hint)
            return None
        task = self.task(Scalar(owner.strip(), key.plain, key.span), findings)
        return self._of_task(task, name, key, node, findings) if task is not None else None

    def _of_task(self, task: Task, name: str, key: Scalar, node: Node, findings: ProblemList) -> Operate | None:
        tunables = {item.name: item for item in task.compiled.program.symbols.values() if item.tuning is not None}
        try:
            symbol = element(name, tunables, f"task {task.name} has no tunable").variable
        except NameFault as fault:
            findings.add("AMX6741", fault.message, key.span, fault.hint)
            return None
        value = value_of(node.text, symbol.type) if is_plain_word(node) else None
        if value is None:
            message = f"{task.name}.{symbol.name} cannot be {kind_of(node)}: it takes {wanted(symbol.type)}"
            findings.add("AMX6736", message, node.span)
            return None
        try:
            task.tuning(symbol.name, value)
        except ValueError as error:
            findings.add("AMX6741", f"task {task.name}: {error}", node.span)
            return None
        target = LocalElement(task, Element(symbol))
        return Operate(target.label, partial(self.rack.adjust.tune, target, value))


def _forceable(rack: Rack, key: Scalar, findings: ProblemList) -> Target | None:
    """Return a variable that may be forced: a simple one that is not a STRING."""
    return _local(rack, key, findings) if "." in key.text else _common(rack, key, findings)


def _local(rack: Rack, key: Scalar, findings: ProblemList) -> LocalElement | None:
    if rack.part.is_elsewhere("task", key.text.partition(".")[0].strip().upper()):
        return None
    try:
        meant = local_named(rack.tasks, key.text)
    except NameFault as fault:
        findings.add("AMX6735", fault.message, key.span, cut_short(key.text) or fault.hint)
        return None
    if meant.why_not_forced is not None:
        findings.add("AMX6737", f"{meant.label} cannot be forced: {meant.why_not_forced}", key.span)
        return None
    return meant


def _common(rack: Rack, key: Scalar, findings: ProblemList) -> CommonElement | None:
    try:
        meant = rack.config.common(key.text)
    except NameFault as fault:
        findings.add("AMX6735", fault.message, key.span, cut_short(key.text) or fault.hint)
        return None
    if meant.name in PREDEFINED:
        findings.add("AMX6737", f"{meant.name} cannot be forced: the rack itself writes it", key.span)
        return None
    if meant.variable.is_array or meant.variable.type is DataType.STRING:
        kind = "an element of an array" if meant.variable.is_array else "a STRING"
        findings.add("AMX6737", f"{meant.label} is {kind}, which cannot be forced", key.span)
        return None
    return meant


def _force(rack: Rack, node: Node, what: str, findings: ProblemList) -> list[Action]:
    found: list[Action] = []
    for key, item in named(node, what, findings):
        meant = _forceable(rack, key, findings)
        value = value_for(item, meant.label, meant.variable, findings) if meant is not None else None
        if meant is not None and value is not None:
            found.append(Operate(meant.label, partial(rack.adjust.force, meant, value)))
    return found


def _unforce(rack: Rack, node: Node, what: str, findings: ProblemList) -> list[Action]:
    if isinstance(node, Scalar) and node.text == ALL:
        return [Operate("", rack.adjust.unforce)]
    variables = [_forceable(rack, name, findings) for name in names_of(node, what, findings)]
    return [Operate(item.label, partial(rack.adjust.unforce, [item])) for item in variables if item is not None]


@dataclass(frozen=True)
class _Sources:
    rack: Rack
    places: Places

    def reload(self, node: Node, what: str, findings: ProblemList) -> list[Action]:
        """Read tasks with a file, or with ``file`` and ``keep_state``."""
        tasks = _Tasks(self.rack)
        found: list[Action] = []
        for key, item in named(node, what, findings):
            task = tasks.task(key, findings)
            file, keep_state = self._file_and_state(item, f"{quoted(key.text)} of {what}", key, findings)
            source = self._source(file, task, findings) if file is not None and task is not None else None
            if task is not None and source is not None:
                found.append(Reload(task.name, source, keep_state, self.rack))
        return found

    def _file_and_state(self, node: Node, what: str, key: Scalar, findings: ProblemList) -> tuple[Scalar | None, bool]:
        if not isinstance(node, YamlMapping):
            return _file(node, what, findings), False
        section = Section(node, what, ("file", "keep_state"), findings)
        section.require(("file",), what, key.span)
        file, keep = section.get("file"), section.get("keep_state")
        keeps = boolean_value(keep, f"keep_state of {what}", findings) if keep is not None else False
        return _file(file, f"file of {what}", findings) if file is not None else None, bool(keeps)

    def _source(self, node: Scalar, task: Task, findings: ProblemList) -> SourceText | None:
        """Return a source, read now: later changes of the file have no effect (decision)."""
        text, suffix = node.text, Path(self.rack.sources[task.name].name).suffix.upper()
        if Path(text).suffix.upper() != suffix:
            message = f"{quoted(text)} cannot replace task {task.name}, whose source is a {suffix} file"
            findings.add("AMX6740", message, node.span)
            return None
        path = self.places.find(text)
        if path is None:
            message = f"{quoted(text)} lies outside the folders of the stimuli file and of the rack file"
            hint = "put it next to one of them, or allow it with --allow-outside"
            findings.add("AMX6740", message, node.span, hint)
            return None
        try:
            return read_task_source(path)
        except FileFault as fault:
            near = did_you_mean(path.name, (item.name for item in sorted(path.parent.glob(f"*{path.suffix}"))))
            findings.add("AMX6740", f"{quoted(text)} {fault}", node.span, near)
            return None


def _file(node: Node, what: str, findings: ProblemList) -> Scalar | None:
    is_text = text_value(node, what, findings, limit=_PATH_LIMIT) is not None
    return node if is_text and isinstance(node, Scalar) else None


def _power(rack: Rack, node: Node, what: str, findings: ProblemList) -> list[Action]:
    section = Section(node, what, ("off_for", "battery"), findings)
    section.require(("off_for",), what, node.span)
    off_for, battery = section.get("off_for"), section.get("battery")
    off_ns = time_of(off_for, f"off_for of {what}", findings) if off_for is not None else None
    good = boolean_value(battery, f"battery of {what}", findings) if battery is not None else True
    if off_ns is None or good is None:
        return []
    return [Operate("", partial(rack.operations.power, off_ns, battery=good))]
