"""The numbers of plants and webs by dotted path, from their keys in the rack file: ``UNWIND.load.torque_nm``.

A rack with other numbers is read from another text, so that every rule of the file applies to them.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from automax_ros.core.diagnostics import Span
from automax_ros.core.json_schema import Schema
from automax_ros.core.text import near_or_listed, quoted
from automax_ros.core.user_error import UserError
from automax_ros.core.yaml_text import Node, Scalar, raise_flaw, read_yaml, yaml_of
from automax_ros.core.yaml_text import YamlMapping as Keys
from automax_ros.rackfile.model.config import RackConfig
from automax_ros.rackfile.sections.plants import KEYS
from automax_ros.rackfile.sections.webs import KEYS as WEB_KEYS

_NOWHERE = Span(1, 1, 2)


@dataclass(frozen=True)
class PlantNumber:
    """A number of a plant, or of a web: ``keys`` lead to it, ``low`` and ``high`` are its limits.

    ``section`` is the one of the rack file that has the name ``plant``.
    """

    plant: str
    keys: tuple[str, ...]
    low: float
    high: float
    is_whole: bool = False
    section: str = "plants"

    @property
    def label(self) -> str:
        """Its full name."""
        return ".".join((self.plant, *self.keys))


def plant_number(config: RackConfig, text: str) -> PlantNumber:
    """Return the number with the path ``PLANT.key.key`` or ``WEB.key``; the name may be in lower case.

    Raises:
        UserError: there is no such plant or web, or its section has no such number.
    """
    owner, _, path = "".join(text.split()).partition(".")
    webs = {web.name for web in config.webs}
    owners = [*(plant.name for plant in config.plants), *(web.name for web in config.webs)]
    name = owner.upper()
    if name not in owners:
        raise UserError(f"the rack has no plant {quoted(owner)}", near_or_listed(name, owners))
    section, word, own = ("webs", "web", WEB_KEYS) if name in webs else ("plants", "plant", KEYS)
    known = {".".join(keys): (keys, schema) for keys, schema in _numbers({"properties": own}, ())}
    if path not in known:
        raise UserError(f"{word} {name} has no number {quoted(path)}", near_or_listed(path, known, f"{name}."))
    keys, schema = known[path]
    return PlantNumber(name, keys, schema["minimum"], schema["maximum"], schema["type"] == "integer", section)


def with_numbers(text: str, values: Mapping[PlantNumber, str]) -> str:
    """Return a rack file's text with other numbers of plants and webs, the text itself without any.

    Missing keys on the way to them are added; a motor given by its name has no numbers.

    Raises:
        UserError: a key on the way to a number has something other than keys.
    """
    if not values:
        return text
    root = read_yaml(text, raise_flaw)
    assert isinstance(root, Keys)
    for number, value in values.items():
        root = _with(root, (number.section, number.plant, *number.keys), value, number.label)
    return yaml_of(root)


def _numbers(schema: Schema, path: tuple[str, ...]) -> Iterator[tuple[tuple[str, ...], Schema]]:
    if "minimum" in schema:
        yield path, schema
    for choice in schema.get("anyOf", ()):
        yield from _numbers(choice, path)
    for key, value in schema.get("properties", {}).items():
        yield from _numbers(value, (*path, key))


def _with(node: Node | None, keys: tuple[str, ...], value: str, label: str) -> Keys | Scalar:
    if not keys:
        return Scalar(value, True, _NOWHERE)
    entries = node.entries if isinstance(node, Keys) else ()
    if node is not None and not isinstance(node, Keys) and not (isinstance(node, Scalar) and node.is_null):
        raise UserError(f"{label} cannot vary: the rack file has no key {quoted(keys[0])} there", "write the keys out")
    key, *rest = keys
    changed = [(name, _with(item, tuple(rest), value, label) if _means(name, keys) else item) for name, item in entries]
    if not any(_means(name, keys) for name, _ in entries):
        changed.append((Scalar(key, True, _NOWHERE), _with(None, tuple(rest), value, label)))
    return Keys(tuple(changed), node.span if node is not None else _NOWHERE)


def _means(name: Scalar, keys: tuple[str, ...]) -> bool:
    """Return whether a key of the file is the first of ``keys``; names of plants may be in lower case in the file."""
    return name.text == keys[0] or name.text.upper() == keys[0]
