"""The key ``feeds`` of a plant: its signals into commons, as instruments would bring them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from automax_ros.core.diagnostics import Diagnostic, Note, Span
from automax_ros.core.names import PREDEFINED, Element, NameFault
from automax_ros.core.names import element as element_named
from automax_ros.core.text import near_or_listed, printable, quoted
from automax_ros.core.types import DataType
from automax_ros.core.yaml_text import Node, Scalar
from automax_ros.drive.plant.signals import SIGNALS
from automax_ros.language.program import Program, places_that_write
from automax_ros.rackfile.model.config import CommonVariable, RackConfig
from automax_ros.rackfile.model.module import ModuleConfig
from automax_ros.rackfile.model.plants import FeedConfig
from automax_ros.rackfile.reading.names import VariableName
from automax_ros.rackfile.reading.scale import Scale, scale_of
from automax_ros.rackfile.reading.values import ProblemList, Section, entries_of, number_value, report_twice, text_value
from automax_ros.rackfile.sections.plant_keys import FEED_KEYS, LEAST_MS, MOST_MS, USUAL_MS

CODE = "AMX6479"
_ABSENT = "the rack has no common variable"


def read_feeds(
    given: Sequence[tuple[str, Node]],
    variables: Sequence[CommonVariable],
    modules: Sequence[ModuleConfig],
    findings: ProblemList,
) -> tuple[FeedConfig, ...]:
    """Return the feeds of all plants; what is wrong goes to the findings. Commons with errors are not looked for."""
    reader = _FeedReader(variables, modules, findings)
    found = [
        reader.read(plant, key, value)
        for plant, node in given
        for key, value in entries_of(node, f"feeds of plant {plant}", findings) or ()
    ]
    return tuple(feed for feed in found if feed is not None)


class _FeedReader:
    def __init__(
        self, variables: Sequence[CommonVariable], modules: Sequence[ModuleConfig], findings: ProblemList
    ) -> None:
        self._variables = {variable.name: variable for variable in variables}
        self._registers = {module.slot: module.registers for module in modules}
        self._findings = findings
        self._is_whole = not findings.errors
        self._fed: dict[str, Span] = {}

    def read(self, plant: str, key: Scalar, node: Node) -> FeedConfig | None:
        """Return one feed, None where there was something to report."""
        findings = self._findings
        where = f"feed {printable(key.text)} of plant {plant}"
        entries = entries_of(node, where, findings)
        if entries is None:
            return None
        section = Section(entries, where, FEED_KEYS, findings)
        signal = self._signal(section, where, key.span)
        every_ms = self._every_ms(section.get("every_ms"), where)
        target = self._target(key, where)
        if target is None:
            return None
        scale = self._scale(section, target.variable, where, key.span)
        if signal is None or every_ms is None:
            return None
        every_ns = round(every_ms * 1e6)
        return FeedConfig(plant, target.name, target.index, signal, every_ns, scale, key.span.line)

    def _signal(self, section: Section, where: str, span: Span) -> str | None:
        if not section.require(("signal",), where, span, self._findings):
            return None
        node = section.get("signal")
        text = text_value(node, f"signal of {where}", self._findings, limit=100) if node is not None else None
        if node is not None and text is not None and text not in SIGNALS:
            message = f"a plant has no signal {quoted(text)}"
            self._findings.add(CODE, message, node.span, near_or_listed(text, SIGNALS))
            return None
        return text

    def _every_ms(self, node: Node | None, where: str) -> float | None:
        if node is None:
            return USUAL_MS
        return number_value(node, f"every_ms of {where}", self._findings, low=LEAST_MS, high=MOST_MS, code=CODE)

    def _target(self, key: Scalar, where: str) -> Element[CommonVariable] | None:
        """Return the common that a feed writes, None (reported) where it cannot."""
        findings = self._findings
        try:
            found = element_named(key.text, self._variables, _ABSENT)
        except NameFault as fault:
            if self._is_whole:
                findings.add(CODE, f"{where}: {fault.message}", key.span, fault.hint)
            return None
        why = self._why_not(found.variable)
        if why:
            findings.add(CODE, f"{where}: {found.label} {why}", key.span)
            return None
        if found.label in self._fed:
            report_twice(key, f"the feed of {found.label}", self._fed[found.label], findings)
            return None
        self._fed[found.label] = key.span
        return found

    def _why_not(self, variable: CommonVariable) -> str:
        if variable.type in (DataType.BOOLEAN, DataType.STRING):
            return f"is a {variable.type.word}: a signal is a number"
        if variable.name in PREDEFINED:
            return "is written by the rack itself"
        point = variable.point
        if point is not None and self._registers[point.slot].direction(point.register) == "output":
            return "stands on an output: only tasks write it"
        if point is not None and point.register in self._registers[point.slot].shown:
            return "is written by its module itself"
        return ""

    def _scale(self, section: Section, variable: CommonVariable, where: str, span: Span) -> Scale | None:
        """Return what counts mean: as the feed says, else as the common itself does (decision)."""
        node = section.get("scale")
        if node is not None:
            return scale_of(node, VariableName(variable.name, variable.type, 0, ()), span, self._findings)
        if variable.type.is_integer and variable.scale is None:
            message = f"{where} has no scale: what is a count of {variable.name}?"
            hint = "for example scale: {counts: [-4095, 4095], value: [-1750.0, 1750.0]}"
            self._findings.add(CODE, message, span, hint)
        return variable.scale


def feed_findings(config: RackConfig, programs: Mapping[str, Program]) -> dict[str, list[Diagnostic]]:
    """Return the places where a task writes a common that a plant feeds (AMX6500), by task."""
    fed = {feed.common: feed for feed in config.feeds}
    return {program.name: list(_written(config, fed, program)) for program in programs.values() if fed}


def _written(config: RackConfig, fed: Mapping[str, FeedConfig], program: Program) -> Iterable[Diagnostic]:
    for name, places in places_that_write(program).items():
        feed = fed.get(name)
        if feed is not None:
            line, span = places[0]
            message = f"{name} is written here, and plant {feed.plant} feeds it"
            notes = (Note(f"its feed stands in line {feed.line} of {config.path.name}", span),)
            yield Diagnostic("AMX6500", message, span, line, "a feed is an instrument: no task writes it", notes)
