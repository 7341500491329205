"""What a browser may ask for: requests and operations with the kinds of their fields, and how often."""

from __future__ import annotations

import inspect
import json
from collections.abc import Callable, Mapping
from typing import Any

from automax_ros.core.text import quoted
from automax_ros.panel.source import MOST_NAMES, Facts, RequestRefused
from automax_ros.rack.operator.requests import VERBS

_MOST_TEXT = 1000
_MOST_NUMBER = 1 << 63

Kind = tuple[str, Callable[[Any], bool]]
"""A kind of value: in words, and as a test."""
Kinds = Mapping[str, Kind]
"""The fields of a request; a question mark ends the name of one that may be left out."""


def _is_text(value: object) -> bool:
    return isinstance(value, str) and len(value) <= _MOST_TEXT


def _numbers(words: str, *types: type, low: float = -_MOST_NUMBER, high: float = _MOST_NUMBER) -> Kind:
    return words, lambda value: type(value) in types and low <= value <= high


def _texts(most: int) -> Kind:
    return (
        f"a list of at most {most} texts",
        lambda value: isinstance(value, list) and len(value) <= most and all(map(_is_text, value)),
    )


_TEXT: Kind = (f"a text of at most {_MOST_TEXT} characters", _is_text)
_WHOLE = _numbers("a whole number", int)
REQUESTS: Mapping[str, Kinds] = {
    "watch": {"names": _texts(MOST_NAMES)},
    "diagram": {"task": _TEXT, "which?": _TEXT},
    "scan": {"task": _TEXT, "scan?": _WHOLE, "t?": _WHOLE},
    "history": {"names": _texts(32), "from_ns": _WHOLE, "to_ns": _WHOLE, "points": _WHOLE},
    "seek": {"t?": _WHOLE, "task?": _TEXT, "scan?": _WHOLE},
    "play": {"rate": _numbers("a number from 0 to 100", int, float, low=0, high=100)},
    "explain": {"code": _TEXT},
    "prepare": {"verb": _TEXT, "fields": ("an object", lambda value: isinstance(value, dict))},
    "confirm": {"ticket": _TEXT},
}
"""What a page may ask for."""
_ANNOTATED: Kinds = {
    "str": _TEXT,
    "bool": ("true or false", lambda value: isinstance(value, bool)),
    "int": _WHOLE,
    "float": _numbers("a number", int, float),
    "Sequence[str]": _texts(MOST_NAMES),
}


def _arguments(act: Callable[..., object]) -> Kinds:
    _, *arguments = inspect.signature(act).parameters.values()
    ends = {item.name: "" if item.default is item.empty else "?" for item in arguments}
    return {item.name + ends[item.name]: _ANNOTATED[item.annotation] for item in arguments}


_NOT_HERE = frozenset({"reload", "get", "forces", "errors", "tasks", "status"})
OPERATIONS = {name: _arguments(verb.act) for name, verb in VERBS.items() if name not in _NOT_HERE}
"""What a page may have the rack do: the verbs of its operator but for those that read, and the one with a file."""


def decoded(text: str | bytes) -> dict[str, Any]:
    """Return the object of a message.

    Raises:
        RequestRefused: it is something else.
    """
    try:
        found = json.loads(text) if isinstance(text, str) else None
    except (ValueError, RecursionError):
        found = None
    if not isinstance(found, dict):
        raise RequestRefused("a message is an object of JSON, as text")
    return found


def checked(name: str, fields: Facts, known: Mapping[str, Kinds]) -> Facts:
    """Return the fields of one of the known requests.

    Raises:
        RequestRefused: it is none of them, or a field is missing, unknown or of another kind.
    """
    if name not in known:
        raise RequestRefused(f"there is no {quoted(name)} here", f"there are {', '.join(known)}")
    kinds = {field.removesuffix("?"): kind for field, kind in known[name].items()}
    for field, value in fields.items():
        if field not in kinds:
            raise RequestRefused(f"{name} has no field {quoted(field)}")
        words, fits = kinds[field]
        if not fits(value):
            raise RequestRefused(f"{name}: {field} is not {words}")
    for field in kinds:
        if field in known[name] and field not in fields:
            raise RequestRefused(f"{name}: {field} is missing")
    return fields


class Allowance:
    """How often something may happen: ``rate`` times per second in the long run, ``burst`` times at once."""

    def __init__(self, rate: float, burst: int) -> None:
        self._step_s, self._slack_s, self._due_s = 1 / rate, burst / rate, 0.0

    def take(self, now_s: float) -> bool:
        """Use one of them; FALSE: there is none left now."""
        due_s = max(self._due_s, now_s - self._slack_s) + self._step_s
        is_left = due_s <= now_s
        self._due_s = due_s if is_left else self._due_s
        return is_left
