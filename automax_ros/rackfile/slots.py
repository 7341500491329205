"""The slots of a rack and their modules. The kind of a module defines its keys and its allowed slots."""

from __future__ import annotations

import re

from automax_ros.core.diagnostics import Note, Span
from automax_ros.core.json_schema import Schema, either, entries, section
from automax_ros.core.text import quoted
from automax_ros.core.yaml_text import Mapping, Node, Scalar
from automax_ros.rackfile.model.config import MAX_SLOT
from automax_ros.rackfile.model.module import ModuleConfig
from automax_ros.rackfile.modules.kind import ModuleSection, PlacedModule, RackLayout
from automax_ros.rackfile.modules.registry import KINDS, NOT_YET, REFUSED, SUPPORTED, module_number, spellings
from automax_ros.rackfile.reading.values import Entry, ProblemList, Section, entries_of, text_value, wrong_kind
from automax_ros.rackfile.sections.plants import Plants
from automax_ros.rackfile.sections.tasks import TaskReader

_SLOT = re.compile(r"[0-9]{1,3}\Z")
SCHEMA: Schema = entries(
    "What stands in the rack, by slots 0 to 15.",
    f"^0*({'|'.join(map(str, range(MAX_SLOT + 1)))})$",
    either(
        "A module.",
        *(
            section(f"{model}: {text}.", {"module": spellings(model), **kind.options}, ("module",))
            for kind in KINDS
            for model, text in kind.models.items()
        ),
    ),
)


class SlotReader:
    """Reads the ``slots`` section."""

    def __init__(self, tasks: TaskReader, findings: ProblemList, executive: int, plants: Plants) -> None:
        """Create from the reader of tasks, which knows the names of the whole rack, and the Executive's version."""
        self._executive, self._plants, self._tasks, self._findings = executive, plants, tasks, findings
        self._placed: dict[int, PlacedModule] = {}
        self._places: dict[int, Span] = {}
        self._complete = True
        self.unread: frozenset[int] = frozenset()

    def read(self, node: Node, span: Span) -> tuple[ModuleConfig, ...]:
        """Return the modules without errors, in the order of slots; ``span`` is the place of the key ``slots``.

        ``unread`` are then the slots of the others: their errors are reported, and consequences of these need not be.
        """
        entries = entries_of(node, "slots", self._findings)
        if entries is None:
            return ()
        modules: list[ModuleConfig] = []
        for key, value in entries:
            slot = self._slot(key)
            if slot is None:
                continue
            self._places[slot] = key.span
            module = self._module(slot, key, value)
            self._complete = self._complete and module is not None
            if module is not None:
                modules.append(module)
        in_order = tuple(sorted(modules, key=lambda item: item.slot))
        self.unread = frozenset(self._places) - {item.slot for item in modules}
        rack = RackLayout(list(self._placed.values()), self._complete, span, self._findings, in_order)
        for kind in KINDS:
            kind.check_places(rack)
        return in_order

    def _slot(self, key: Scalar) -> int | None:
        if not _SLOT.match(key.text) or not 0 <= int(key.text) <= MAX_SLOT:
            self._complete = False
            self._findings.add("AMX6200", f"{quoted(key.text)} is not a slot; slots are 0 to {MAX_SLOT}", key.span)
            return None
        slot = int(key.text)
        if slot not in self._places:
            return slot
        first = self._places[slot]
        held = f"holds {_describe(self._placed[slot])}" if slot in self._placed else "is defined"
        message = f"slot {slot} already {held} (line {first.line})"
        self._findings.add("AMX6201", message, key.span, notes=(Note("first defined here", first),))
        return None

    def _module(self, slot: int, key: Scalar, node: Node) -> ModuleConfig | None:
        what = f"slot {slot}"
        if not isinstance(node, Mapping):
            given = module_number(node.text) if isinstance(node, Scalar) and len(node.text) < 10 else ""
            hint = f"write {{module: {given if given in SUPPORTED else '57C435'}}}"
            wrong_kind(node, what, "keys and values", self._findings, hint)
            return None
        model = self._model(node.entries, what, key)
        if model is None:
            return None
        kind = SUPPORTED[model]
        placed = self._placed[slot] = PlacedModule(slot, model, kind, key.span)
        known, what = ("module", *kind.options), _describe(placed)
        section = Section(node.entries, what, known, self._findings, owner=f"{what} in slot {slot}")
        return kind.read(ModuleSection(slot, model, section, key.span, self._tasks, self._executive, self._plants))

    def _model(self, entries: tuple[Entry, ...], what: str, key: Scalar) -> str | None:
        """Return the number of an emulated module; report AMX6202 to AMX6204 and AMX6211 for others."""
        node = next((value for name, value in entries if name.text == "module"), None)
        if node is None:
            self._findings.add("AMX6009", f"{what} lacks the key 'module'", key.span)
            return None
        text = text_value(node, f"module of {what}", self._findings, limit=20)
        if text is None:
            return None
        model = module_number(text)
        if model in SUPPORTED:
            return model
        if model in REFUSED:
            code, message, hint = REFUSED[model]
            self._findings.add(code, message, node.span, hint)
        elif model in NOT_YET:
            self._findings.add("AMX6203", f"the {model} ({NOT_YET[model]}) is not supported yet", node.span)
        else:
            hint = f"the emulator has {', '.join(SUPPORTED)}"
            self._findings.add("AMX6202", f"{quoted(text)} is not a module that the emulator knows", node.span, hint)
        return None


def _describe(placed: PlacedModule) -> str:
    return f"{placed.kind.word} {placed.model}"
