"""`meant_so` of a rack file: the commons, plants and slots of which `automax check` says nothing that is meant so.

A common is meant by its full name, a plant by its own, a 57C406 without a plant by its slot. Where a REAL common and a
plant have one name, both are meant (decision). Warnings of the kind that a look at the whole rack gives are left out
(``rackfile/checks/omissions``); errors are not.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

from automax_ros.core.diagnostics import Note, Span
from automax_ros.core.json_schema import SCALAR, Schema, listed
from automax_ros.core.text import near_or_listed, quoted
from automax_ros.core.yaml_text import Node
from automax_ros.core.yaml_text import YamlSequence as YamlList
from automax_ros.rackfile.model.config import CommonVariable
from automax_ros.rackfile.model.module import ModuleConfig
from automax_ros.rackfile.reading.values import ProblemList, text_value, wrong_kind

MOST_NAMES = 1000
"""Most names that are meant so (decision: a bound; a file that needs more has another fault)."""
SCHEMA: Schema = listed(
    "Commons, plants and slots of which `automax check` shall not warn: `SPARE%`, `OLD_REEL`, `7`.",
    {"type": list(SCALAR)},
    0,
    MOST_NAMES,
)
_CODE = "AMX6223"
_LONGEST = 100


def read_meant_so(
    node: Node,
    variables: Sequence[CommonVariable],
    plants: Collection[str],
    modules: Sequence[ModuleConfig],
    findings: ProblemList,
) -> Mapping[str, int]:
    """Return what is meant so, each with the line that names it; report errors in the findings (AMX6223).

    Names are not looked up while the file has other errors, which may be in what they name.
    """
    if not isinstance(node, YamlList):
        wrong_kind(node, "meant_so", "a list of names", findings, "write meant_so: [SPARE%, OLD_REEL]")
        return {}
    if len(node.items) > MOST_NAMES:
        findings.add(_CODE, f"meant_so has {len(node.items)} names; it may have at most {MOST_NAMES}", node.span)
        return {}
    slots = {str(module.slot): module.slot for module in modules}
    known = [*(variable.name for variable in variables), *plants, *slots]
    is_whole = not findings.errors
    found: dict[str, Span] = {}
    for item in node.items:
        text = text_value(item, "a name in meant_so", findings, limit=_LONGEST)
        if text is None or not is_whole:
            continue
        name = findings.upper_case(text.strip(), item.span)
        if name not in known:
            hint = near_or_listed(name, known)
            message = f"meant_so: the rack has no common variable, plant or slot {quoted(text)}"
            findings.add(_CODE, message, item.span, hint)
        elif name in found:
            notes = (Note("first here", found[name]),)
            findings.add(_CODE, f"meant_so has {name} twice", item.span, "leave one out", notes)
        else:
            found[name] = item.span
    return {name: span.line for name, span in found.items()}
