"""Shared by the readers of stimuli verbs: names with values, times, values of signals, each checked in its place."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Protocol

from automax_ros.core.text import quoted
from automax_ros.core.ticks import exact_ns
from automax_ros.core.types import DataType, Value
from automax_ros.core.user_error import UserError
from automax_ros.core.values import value_of, value_text, wanted
from automax_ros.core.yaml_text import Node, Scalar
from automax_ros.rackfile.reading.values import (
    Entry,
    ProblemList,
    entries_of,
    is_plain_word,
    kind_of,
    number_hint,
    report_twice,
    text_value,
    wrong_kind,
)
from automax_ros.scenario.stimuli.signals import Signal, Signals
from automax_ros.scenario.stimuli.wave_player import Action

Read = Callable[[Node, str, ProblemList], Sequence[Action]]
"""Called with the node after a verb, the verb's name in messages, and the list for its problems."""


@dataclass(frozen=True)
class Verb:
    """Reader of a verb; ``is_value`` if it only writes values, ``everywhere`` as in ``Stimulus``."""

    read: Read
    is_value: bool = False
    everywhere: bool = False


def named(node: Node, what: str, findings: ProblemList) -> Iterator[Entry]:
    """Yield names with the node after each; a repeated name is reported, as is a verb without names.

    The rest of a name that YAML cut off at a comma is skipped: the start of the name is reported.
    """
    entries = entries_of(node, what, findings)
    if entries == ():
        findings.add("AMX6008", f"{what} names nothing", node.span)
    first: dict[str, Scalar] = {}
    for key, value in entries or ():
        name = "".join(key.text.split()).upper()
        if ")" in name and "(" not in name:
            continue
        if name in first:
            report_twice(key, f"{quoted(key.text)} of {what}", first[name].span, findings)
        else:
            first[name] = key
            yield key, value


def signal_of(key: Scalar, signals: Signals, findings: ProblemList) -> Signal | None:
    """Return the signal with the name in a key."""
    try:
        return signals.find(key.text)
    except UserError as fault:
        findings.add("AMX6735", fault.message, key.span, cut_short(key.text) or fault.hint)
        return None


def cut_short(name: str) -> str | None:
    """Return the hint for a name that YAML cut off at a comma between its subscripts."""
    if ("(" in name) == (")" in name):
        return None
    return 'a name with several subscripts needs quotes here: "DIAG%(1,0)"'


class HasType(Protocol):
    """A variable's data type, and the most characters of a STRING."""

    @property
    def type(self) -> DataType: ...  # noqa: D102

    @property
    def length(self) -> int: ...  # noqa: D102


def value_for(node: Node, label: str, kind: HasType, findings: ProblemList) -> Value | None:
    """Return the value of a node as a variable of this kind holds it; None if a problem was reported."""
    if kind.type is DataType.STRING:
        text = text_value(node, label, findings, limit=1000)
        if text is None:
            return None
        value = value_of(text, kind.type, kind.length)
    else:
        value = value_of(node.text, kind.type) if is_plain_word(node) else None
    if value is None:
        message = f"{label} cannot be {kind_of(node)}: it takes {wanted(kind.type, kind.length)}"
        findings.add("AMX6736", message, node.span, number_hint(node))
    return value


def signal_value(node: Node, signal: Signal, findings: ProblemList) -> Value | None:
    """Return the value of a node within the limits of a signal; None if a problem was reported."""
    value = value_for(node, signal.label, signal, findings)
    if value is not None and not isinstance(value, str) and not signal.low <= value <= signal.high:
        limits = f"{value_text(signal.low)} to {value_text(signal.high)}"
        findings.add("AMX6736", f"{signal.label} cannot be {value_text(value)}: its limits are {limits}", node.span)
        return None
    return value


def time_of(node: Node, what: str, findings: ProblemList) -> int | None:
    """Return a time in seconds as ns, exactly as written."""
    if not is_plain_word(node):
        wrong_kind(node, what, "a time in seconds", findings, number_hint(node))
        return None
    try:
        return exact_ns(node.text)
    except ValueError as error:
        findings.add("AMX6734", f"{what}: {error}", node.span)
        return None
