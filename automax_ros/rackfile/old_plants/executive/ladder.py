"""Stubs of ladder tasks (.PC): BASIC tasks that declare what the ladder may use, and do nothing.

The form of .PC and .XRF files is not known. The rack's variables whose names occur in their bytes as whole words are
taken to be those of the task (decision).
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence

from automax_ros.core.types import bare_name
from automax_ros.language.tree.task_kind import LADDER_SUFFIX

_WORD = re.compile(rb"[A-Z_][A-Z0-9_]{0,15}", re.IGNORECASE)
_PER_LINE = 4
_STEP = 10
MOST_DECLARED = 2000
"""Most variables that a stub declares (decision: a bound on untrusted files)."""


def stub_file(name: str) -> str:
    """Return the name of the file of a ladder task's stub."""
    return f"{name}.BAS"


def ladder_files(name: str) -> tuple[str, str]:
    """Return the names of the files of a ladder task that are searched for names: the task, its cross reference."""
    return f"{name}{LADDER_SUFFIX}", f"{name}.XRF"


def named_in(data: Iterable[bytes], declared: Sequence[str]) -> list[str]:
    """Return the variables, as COMMON declares them, whose names occur in the bytes of files."""
    words = {match.decode("ascii").upper() for part in data for match in _WORD.findall(part)}
    return [item for item in declared if bare_name(item.partition("(")[0].partition(":")[0]) in words]


def stub_of(name: str, files: Sequence[str], declared: Sequence[str]) -> str:
    """Return the source of the stub of a ladder task; ``files`` are those in which its variables were found."""
    what = f"THE RACK'S VARIABLES THAT {' AND '.join(files)} NAME" if files else "ITS FILE IS NOT THERE"
    lines = [
        f"10 ! STUB OF THE LADDER TASK {name}.PC: IT DOES NOTHING. WRITE ITS LOGIC HERE.",
        f"20 ! {what}:" if files else f"20 ! {what}",
    ]
    number = 30
    for place in range(0, len(declared), _PER_LINE):
        lines.append(f"{number} COMMON {', '.join(declared[place : place + _PER_LINE])}")
        number += _STEP
    return "\n".join([*lines, f"{number} END"]) + "\n"
