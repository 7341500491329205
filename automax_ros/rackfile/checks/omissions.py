"""What a look at a whole rack finds left out or left over, less what the rack file says is meant so.

``meant_so`` names commons, plants, and slots of a 57C406. A name of which nothing would be said is told itself
(AMX6224): the file shall not go on excusing what was mended.
"""

from __future__ import annotations

import re
from collections.abc import Mapping

from automax_ros.core.diagnostics import Diagnostic, Span
from automax_ros.language.program import Program
from automax_ros.rackfile.checks.common_use import (
    first_word,
    never_used,
    never_written,
    unused_warning,
    written_twice,
)
from automax_ros.rackfile.checks.plant_use import drives_without_plant, plants_without_drive
from automax_ros.rackfile.model.config import RackConfig


def rack_warnings(config: RackConfig, programs: Mapping[str, Program]) -> list[Diagnostic]:
    """Return warnings about omissions in a rack file; ``programs`` are those of all its tasks.

    AMX6496: tasks read a common that is never written; AMX6497: commons that are never used; AMX6498: the 57C406 of a
    current minor loop has no plant; AMX6499: nothing drives a plant; AMX6224: ``meant_so`` names what has none of
    these, and no two writers (AMX6495, which is told at the writers).
    """
    meant_so = config.meant_so
    found = [
        *never_written(config, programs),
        *drives_without_plant(config, programs),
        *plants_without_drive(config, programs),
    ]
    unused = never_used(config, programs)
    warnings = [diagnostic for name, diagnostic in found if name not in meant_so]
    warnings += unused_warning(config, [item for item in unused if item.name not in meant_so])
    excused = {name for name, _ in found} | {item.name for item in unused}
    excused |= {name for _, (name, _) in written_twice(config, programs)}
    return [*warnings, *_needless(config, excused)]


def _needless(config: RackConfig, excused: set[str]) -> list[Diagnostic]:
    return [
        Diagnostic(
            "AMX6224",
            f"meant_so names {name}, of which nothing would be said",
            _named_place(config, name, line),
            hint="take it out: what was meant so has changed",
        )
        for name, line in config.meant_so.items()
        if name not in excused
    ]


def _named_place(config: RackConfig, name: str, line: int) -> Span:
    """Return the place of a name of ``meant_so`` in its line, where the key and other names may stand as well."""
    text = config.text.split("\n")[line - 1]
    start = text.index(":") + 1 if text.lstrip().startswith("meant_so") else 0
    found = re.compile(rf"(?<![\w%@$!]){re.escape(name)}(?![\w%@$!])", re.IGNORECASE).search(text, start)
    return Span(line, found.start() + 1, found.end() + 1) if found else first_word(config, line)
