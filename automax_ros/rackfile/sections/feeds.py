"""The key ``feeds`` of a plant or a web: its signals that instruments bring into commons."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from automax_ros.core.diagnostics import Diagnostic, Note, Span
from automax_ros.core.json_schema import Keys, Schema, entries, may_be_empty, section
from automax_ros.core.names import PREDEFINED, Element, NameFault
from automax_ros.core.names import element as element_named
from automax_ros.core.text import near_or_listed, printable
from automax_ros.core.types import DataType
from automax_ros.core.yaml_text import Node, Scalar
from automax_ros.drive.plant.signals import SIGNALS
from automax_ros.drive.web.signals import END_SIGNALS, WEB_SIGNALS
from automax_ros.language.program import Program, places_that_write
from automax_ros.rackfile.model.config import CommonVariable, RackConfig
from automax_ros.rackfile.model.module import ModuleConfig
from automax_ros.rackfile.model.plants import FeedConfig
from automax_ros.rackfile.reading.scale import SCHEMA as SCALE
from automax_ros.rackfile.reading.scale import Scale, scale_of
from automax_ros.rackfile.reading.values import (
    Key,
    ProblemList,
    Section,
    choice_key,
    entries_of,
    number_key,
    report_twice,
    schemas,
)

CODE = "AMX6479"
_ABSENT = "the rack has no common variable"
BROKEN = "broken"
"""The one signal that a BOOLEAN has."""


def _signal_key(owner: str, *known: str) -> Key[str]:
    hint = "it is one of a plant with roll: or roller:"
    return choice_key(
        "signal",
        "What the instrument shows.",
        {name: name for name in known},
        (CODE, f"{owner} has no signal {{given}}"),
        lambda word: hint if word in END_SIGNALS else near_or_listed(word, known),
    )


PLANT_SIGNAL, SURFACE_SIGNAL, WEB_SIGNAL = (
    _signal_key("a plant", *SIGNALS),
    _signal_key("a plant", *SIGNALS, *END_SIGNALS),
    _signal_key("a web", *WEB_SIGNALS),
)
"""The key ``signal`` of the feeds of a plant, of one with a roll or roller, and of a web."""
_USUAL_MS = 1.0
EVERY_MS = number_key("every_ms", "How often it is written, ms.", 0.1, 10_000.0, CODE, _USUAL_MS)
"""Range of ``every_ms``, 0.1 ms to 10 s, and its default, 1 ms (decision: an instrument is quicker than most scans)."""
KEYS: Keys = {**schemas(SURFACE_SIGNAL, EVERY_MS), "scale": SCALE}
"""The keys of a feed of a plant; those of a web differ in its signals."""
_FED = r"^[A-Za-z_][A-Za-z0-9_]{0,15}[%!]?\s*([(\[][0-9, ]*[)\]])?$"
SCHEMA: Schema = may_be_empty(
    entries("Signals of the plant into commons.", _FED, section("A feed.", KEYS, ("signal",)))
)
WEB_SCHEMA: Schema = may_be_empty(
    entries(
        "Signals of the web into commons.",
        _FED.replace("[%!]", "[%!@]"),
        section("A feed.", {**KEYS, **schemas(WEB_SIGNAL)}, ("signal",)),
    )
)


@dataclass(frozen=True)
class GivenFeeds:
    """The key ``feeds`` of the plant or web ``name`` in the file; ``signal`` is the key of the signals that it has."""

    name: str
    node: Node
    signal: Key[str]
    is_of_web: bool = False

    @property
    def owner(self) -> str:
        """The plant or web, in words."""
        return f"{'web' if self.is_of_web else 'plant'} {self.name}"


def read_feeds(
    given: Sequence[GivenFeeds],
    variables: Sequence[CommonVariable],
    modules: Sequence[ModuleConfig],
    findings: ProblemList,
) -> tuple[FeedConfig, ...]:
    """Return the feeds of all plants and webs; report errors in the findings.

    Commons with errors are not looked up.
    """
    reader = _FeedReader(variables, modules, findings)
    found = [
        reader.read(item, key, value)
        for item in given
        for key, value in entries_of(item.node, f"feeds of {item.owner}", findings) or ()
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

    def read(self, given: GivenFeeds, key: Scalar, node: Node) -> FeedConfig | None:
        findings = self._findings
        where = f"feed {printable(key.text)} of {given.owner}"
        section = Section(node, where, KEYS, findings)
        if not section.well_formed:
            return None
        section.require(("signal",), where, key.span)
        signal = section.read(given.signal)
        every_ms = section.read(EVERY_MS) if EVERY_MS.name in section else _USUAL_MS
        target = self._target(key, where, signal)
        if target is None:
            return None
        scale = self._scale(section, target.variable, where, key.span, signal)
        if signal is None or every_ms is None:
            return None
        every_ns = round(every_ms * 1e6)
        line = key.span.line
        return FeedConfig(given.name, target.name, target.index, signal, every_ns, scale, line, given.is_of_web)

    def _target(self, key: Scalar, where: str, signal: str | None) -> Element[CommonVariable] | None:
        """Return the common that a feed writes, None (reported) if it may not."""
        findings = self._findings
        try:
            found = element_named(key.text, self._variables, _ABSENT)
        except NameFault as fault:
            if self._is_whole:
                findings.add(CODE, f"{where}: {fault.message}", key.span, fault.hint)
            return None
        why = self._why_not(found.variable, signal)
        if why:
            findings.add(CODE, f"{where}: {found.label} {why}", key.span)
            return None
        if found.label in self._fed:
            report_twice(key, f"the feed of {found.label}", self._fed[found.label], findings)
            return None
        self._fed[found.label] = key.span
        return found

    def _why_not(self, variable: CommonVariable, signal: str | None) -> str:
        if variable.type is DataType.STRING or (variable.type is DataType.BOOLEAN and signal not in (BROKEN, None)):
            return f"is a {variable.type.word}: a signal is a number"
        if variable.name in PREDEFINED:
            return "is written by the rack itself"
        point = variable.point
        if point is not None and self._registers[point.slot].direction(point.register) == "output":
            return "stands on an output: only tasks write it"
        if point is not None and point.register in self._registers[point.slot].shown:
            return "is written by its module itself"
        return ""

    def _scale(
        self, section: Section, variable: CommonVariable, where: str, span: Span, signal: str | None
    ) -> Scale | None:
        """Return the scale of the counts: the feed's, else the common's own (decision).

        Without either an INTEGER has ``broken`` as 0 or 1.
        """
        node = section.get("scale")
        if node is not None:
            return scale_of(node, variable.name, variable.type, span, self._findings)
        if variable.type.is_integer and variable.scale is None and signal != BROKEN:
            message = f"{where} has no scale: what is a count of {variable.name}?"
            hint = "for example scale: {counts: [-4095, 4095], value: [-1750.0, 1750.0]}"
            self._findings.add(CODE, message, span, hint)
        return variable.scale


def feed_findings(config: RackConfig, programs: Mapping[str, Program]) -> dict[str, list[Diagnostic]]:
    """Return the places where a task writes a common that a plant or web feeds (AMX6500), by task."""
    fed = {feed.common: feed for feed in config.feeds}
    found: dict[str, list[Diagnostic]] = {}
    for program in programs.values():
        for name, places in places_that_write(program).items():
            feed = fed.get(name)
            if feed is not None:
                line, span = places[0]
                message = f"{name} is written here, and {feed.owner} feeds it"
                notes = (Note(f"its feed stands in line {feed.line} of {config.path.name}", span),)
                hint = "a feed is an instrument: no task writes it"
                found.setdefault(program.name, []).append(Diagnostic("AMX6500", message, span, line, hint, notes))
    return found
