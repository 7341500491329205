"""Pieces of JSON Schema (draft 2020-12) for the form of YAML files, for editors that know nothing else of them.

A plain value is judged as YAML 1.2 reads it: ``57552`` is a number, ``on`` a text. So a schema here accepts every
spelling that the reader accepts, and refuses what the reader refuses by its form; rules that depend on other parts of
the file are checked only by the reader (decision).
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any, TypeAlias

Schema: TypeAlias = Mapping[str, Any]
"""A schema as data for JSON."""
Keys: TypeAlias = Mapping[str, Schema]
"""The keys of a section, each with the schema of its value."""
DIALECT = "https://json-schema.org/draft/2020-12/schema"
SCALAR = ("string", "number", "boolean")
"""Types of a single value; a text without quotes may look like a number or a boolean."""


def section(text: str, keys: Keys, required: Collection[str] = ()) -> Schema:
    """Return the schema of a mapping with fixed keys."""
    found: dict[str, Any] = {"description": text, "type": "object", "properties": dict(keys)}
    if required:
        found["required"] = sorted(required)
    return {**found, "additionalProperties": False}


def entries(text: str, pattern: str, value: Schema, most: int | None = None) -> Schema:
    """Return the schema of a mapping whose keys are names that match ``pattern``."""
    limit = {} if most is None else {"maxProperties": most}
    return {
        "description": text,
        "type": "object",
        "patternProperties": {pattern: value},
        "additionalProperties": False,
        **limit,
    }


def number(text: str, low: float, high: float, default: float | None = None) -> Schema:
    """Return the schema of a number from ``low`` to ``high``."""
    return {"description": text, "type": "number", "minimum": low, "maximum": high, **_usual(default)}


def whole(text: str, low: int, high: int, default: int | None = None) -> Schema:
    """Return the schema of a whole number from ``low`` to ``high``."""
    return {"description": text, "type": "integer", "minimum": low, "maximum": high, **_usual(default)}


def steps(text: str, low: float, high: float, step: float, default: float) -> Schema:
    """Return the schema of a number from ``low`` to ``high`` in steps of ``step``."""
    return {**number(text, low, high, default), "multipleOf": step}


def words(text: str, known: Collection[object], default: object = None) -> Schema:
    """Return the schema of one of some words."""
    return {"description": text, "enum": list(known), **_usual(default)}


def flag(text: str, default: bool | None = None) -> Schema:
    """Return the schema of true or false, in each spelling that the rack's own files accept."""
    spellings = ["on", "off", "On", "Off", "ON", "OFF", 1, 0]
    return {"description": text, "anyOf": [{"type": "boolean"}, {"enum": spellings}], **_usual(default)}


def line(text: str, limit: int) -> Schema:
    """Return the schema of a text of one line."""
    return {"description": text, "type": list(SCALAR), "maxLength": limit}


def named(text: str, pattern: str) -> Schema:
    """Return the schema of a name; one of digits alone is a number to YAML."""
    return {"description": text, "type": ["string", "integer"], "pattern": pattern}


def scalar(text: str) -> Schema:
    """Return the schema of any single value."""
    return {"description": text, "type": list(SCALAR)}


def listed(text: str, item: Schema, least: int = 0, most: int | None = None) -> Schema:
    """Return the schema of a list."""
    limit = {} if most is None else {"maxItems": most}
    return {"description": text, "type": "array", "items": item, "minItems": least, **limit}


def either(text: str, *choices: Schema) -> Schema:
    """Return the schema of a value that matches one of several schemas."""
    return {"description": text, "anyOf": list(choices)}


def may_be_empty(schema: Schema) -> Schema:
    """Return a schema that also accepts null: a key without a value has none of its options."""
    return {"description": schema["description"], "anyOf": [schema, {"type": "null"}]}


def document(title: str, body: Schema) -> Schema:
    """Return a whole schema."""
    return {"$schema": DIALECT, "title": title, **body}


def _usual(default: object) -> Schema:
    return {} if default is None else {"default": default}
