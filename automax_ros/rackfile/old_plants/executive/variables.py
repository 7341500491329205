"""The variables of $SWVAR: name, type, size, memory, and the place on a module.

Type codes 32, 64 and 128 stand in J2-3106-1 p. F-4. Those of DOUBLE INTEGER and REAL are not known: what the tasks
declare decides, otherwise 16 and 8 are taken, by the row of powers (decision). Either is told.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from automax_ros.core.text import quoted
from automax_ros.core.types import DataType, bare_name, declaration_text, type_of_name
from automax_ros.rackfile.old_plants.executive.fields import Record
from automax_ros.rackfile.old_plants.executive.findings import Findings
from automax_ros.rackfile.old_plants.executive.sources import Declarations
from automax_ros.rackfile.reading.names import DeclarationFault, VariableName, is_reserved, variable_name

_CODES = {32: DataType.INTEGER, 64: DataType.BOOLEAN, 128: DataType.STRING}
_GUESSED = {16: DataType.DOUBLE, 8: DataType.REAL}
_WORDS = {
    word: kind
    for kind in DataType
    for word in (kind.word, kind.word[0], *({kind.value} - {""}), *(["INT"] if kind is DataType.INTEGER else []))
}
VOLATILE, NON_VOLATILE = 2, 3
"""Values of DEF_TYPE: variables of common memory; all others have 0 (J2-3106-1 p. F-4)."""
_DIMENSIONS = ("dim1", "dim2", "dim3", "dim4")


@dataclass(frozen=True)
class OldPlace:
    """Where a variable stands, as far as its record says: ``master`` is the slot in the rack itself.

    ``drop`` is one on remote I/O or of a network, 0 for none, ``slot`` that of the module, which is ``master`` in the
    rack itself.
    """

    master: int | None
    slot: int | None
    drop: int
    register: int | None
    bit: int | None
    port: int = 0

    def __str__(self) -> str:
        parts = (
            ("slot", self.master),
            ("drop", self.drop or None),
            ("port", self.port or None),
            ("slot there", self.slot if self.slot != self.master else None),
            ("register", self.register),
            ("bit", self.bit),
        )
        return ", ".join(f"{word} {value}" for word, value in parts if value is not None) or "no place"


@dataclass(frozen=True)
class OldVariable:
    """A variable: ``declared`` is None where no rack file can declare it, and ``reason`` says why.

    ``in_memory`` is whether it is in common memory, None where the record does not say. ``shown`` is its name as far as
    it can be read.
    """

    record: Record
    shown: str
    declared: VariableName | None
    in_memory: bool | None
    non_volatile: bool
    place: OldPlace
    description: str
    reason: str = ""

    @property
    def text(self) -> str:
        """The variable as COMMON and rack files declare it."""
        if self.declared is None:
            return self.shown
        return declaration_text(self.declared.name, self.declared.dimensions, self.declared.length)


def variables_of(
    records: Sequence[Record], network: Sequence[Record], declarations: Declarations, findings: Findings
) -> list[OldVariable]:
    """Return the variables of $SWVAR in their order; ``network`` are the records of $NET, for linked ones."""
    reading = _Reading(declarations, findings, {item.text("name").upper(): item.text("desc") for item in network})
    codes = reading.codes(records)
    found = [reading.variable(record, codes) for record in records]
    strings = (item for item in found if item.declared is not None and item.declared.type is DataType.STRING)
    first = next((item for item in strings if item.record.whole("length") == 0), None)
    if first is not None:
        message = f"{first.shown} has no length of its own: it gets the default of tasks, 31; the Executive prints 32"
        findings.add("AMX6792", message, first.record.file, first.record.number)
    return found


@dataclass
class _Reading:
    declarations: Declarations
    findings: Findings
    network: Mapping[str, str]

    def codes(self, records: Sequence[Record]) -> dict[int, DataType]:
        """Return the types of all codes that occur, and tell those that had to be found out."""
        by_code: defaultdict[int, list[Record]] = defaultdict(list)
        for record in records:
            code = record.whole("type")
            if code is not None:
                by_code[code].append(record)
        found: dict[int, DataType] = {}
        for code, own in sorted(by_code.items()):
            if code in _CODES:
                found[code] = _CODES[code]
                continue
            told = [(item, given) for item in own if (given := self.declarations.one(_bare(item))) is not None]
            kinds = {type_of_name(declared.name) for _, (declared, _) in told}
            first, message = own[0], f"type code {code} is not known"
            if len(kinds) == 1:
                found[code] = kinds.pop()
                first, (example, file) = told[0]
                message += f": taken for {found[code].word}, since {file} declares {example.name}"
            elif kinds:
                words = " and ".join(sorted(item.word for item in kinds))
                message += f": tasks declare its variables {words}; each is what its task declares"
            elif code in _GUESSED:
                found[code] = _GUESSED[code]
                message += f": taken for {found[code].word} by the row of powers; no task declares one of its variables"
            else:
                message += ", and no task declares one of its variables"
            self.findings.add("AMX6792", message, first.file, first.number)
        return found

    def variable(self, record: Record, codes: Mapping[int, DataType]) -> OldVariable:
        bare = _bare(record)
        memory = record.whole("memory")
        in_memory = None if memory is None else memory in (VOLATILE, NON_VOLATILE)
        own, linked = record.text("desc"), self.network.get(record.text("net_name").upper(), "")
        kind, reason = self._type(record, bare, codes)
        declared: VariableName | None = None
        if not reason:
            try:
                declared = variable_name(self._declaration(record, bare, kind))
            except DeclarationFault as fault:
                reason = fault.message
        if declared is not None and is_reserved(declared.name):
            reason = f"{declared.name} is a word of the language"
            declared = None
        shown = bare + kind.value if bare else "(no name)"
        description = linked or own
        return OldVariable(
            record, shown, declared, in_memory, memory == NON_VOLATILE, _place(record), description, reason
        )

    def _type(self, record: Record, bare: str, codes: Mapping[int, DataType]) -> tuple[DataType, str]:
        """Return a variable's type and, if it is not known, the reason."""
        name, code = record.text("name").upper().partition("(")[0], record.whole("type")
        given = self.declarations.one(bare)
        if bare_name(name) != name:
            return type_of_name(name), ""
        if code is not None and code in codes:
            return codes[code], ""
        word = record.text("type").upper()
        if code is None and word in _WORDS:
            return _WORDS[word], ""
        if given is not None:
            return type_of_name(given[0].name), ""
        return DataType.REAL, f"type {quoted(word)} is not known" if word else "its type is not known"

    def _declaration(self, record: Record, bare: str, kind: DataType) -> str:
        length = record.whole("length") or 0
        text = f"{bare}{kind.value}" + (f":{length}" if kind is DataType.STRING and length else "")
        if any(key in record.values for key in _DIMENSIONS):
            sizes = [str(size) for key in _DIMENSIONS if (size := record.whole(key) or 0) > 0]
        else:
            given = self.declarations.one(bare)
            sizes = [str(size) for size in given[0].subscripts] if given is not None else []
        inside = record.text("name").partition("(")[1:]
        return f"{text}({','.join(sizes)})" if sizes else text + "".join(inside)


def _bare(record: Record) -> str:
    return bare_name(record.text("name").upper().partition("(")[0].strip())


def _place(record: Record) -> OldPlace:
    slot, master, bit = record.whole("slot"), record.whole("mast_slot"), record.whole("bit")
    drop = record.whole("drop") or 0
    port = (record.whole("port") or 0) or (record.whole("loc_port") or 0)
    if master is None or (not drop and slot is not None):
        master = slot
    return OldPlace(
        master, slot, drop, record.whole("register"), bit if bit is not None and 0 <= bit <= 15 else None, port
    )
