"""Finds the racks of an Executive in a folder: ``library/system/rack``, or any part of it, copied as DOS had it.

A folder with $CARD, $TASKS or $SWVAR is a rack, the folder above it with $RACK, $SYSTEM, $SECT or
$NET its system (J2-3045 p. 4-2).
Names are compared without case, since a copy may have lower case. Links are not followed (decision).
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path

from automax_ros.core.text import count_of, did_you_mean, quoted
from automax_ros.core.user_error import UserError

TABLE_SUFFIX = ".DBF"
_RACK_FILES = ("$CARD.DBF", "$TASKS.DBF", "$SWVAR.DBF")
_SYSTEM_FILES = ("$RACK.DBF", "$SYSTEM.DBF", "$SECT.DBF", "$NET.DBF")
_DEEPEST = 4
"""Folders within folders that are searched: a drive, its libraries, their systems, their racks."""
_MOST_ENTRIES = 20_000
"""Most entries of all folders that are looked at (decision: a bound on untrusted folders)."""
_LISTED = 20


class FolderFault(UserError):
    """A folder holds no rack of an Executive, or not the one that was asked for."""


@dataclass(frozen=True)
class DiskFolder:
    """A folder with its files by their names in upper case; of names that differ in case only the first counts.

    ``folders`` are those in it.
    """

    path: Path
    files: Mapping[str, Path] = field(default_factory=dict)
    folders: Sequence[Path] = ()

    def table(self, name: str) -> Path | None:
        """Return the file of a table, such as that of ``CARD``."""
        return self.files.get(f"${name}{TABLE_SUFFIX}")


@dataclass(frozen=True)
class RackPlace:
    """A rack's folder with the folder of its system, None where only the rack's was copied."""

    rack: DiskFolder
    system: DiskFolder | None

    @property
    def name(self) -> str:
        """The name of the rack's folder in upper case."""
        return self.rack.path.name.upper()

    @property
    def title(self) -> str:
        """Its system and its name, as ``--rack`` takes it: ``MILL/WIND1``."""
        return self.name if self.system is None else f"{self.system.path.name.upper()}/{self.name}"


def racks_in(folder: Path) -> list[RackPlace]:
    """Return the racks in a folder and below it, in the order of their paths.

    Where the folder above cannot be read, the system is taken to be missing.

    Raises:
        FolderFault: the folder cannot be read, or it and those below it hold more entries than are looked at.
    """
    folder = Path(os.path.abspath(folder))
    above: DiskFolder | None = None
    with suppress(FolderFault):
        above = _system(_contents(folder.parent)[0]) if folder.parent != folder else None
    search = _Search()
    search.walk(folder, above)
    return search.found


def chosen_rack(folder: Path, name: str | None) -> RackPlace:
    """Return the rack in a folder that ``name`` chooses: ``WIND1``, ``MILL/WIND1``; without a name the only one.

    Raises:
        FolderFault: there is none, there are several, or none is called so.
    """
    racks = racks_in(folder)
    if not racks:
        hint = "it is a folder with $CARD.DBF, $TASKS.DBF and $SWVAR.DBF, or one above it"
        if any(path.suffix.upper() == ".CNF" for path in _contents(folder)[0].files.values()):
            hint = "it holds a configuration task, of Executive 2.1 or before: automax import FILE.CNF"
        raise FolderFault(f"{folder} holds no rack of a Programming Executive", hint)
    titles = [rack.title for rack in racks]
    fitting = [rack for rack in racks if name is None or name.upper() in (rack.name, rack.title)]
    if len(fitting) == 1:
        return fitting[0]
    if fitting:
        listed = ", ".join(rack.title for rack in fitting[:_LISTED]) + (", ..." if len(fitting) > _LISTED else "")
        message = f"{folder} holds {count_of(len(fitting), 'rack')}{'' if name is None else ' of that name'}: {listed}"
        raise FolderFault(message, f"--rack {fitting[0].title} chooses one, or name its folder")
    asked = name or ""
    hint = did_you_mean(asked, [*titles, *(rack.name for rack in racks)]) or f"there are {', '.join(titles[:_LISTED])}"
    raise FolderFault(f"--rack {quoted(asked)}: {folder} holds no such rack", hint)


def _contents(folder: Path) -> tuple[DiskFolder, int]:
    """Return a folder, and how many entries it has as far as they are looked at.

    Raises:
        FolderFault: it cannot be read.
    """
    files: dict[str, Path] = {}
    inner: list[Path] = []
    try:
        with os.scandir(folder) as scan:
            entries = sorted(islice(scan, _MOST_ENTRIES + 1), key=lambda entry: entry.name)
        for entry in entries:
            if entry.is_dir(follow_symlinks=False):
                inner.append(folder / entry.name)
            elif entry.is_file(follow_symlinks=False):
                files.setdefault(entry.name.upper(), folder / entry.name)
    except (OSError, ValueError) as error:
        raise FolderFault(f"{folder} cannot be read: {getattr(error, 'strerror', None) or error}") from error
    return DiskFolder(folder, files, inner), len(entries)


def _system(found: DiskFolder) -> DiskFolder | None:
    return found if any(name in found.files for name in _SYSTEM_FILES) else None


@dataclass
class _Search:
    found: list[RackPlace] = field(default_factory=list)
    _entries: int = 0

    def walk(self, folder: Path, above: DiskFolder | None, depth: int = 0) -> None:
        """Find the racks in a folder and below it; one below it that cannot be read holds none."""
        try:
            here, entries = _contents(folder)
        except FolderFault:
            if depth:
                return
            raise
        self._entries += entries
        if self._entries > _MOST_ENTRIES:
            message = f"{folder} and the folders in it hold more than {_MOST_ENTRIES} files"
            raise FolderFault(message, "name a folder of it")
        if any(name in here.files for name in _RACK_FILES):
            self.found.append(RackPlace(here, above))
        for inner in here.folders if depth < _DEEPEST else ():
            self.walk(inner, _system(here), depth + 1)
