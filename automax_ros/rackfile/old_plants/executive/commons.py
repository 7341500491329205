"""The variables of $SWVAR in the rack file: with their places on modules, or as plain commons, or as comments."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from automax_ros.core.text import quoted
from automax_ros.core.types import DataType
from automax_ros.core.yaml_text import flow_text
from automax_ros.rackfile.modules.registry import SUPPORTED
from automax_ros.rackfile.old_plants.executive.document import Entry
from automax_ros.rackfile.old_plants.executive.findings import Unplaced
from automax_ros.rackfile.old_plants.executive.parts import NETWORK, PROCESSORS, OldModule, is_memory
from automax_ros.rackfile.old_plants.executive.variables import OldVariable
from automax_ros.rackfile.old_plants.net_files import quoted_for
from automax_ros.rackfile.sections.commons import DESCRIPTION_LIMIT


@dataclass(frozen=True)
class CommonEntries:
    """Makes the entries of variables; ``net_lines`` are lines of .NET files, as ``net_files.net_lines`` has them."""

    modules: Mapping[int, OldModule]
    net_lines: Mapping[str, str]
    unplaced: Unplaced

    def entries(self, variables: Sequence[OldVariable]) -> list[Entry]:
        """Return the entries in the order of the variables; ``unplaced`` gets those that have no place."""
        seen: set[str] = set()
        entries: list[Entry] = []
        for variable in variables:
            entry = self._common(variable)
            if variable.declared is None:
                entry.plain = ""
                entry.lessen(variable.reason)
                reason = f"no rack file can declare {variable.shown}: {variable.reason}"
                self.unplaced.add(entry.file, reason, entry.record, lost=True)
            elif variable.declared.name in seen:
                entry.plain = ""
                entry.lessen("the name is defined before")
                reason = f"a variable of the name {variable.declared.name} is defined before"
                self.unplaced.add(entry.file, reason, entry.record, lost=True)
            seen.add(variable.declared.name if variable.declared is not None else "")
            entries.append(entry)
        return entries

    def _common(self, variable: OldVariable) -> Entry:
        record = variable.record
        options = [f"description: {flow_text(self._description(variable))}"] if variable.description else []
        plain = f"{variable.text}: {{{', '.join(options)}}}"
        if variable.non_volatile:
            options.insert(0, "non_volatile: true")
        where, reason = self._where(variable)
        options[:0] = where
        entry = Entry(f"{variable.text}: {{{', '.join(options)}}}", record.file, record.number, plain=plain)
        if variable.in_memory is not True:
            entry.detail = f"{variable.place}{quoted_for(variable.shown, self.net_lines)}"
        if reason:
            entry.lessen(reason)
            self.unplaced.add(record.file, f"a plain common: {reason}", record.number)
        return entry

    def _description(self, variable: OldVariable) -> str:
        """Return a variable's description as long as a rack file may have one; one that is cut is told."""
        if len(variable.description) > DESCRIPTION_LIMIT:
            reason = f"the end of the description, which has more than {DESCRIPTION_LIMIT} characters, is left out"
            self.unplaced.add(variable.record.file, reason, variable.record.number)
        return quoted(variable.description, marks="", limit=DESCRIPTION_LIMIT)

    def _where(self, variable: OldVariable) -> tuple[list[str], str]:
        """Return the keys of a variable's place, none for common memory, and why it lacks the place it should have."""
        place = variable.place
        module = self.modules.get(-1 if place.master is None else place.master)
        if variable.in_memory is True or variable.declared is None:
            return [], ""
        holds_memory = module is not None and (module.model in PROCESSORS or is_memory(module))
        if variable.in_memory is None and (place.register is None or (holds_memory and not place.register)):
            return [], ""
        if place.register is None or place.master is None:
            return [], "its slot or its register is not known"
        if module is None:
            there = "; with its drop it is on a network, remote I/O or a gateway" if place.drop else ""
            return [], f"its slot has no module{there}"
        is_network = module.model == NETWORK
        if place.drop and not is_network:
            return [], "it is on remote I/O or a gateway"
        if module.model not in SUPPORTED:
            return [], "the module in its slot is not known or not emulated"
        keys = [f"slot: {place.master}", f"register: {place.register}"]
        if is_network:
            keys.insert(1, f"drop: {place.drop}")
        if variable.declared.type is DataType.BOOLEAN and place.bit is not None:
            keys.append(f"bit: {place.bit}")
        return keys, ""
