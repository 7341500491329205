"""Reads the tables of one rack and its system, as records by what their fields mean."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from automax_ros.rackfile.old_plants.executive.dbase import (
    MAX_TABLE_BYTES,
    DbaseFault,
    DbaseTable,
    read_dbase,
)
from automax_ros.rackfile.old_plants.executive.fields import (
    RACK_TABLES,
    SYSTEM_TABLES,
    FieldChoice,
    Record,
    records_of,
)
from automax_ros.rackfile.old_plants.executive.findings import Findings
from automax_ros.rackfile.old_plants.executive.folders import DiskFolder, RackPlace
from automax_ros.rackfile.reading.files import FileFault, read_bytes

_HOLD = {
    "SYSTEM": "system and version of the Executive",
    "SECT": "sections",
    "RACK": "racks",
    "NET": "descriptions of network variables",
    "IORACK": "remote racks",
    "PARAM": "parameters of a UDC's drives",
    "CARD": "modules",
    "TASKS": "tasks",
    "SWVAR": "variables",
}
"""What each table holds."""
_ONLY_COMMENTS = ("IORACK", "PARAM")
"""Tables whose records have no place in a rack file, be they there or not; not all racks have any (decision)."""


@dataclass(frozen=True)
class OldRack:
    """The records of a rack's tables and of its system's, by the tables' names without ``$``."""

    place: RackPlace
    records: Mapping[str, Sequence[Record]] = field(default_factory=dict)
    unread: frozenset[str] = frozenset()

    def of(self, table: str) -> Sequence[Record]:
        """Return the records of a table, in their order; none if it is missing or cannot be read."""
        return self.records.get(table, ())

    @property
    def own(self) -> Record | None:
        """The rack's record in $RACK."""
        return next((item for item in self.of("RACK") if item.text("id").upper() == self.place.name), None)


def read_old_rack(
    place: RackPlace, choices: Sequence[FieldChoice], code_page: str | None, findings: Findings
) -> OldRack:
    """Read the tables of a rack and of its system; what cannot be read is told."""
    records: dict[str, Sequence[Record]] = {}
    unread: set[str] = set()
    for name, path in _paths(place):
        if path is None:
            if name in RACK_TABLES or place.system is not None:
                _tell_missing(name, findings)
                unread.add(name)
            continue
        table = read_file(name, path, code_page, findings)
        if table is None:
            unread.add(name)
        else:
            records[name] = records_of(table, name, choices, findings)
    if place.system is None:
        message = "the folder above the rack has none of its system's tables: they were not copied with it"
        findings.add("AMX6795", message, place.name, hint="descriptions of network variables are in $NET.DBF there")
    return OldRack(place, records, frozenset(unread))


def read_file(name: str, path: Path, code_page: str | None, findings: Findings) -> DbaseTable | None:
    """Return the table in a file; None, with a finding, if it cannot be read."""
    file = f"${name}.DBF"
    try:
        return read_dbase(read_bytes(path, MAX_TABLE_BYTES), file, findings, code_page)
    except FileFault as fault:
        findings.add("AMX6789", f"the file {fault}", file)
    except DbaseFault as fault:
        findings.add(fault.code, fault.message, file, hint=fault.hint)
    return None


def _tell_missing(name: str, findings: Findings) -> None:
    file, folder = f"${name}.DBF", "rack" if name in RACK_TABLES else "system"
    code, more = ("AMX6795", ", if there are any,") if name in _ONLY_COMMENTS else ("AMX6789", "")
    message = f"the {folder}'s folder has no such file: {_HOLD[name]}{more} are missing"
    findings.add(code, message, file, hint="copy it from the disk again, or from the backup")


def _paths(place: RackPlace) -> Iterator[tuple[str, Path | None]]:
    yield from ((name, _table(place.system, name)) for name in SYSTEM_TABLES)
    yield from ((name, _table(place.rack, name)) for name in RACK_TABLES)


def _table(folder: DiskFolder | None, name: str) -> Path | None:
    return None if folder is None else folder.table(name)
