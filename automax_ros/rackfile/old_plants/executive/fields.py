"""The tables of the Executive, and the names that their fields have or may have: nothing goes by a field's position.

Names that stand in J2-3106-1 appendix F and J2-3045 appendix E come first. No source at hand names the fields of $SWVAR
apart from CARD_TYPE and DEF_TYPE, nor those of $NET and $PARAM, nor WIRE_NOTE2: further names are guesses (decision).
``--field`` replaces them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from automax_ros.core.text import did_you_mean, printable, quoted
from automax_ros.core.user_error import UserError
from automax_ros.rackfile.old_plants.executive.dbase import Column, DbaseTable, Value
from automax_ros.rackfile.old_plants.executive.findings import Findings, records_text

Aliases = Mapping[str, tuple[str, ...]]
_PLACE: Aliases = {
    "mast_slot": ("MAST_SLOT", "MASTER_SLT", "M_SLOT"),
    "drop": ("REM_DROP", "DROP"),
    "port": ("PORT",),
    "loc_port": ("LOC_PORT",),
    "level": ("LEVEL",),
}
_WHO: Aliases = {"desc": ("DESC", "DESCR", "DESCRIPT", "COMMENT"), "engineer": ("ENGINEER",)}
_VARIABLE: Aliases = {
    "name": ("NAME", "VAR_NAME", "VARNAME", "ID", "SYMBOL", "LOC_NAME"),
    "type": ("VAR_TYPE", "TYPE", "DATA_TYPE", "VARTYPE"),
    "register": ("REGISTER", "REG", "REG_NUM", "REG_NO", "REGNUM"),
    "bit": ("BIT", "BIT_NUM", "BIT_NO", "BITNUM"),
}
TABLES: Mapping[str, Aliases] = {
    "SYSTEM": {"id": ("ID",), "customer": ("CUSTOMER",), "version": ("SYSTEM_VER",), **_WHO},
    "SECT": {"id": ("ID",), **_WHO},
    "RACK": {"id": ("ID",), "section": ("SECT_ID",), "part": ("RACK_PART",), "location": ("LOCATION",), **_WHO},
    "IORACK": {**_PLACE, "part": ("RACK_PART",), "location": ("LOCATION",), **_WHO},
    "CARD": {
        **_PLACE,
        "slot": ("SLOT",),
        "part": ("CARD_PART",),
        "network": ("NETWORK",),
        "depth": ("NET_DEPTH",),
        "net_drop": ("NET_DROP",),
        "note1": ("WIRE_NOTE1",),
        "note2": ("WIRE_NOTE2",),
        **_WHO,
    },
    "TASKS": {
        "name": ("NAME",),
        "type": ("TYPE",),
        "slot": ("SLOT",),
        "priority": ("PRIORITY",),
        "critical": ("CRITICAL",),
        "reconstr": ("RECONSTR",),
        "utility": ("UTILITY",),
        "drive": ("DRIVE", "DRIVE_ID"),
        **_WHO,
    },
    "SWVAR": {
        **_VARIABLE,
        "length": ("CARD_TYPE",),
        "memory": ("DEF_TYPE",),
        **_PLACE,
        "slot": ("SLOT",),
        "dim1": ("DIM1", "SUB1", "DIM_1", "SUBSCR1"),
        "dim2": ("DIM2", "SUB2", "DIM_2", "SUBSCR2"),
        "dim3": ("DIM3", "SUB3", "DIM_3", "SUBSCR3"),
        "dim4": ("DIM4", "SUB4", "DIM_4", "SUBSCR4"),
        "net_name": ("NET_NAME", "NETNAME", "NET_ID"),
        **_WHO,
    },
    "NET": {**_VARIABLE, "network": ("NETWORK",), "drop": ("DROP", "NET_DROP"), **_WHO},
    "PARAM": {"slot": ("SLOT", "MAST_SLOT"), "drive": ("DRIVE",), "type": ("REC_TYPE", "TYPE"), "data": ("DATA",)},
}
"""What the importer knows of each table, with the names of the field in the order in which they are looked for."""
NEEDED: Mapping[str, tuple[str, ...]] = {
    "CARD": ("slot", "part"),
    "TASKS": ("name", "type", "slot", "priority"),
    "SWVAR": ("name",),
}
"""Fields without which a table is of no use."""
PLACES = ("slot", "register", "bit", "memory")
"""Fields of $SWVAR without which variables have no place on a module, or none that is sure."""
SYSTEM_TABLES = ("SYSTEM", "SECT", "RACK", "NET")
RACK_TABLES = ("CARD", "IORACK", "TASKS", "SWVAR", "PARAM")
_SAMPLES = 3
_SAMPLE_LENGTH = 20


@dataclass(frozen=True)
class FieldChoice:
    """A field that the user names: ``--field CARD.note2=LOW_TICK``; the table is SWVAR where none is given."""

    table: str
    key: str
    field: str


def field_choice(text: str) -> FieldChoice:
    """Return the choice in ``register=REG_NUM`` or ``CARD.note2=LOW_TICK``.

    Raises:
        UserError: it has another form, or there is no such table or key.
    """
    left, mark, name = text.partition("=")
    table, dot, key = left.rpartition(".")
    table = table.upper().removeprefix("$") if dot else "SWVAR"
    key = key.lower().strip()
    if not mark or not name.strip():
        raise UserError(f"{quoted(text)} is not a key and a field", "for example --field register=REG_NUM")
    if table not in TABLES:
        raise UserError(f"{quoted(text)}: there is no table {quoted(table)}", f"there are {', '.join(TABLES)}")
    if key not in TABLES[table]:
        hint = did_you_mean(key, TABLES[table]) or f"${table} has {', '.join(TABLES[table])}"
        raise UserError(f"{quoted(text)}: {quoted(key)} is nothing that ${table} has", hint)
    return FieldChoice(table, key, name.strip().upper())


@dataclass(frozen=True)
class Record:
    """A record that is not deleted, its values by the keys of ``TABLES``."""

    file: str
    number: int
    values: Mapping[str, Value] = field(default_factory=dict)

    def text(self, key: str) -> str:
        """Return a value as text without blanks around it, "" where there is none."""
        value = self.values.get(key)
        return "" if value is None or isinstance(value, bool) else printable(str(value)).strip()

    def whole(self, key: str) -> int | None:
        """Return a value as a whole number, None where it is not one."""
        value = self.values.get(key)
        if isinstance(value, str):
            text = value.strip()
            return int(text) if text.isascii() and text.lstrip("-").isdecimal() and len(text) < 10 else None
        return value if isinstance(value, int) and not isinstance(value, bool) else None

    def flag(self, key: str) -> bool:
        """Return whether a value is TRUE."""
        return self.values.get(key) is True

    @property
    def place(self) -> str:
        """The record in comments: ``$CARD.DBF record 3``."""
        return f"{printable(self.file)} record {self.number}"


def columns_of(table: DbaseTable, name: str, choices: Sequence[FieldChoice], findings: Findings) -> dict[str, Column]:
    """Return the fields of a table by their keys; a choice without its field is told (AMX6793)."""
    by_name = {column.name: column for column in table.columns}
    found: dict[str, Column] = {}
    chosen = {item.key: item.field for item in choices if item.table == name}
    for key, aliases in TABLES[name].items():
        wanted = (chosen[key],) if key in chosen else tuple(item for item in aliases if item not in chosen.values())
        if key in chosen and chosen[key] not in by_name:
            hint = did_you_mean(chosen[key], by_name) or f"it has {', '.join(by_name)}"
            message = f"the table has no field {quoted(chosen[key])}, which --field names for {key}"
            findings.add("AMX6793", message, table.file, hint=hint)
        column = next((by_name[item] for item in wanted if item in by_name), None)
        if column is not None and column not in found.values():
            found[key] = column
    return found


def records_of(table: DbaseTable, name: str, choices: Sequence[FieldChoice], findings: Findings) -> list[Record]:
    """Return the records of a table, in their order; deleted ones, unknown fields and damaged values are told."""
    columns = columns_of(table, name, choices, findings)
    _tell_deleted(table, findings)
    rows = table.present
    for key in NEEDED.get(name, ()):
        if key not in columns and rows:
            free = [column.name for column in table.columns if column not in columns.values()]
            field_name = free[0] if len(free) == 1 else "FIELD"
            hint = f"name the field: --field {name}.{key}={field_name}"
            hint += f", one of {', '.join(free)}" if len(free) > 1 else ""
            message = f"no field is known to be the {key}: the {len(rows)} records cannot be used"
            findings.add("AMX6789", message, table.file, hint=hint)
    if any(key not in columns for key in NEEDED.get(name, ())):
        return []
    _tell_unknown(table, name, columns, findings)
    values: list[dict[str, Value]] = [{} for _ in rows]
    for key, column in columns.items():
        wrong: list[tuple[int, str]] = []
        for row, into in zip(rows, values, strict=True):
            into[key], fault = table.value(row, column)
            if fault:
                wrong.append((row.number, fault))
        if wrong:
            numbers = records_text(number for number, _ in wrong)
            kind = "T or F" if column.kind == "L" else "a number"
            message = f"{column.name} of {numbers} is not {kind}, but {quoted(wrong[0][1])}: taken as blank"
            findings.add("AMX6792", message, table.file, wrong[0][0])
    _tell_code_page(table, columns, findings)
    return [Record(table.file, row.number, into) for row, into in zip(rows, values, strict=True)]


def _tell_deleted(table: DbaseTable, findings: Findings) -> None:
    deleted = [row.number for row in table.rows if row.deleted]
    if deleted:
        verb = "is" if len(deleted) == 1 else "are"
        message = f"{records_text(deleted)} {verb} marked as deleted and left out"
        findings.add("AMX6791", message, table.file, deleted[0])


def _tell_unknown(table: DbaseTable, name: str, columns: Mapping[str, Column], findings: Findings) -> None:
    for key in PLACES if name == "SWVAR" else ():
        if key not in columns and table.rows:
            hint = f"if the table has one: --field {key}=FIELD; automax import FOLDER --headers lists its fields"
            findings.add("AMX6793", f"no field is known to be the {key} of variables", table.file, hint=hint)
    for column in table.columns:
        if column in columns.values():
            continue
        texts = [
            str(value) for row in table.present for value in table.value(row, column)[:1] if value not in (None, "")
        ]
        samples = [quoted(text, limit=_SAMPLE_LENGTH) for text in dict.fromkeys(texts)][:_SAMPLES]
        shown = f"it holds {', '.join(samples)}" if samples else "it is blank throughout"
        findings.add("AMX6793", f"field {column} is not understood: {shown}", table.file)


def _tell_code_page(table: DbaseTable, columns: Mapping[str, Column], findings: Findings) -> None:
    beyond: list[tuple[int, str]] = []
    for column in columns.values():
        if column.kind != "C":
            continue
        for row in table.present:
            raw = row.data[column.start : column.start + column.length]
            if not raw.isascii():
                beyond.append((row.number, str(table.value(row, column)[0])))
    if beyond and not table.marked:
        beyond.sort(key=lambda item: item[0])
        numbers = records_text(dict.fromkeys(number for number, _ in beyond))
        message = f"{numbers}: letters beyond ASCII are read by code page {table.code_page}: {quoted(beyond[0][1])}"
        findings.add("AMX6792", message, table.file, beyond[0][0], "--codepage cp850 or cp1252 if they come out wrong")
