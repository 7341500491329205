"""Reads a stimuli file: a list of entries, each a time and a verb. All errors in it are found before a run.

A file has at most 2,000,000 bytes and 50,000 entries (decision: it is untrusted, and is read as a whole).
"""

from __future__ import annotations

import codecs
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from automax_ros.core.diagnostics import Diagnostic, SourceText, Span
from automax_ros.core.text import near_or_listed, quoted
from automax_ros.core.yaml_text import Node, Scalar, YamlSequence, read_yaml
from automax_ros.core.yaml_text import YamlMapping as Keys
from automax_ros.rack.rack import Rack
from automax_ros.rackfile.reading.files import FileFault, read_bytes
from automax_ros.rackfile.reading.values import ProblemList, kind_of, report_twice
from automax_ros.runtime.tasks.standalone_task import StandaloneTask
from automax_ros.scenario.stimuli.player import Stimulus
from automax_ros.scenario.stimuli.rack_verbs import rack_verbs
from automax_ros.scenario.stimuli.schema import MOST_ENTRIES, VERB_SCHEMAS
from automax_ros.scenario.stimuli.signals import LoneSignals
from automax_ros.scenario.stimuli.table import Places, table_verb
from automax_ros.scenario.stimuli.values import VALUE_VERBS, StimuliVerb, time_of, value_verbs

MOST_BYTES = 2_000_000
_MOST_NODES = 1_000_000
_START = Span(1, 1, 2)
_FORM = "write {at: 0.5, set: {REF%: 1500}}: a time in seconds and one verb"
RACK_ONLY = tuple(name for name in VERB_SCHEMAS if name not in VALUE_VERBS)
"""Verbs that a lone task does not have: it has no operator and no modules."""


@dataclass(frozen=True)
class StimuliFile:
    """Result of reading a file: its entries in their order, None with errors. Diagnostics refer to ``source``."""

    stimuli: tuple[Stimulus, ...] | None
    diagnostics: list[Diagnostic]
    source: SourceText

    @property
    def is_text(self) -> bool:
        """Whether the file could be read as text."""
        return not any(item.code == "AMX6730" for item in self.diagnostics)


def read_for_rack(path: Path, rack: Rack, *, allow_outside: bool = False) -> StimuliFile:
    """Read a file for a built rack; it may use all verbs."""
    return _read(path, rack_verbs(rack, path, allow_outside=allow_outside), ())


def read_for_task(path: Path, lone: StandaloneTask) -> StimuliFile:
    """Read a file for a lone task: set, ramp, sine, square and table on its variables."""
    signals = LoneSignals(lone)
    return _read(path, {**value_verbs(signals), "table": table_verb(signals, Places((path,)))}, RACK_ONLY)


def _read(path: Path, verbs: Mapping[str, StimuliVerb], elsewhere: tuple[str, ...]) -> StimuliFile:
    findings = ProblemList()
    source = SourceText(str(path), _text_of(path, findings))
    root = None
    if not findings.errors:
        root = read_yaml(source.text, findings.yaml_flaw, "a stimuli file", nodes=_MOST_NODES)
    stimuli = _Reader(verbs, elsewhere, findings).read(root) if root is not None else ()
    if not stimuli and not findings.errors:
        findings.add("AMX6744", "the stimuli file has no entries and would have no effect", _START)
    return StimuliFile(None if findings.errors else tuple(stimuli), findings.in_order(), source)


def _text_of(path: Path, findings: ProblemList) -> str:
    try:
        return read_bytes(path, MOST_BYTES).removeprefix(codecs.BOM_UTF8).decode()
    except FileFault as fault:
        findings.add("AMX6730", f"the stimuli file {fault}", _START)
    except UnicodeDecodeError as error:
        hint = "save the file as UTF-8"
        findings.add("AMX6730", f"the stimuli file is not UTF-8: byte {error.start} is not", _START, hint)
    return ""


@dataclass(frozen=True)
class _Reader:
    verbs: Mapping[str, StimuliVerb]
    elsewhere: tuple[str, ...]
    findings: ProblemList

    def read(self, root: Node) -> list[Stimulus]:
        """Return the entries of a file; an empty file has none."""
        if isinstance(root, Scalar) and root.is_null:
            return []
        if not isinstance(root, YamlSequence):
            self.findings.add("AMX6731", f"a stimuli file is a list of entries, not {kind_of(root)}", root.span, _FORM)
            return []
        if len(root.items) > MOST_ENTRIES:
            message = f"the file has {len(root.items)} entries; at most {MOST_ENTRIES} are read"
            self.findings.add("AMX6743", message, root.items[MOST_ENTRIES].span)
        found = (self._entry(node) for node in root.items[:MOST_ENTRIES])
        return [entry for entry in found if entry is not None]

    def _entry(self, node: Node) -> Stimulus | None:
        if not isinstance(node, Keys):
            self.findings.add("AMX6731", f"an entry has a time and a verb; this is {kind_of(node)}", node.span, _FORM)
            return None
        keys: dict[str, tuple[Scalar, Node]] = {}
        for key, value in node.entries:
            if key.text in keys:
                report_twice(key, f"{quoted(key.text)} of an entry", keys[key.text][0].span, self.findings)
            else:
                keys[key.text] = key, value
        at = keys.pop("at", None)
        if at is None:
            self.findings.add("AMX6731", "the entry has no time 'at'", node.span, _FORM)
        at_ns = time_of(at[1], "at", self.findings) if at is not None else None
        return self._with_verb(node, at_ns, list(keys.values()))

    def _with_verb(self, node: Keys, at_ns: int | None, given: list[tuple[Scalar, Node]]) -> Stimulus | None:
        if not given:
            self.findings.add("AMX6731", "the entry has no verb", node.span, _FORM)
        for key, _ in given[1:]:
            message = f"the entry has two verbs, {quoted(given[0][0].text)} and {quoted(key.text)}"
            self.findings.add("AMX6731", message, key.span, "give each verb an entry of its own, with its time")
        if not given:
            return None
        key, value = given[0]
        verb = self.verbs.get(key.text)
        if verb is None:
            self._report_unknown(key)
            return None
        actions = verb.read(value, key.text, self.findings)
        if at_ns is None:
            return None
        return Stimulus(at_ns, key.text, key.span.line, tuple(actions), verb.is_value, verb.is_value or verb.everywhere)

    def _report_unknown(self, key: Scalar) -> None:
        if key.text in self.elsewhere:
            message = f"a task alone has no {quoted(key.text)}: only a rack does (`automax run`)"
            self.findings.add("AMX6733", message, key.span, f"it has {', '.join(self.verbs)}")
            return
        hint = near_or_listed(key.text, self.verbs)
        self.findings.add("AMX6732", f"there is no verb {quoted(key.text)}", key.span, hint)
