"""Definitions of message types: those of our recordings, and those in the schemas of a bag.

``message_types.json`` holds the .msg texts and RIHS01 hashes; ``tools/generate_message_types.py`` writes it.
"""

from __future__ import annotations

import functools
import json
import re
from dataclasses import dataclass
from pathlib import Path

_NUMBERS = {f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64)}
PRIMITIVES = frozenset({"bool", "byte", "char", "float32", "float64", "string", "wstring"} | _NUMBERS)
TIME = "builtin_interfaces/msg/Time"
SEPARATOR = "=" * 80
MAX_SCHEMA_BYTES = 1 << 20
"""Longest schema that is read from a bag, in bytes (decision: a bound on memory for untrusted recordings)."""

_NAME = r"[A-Za-z][A-Za-z0-9_]*"
_FIELD = re.compile(
    rf"(?P<kind>{_NAME}(?:/{_NAME}){{0,2}})(?:<=(?P<bound>\d{{1,9}}))?(?P<array>\[(?:<=)?\d{{0,9}}\])?"
    rf"\s+(?P<name>{_NAME})(?P<rest>.*)",
    re.DOTALL,
)
_TYPE_NAME = re.compile(rf"({_NAME})/(?:msg/)?({_NAME})")


class DefinitionError(ValueError):
    """A text is not a message definition; the message says which line is wrong."""


@dataclass(frozen=True)
class Constant:
    """A named value of a definition."""

    name: str
    kind: str
    value: str


@dataclass(frozen=True)
class Field:
    """One field: ``kind`` is a primitive or the full name of a type.

    ``array`` is empty for a single value, else as in the text: ``[]``, ``[3]`` or ``[<=3]``; ``bound`` is the greatest
    length of a bounded string, else None.
    """

    name: str
    kind: str
    array: str = ""
    bound: int | None = None


@dataclass(frozen=True)
class Definition:
    """The fields and constants of a type, in the order of its text."""

    name: str
    fields: tuple[Field, ...]
    constants: tuple[Constant, ...]


@dataclass(frozen=True)
class MessageType:
    """A type of our recordings: its .msg text, RIHS01 hash and parsed definition."""

    name: str
    text: str
    hash: str
    definition: Definition


def parse_definition(name: str, text: str) -> Definition:
    """Parse the .msg text of the type ``name`` (``pkg/msg/Type``).

    Raises:
        DefinitionError: a line is neither a field nor a constant nor empty.
    """
    package = full_name(name).split("/", 1)[0]
    fields: list[Field] = []
    constants: list[Constant] = []
    for line in text.splitlines():
        content = line.strip()
        if not content or content.startswith("#"):
            continue
        match = _FIELD.fullmatch(content)
        if match is None:
            raise DefinitionError(f"{name}: not a field or constant: {content[:60]!r}")
        rest = match["rest"].strip()
        if rest.startswith("="):
            constants.append(Constant(match["name"], match["kind"], rest[1:].strip()))
        else:
            bound, kind = match["bound"], match["kind"]
            if kind not in PRIMITIVES:
                kind = full_name(kind if "/" in kind else f"{package}/{kind}")
            fields.append(Field(match["name"], kind, match["array"] or "", None if bound is None else int(bound)))
    return Definition(full_name(name), tuple(fields), tuple(constants))


def full_name(name: str) -> str:
    """Return ``pkg/msg/Type`` for ``pkg/Type`` or ``pkg/msg/Type``.

    Raises:
        DefinitionError: it is neither.
    """
    match = _TYPE_NAME.fullmatch(name)
    if match is None:
        raise DefinitionError(f"not the name of a message type: {name[:60]!r}")
    return f"{match[1]}/msg/{match[2]}"


def short_name(name: str) -> str:
    """Return ``pkg/Type``."""
    return name.replace("/msg/", "/", 1)


def parse_schema(name: str, text: str) -> dict[str, Definition]:
    """Parse a ``ros2msg`` schema: the definition of ``name`` and of all types it uses, by full name.

    Raises:
        DefinitionError: the text is too long or not a schema.
    """
    if len(text) > MAX_SCHEMA_BYTES:
        raise DefinitionError(f"{name}: schema of {len(text)} characters, at most {MAX_SCHEMA_BYTES} are read")
    definitions: dict[str, Definition] = {}
    part_name = name
    part: list[str] = []
    lines = iter([*text.splitlines(), SEPARATOR])
    for line in lines:
        if line.strip() != SEPARATOR:
            part.append(line)
            continue
        definition = parse_definition(part_name, "\n".join(part))
        definitions[definition.name] = definition
        head = next(lines, None)
        if head is None:
            break
        if not head.startswith("MSG: "):
            raise DefinitionError(f"{name}: no 'MSG: pkg/Type' after a line of '='")
        part_name, part = head.removeprefix("MSG: ").strip(), []
    return definitions


@functools.cache
def message_types() -> dict[str, MessageType]:
    """Return every type of our recordings, by full name."""
    table = json.loads(Path(__file__).with_name("message_types.json").read_text(encoding="utf-8"))
    return {
        name: MessageType(name, entry["text"], entry["hash"], parse_definition(name, entry["text"]))
        for name, entry in table.items()
    }


def dependencies(name: str) -> list[str]:
    """Return the full names of the types that a known type uses, directly or not, in order of first use."""
    found: list[str] = []
    for field in message_types()[name].definition.fields:
        if field.kind not in PRIMITIVES:
            found.extend(item for item in (field.kind, *dependencies(field.kind)) if item not in found)
    return found


@functools.cache
def schema_text(name: str) -> str:
    """Return the complete ``ros2msg`` schema of a type: its text, then that of each type it uses."""
    parts = [message_types()[name].text]
    parts += [f"{SEPARATOR}\nMSG: {short_name(item)}\n{message_types()[item].text}" for item in dependencies(name)]
    return "\n".join(parts)


def same_layout(name: str, schema: dict[str, Definition]) -> bool:
    """Return whether a bag's schema of ``name`` has the fields of the known type, nested types included."""
    return all(
        item in schema and schema[item].fields == message_types()[item].definition.fields
        for item in (name, *dependencies(name))
    )
