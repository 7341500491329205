"""What readers of all verbs share, and the verbs that write values as the process does: set, ramp, sine, square.

These are for a rack and for a lone task; those that operate a rack are in ``rack_verbs``.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Protocol

from automax_ros.core.diagnostics import Span
from automax_ros.core.text import quoted
from automax_ros.core.ticks import exact_ns
from automax_ros.core.types import DataType, Value
from automax_ros.core.user_error import UserError
from automax_ros.core.values import value_of, value_text, wanted
from automax_ros.core.yaml_text import Node, Scalar
from automax_ros.rackfile.reading.values import (
    Entry,
    ProblemList,
    Section,
    entries_of,
    is_plain_word,
    kind_of,
    number_hint,
    number_value,
    report_twice,
    text_value,
    wrong_kind,
)
from automax_ros.scenario.stimuli.player import Action, Stimulus, WavePlayer
from automax_ros.scenario.stimuli.signals import Signal, Signals
from automax_ros.scenario.stimuli.waves import MOST_HZ, Ramp, Sine, Square, Wave

Read = Callable[[Node, str, ProblemList], Sequence[Action]]
"""Called with the node after a verb, the verb's name in messages, and the list for its problems."""


@dataclass(frozen=True)
class StimuliVerb:
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


VALUE_VERBS = ("set", "ramp", "sine", "square", "table")
LEAST_HZ = 0.0001
"""Lowest frequency (decision: slower is a ramp)."""


@dataclass(frozen=True)
class SetValue:
    """Writes a value once."""

    signal: Signal
    value: Value

    @property
    def of(self) -> str:
        """The signal's name."""
        return self.signal.label

    def do(self, stage: WavePlayer) -> None:
        """Write it."""
        stage.set(self.signal, self.value)


@dataclass(frozen=True)
class DriveSignal:
    """Drives a signal with a wave."""

    signal: Signal
    wave: Wave

    @property
    def of(self) -> str:
        """The signal's name."""
        return self.signal.label

    def do(self, stage: WavePlayer) -> None:
        """Start the wave."""
        stage.drive(self.signal, self.wave)


def goes_on_for_ever(stimuli: Iterable[Stimulus]) -> bool:
    """Return whether one of the entries starts a wave without an end."""
    actions = (action for entry in stimuli for action in entry.actions)
    return any(isinstance(action, DriveSignal) and action.wave.for_ns is None for action in actions)


def value_verbs(signals: Signals) -> Mapping[str, StimuliVerb]:
    """Return the verbs for the signals of a rack or of a task."""

    def read_set(node: Node, what: str, findings: ProblemList) -> list[Action]:
        found: list[Action] = []
        for key, item in named(node, what, findings):
            signal = signal_of(key, signals, findings)
            value = signal_value(item, signal, findings) if signal is not None else None
            if signal is not None and value is not None:
                found.append(SetValue(signal, value))
        return found

    return {
        "set": StimuliVerb(read_set, is_value=True),
        "ramp": StimuliVerb(_wave_reader(signals, ("to", "over"), _ramp), is_value=True),
        "sine": StimuliVerb(_wave_reader(signals, ("mean", "amplitude", "hz", "for"), _sine), is_value=True),
        "square": StimuliVerb(_wave_reader(signals, ("low", "high", "hz", "for"), _square), is_value=True),
    }


@dataclass(frozen=True)
class _Shape:
    """The node after a signal's name: keys of a wave, at a place, called ``what`` in messages."""

    signal: Signal
    section: Section
    what: str
    span: Span
    findings: ProblemList

    def requires(self, *keys: str) -> bool:
        return self.section.require(keys, self.what, self.span)

    def time(self, key: str) -> int | None:
        node = self.section.get(key)
        return time_of(node, f"{key} of {self.what}", self.findings) if node is not None else None

    def level(self, key: str) -> Value | None:
        node = self.section.get(key)
        return signal_value(node, self.signal, self.findings) if node is not None else None

    def refuse(self, code: str, message: str, key: str) -> None:
        self.findings.add(code, f"{self.what}: {message}", self.section.key_span(key))

    @property
    def hz(self) -> Fraction | None:
        node = self.section.get("hz")
        if node is None:
            return None
        what = f"hz of {self.what}"
        found = number_value(node, what, self.findings, low=LEAST_HZ, high=MOST_HZ, code="AMX6738")
        return Fraction(node.text) if found is not None and isinstance(node, Scalar) else None


def _wave_reader(
    signals: Signals, keys: tuple[str, ...], read: Callable[[_Shape], Wave | None]
) -> Callable[[Node, str, ProblemList], list[Action]]:
    def read_waves(node: Node, what: str, findings: ProblemList) -> list[Action]:
        waves = ((shape.signal, read(shape)) for shape in _shapes(node, what, signals, keys, findings))
        return [DriveSignal(signal, wave) for signal, wave in waves if wave is not None]

    return read_waves


def _shapes(node: Node, what: str, signals: Signals, keys: tuple[str, ...], findings: ProblemList) -> Iterator[_Shape]:
    for key, item in named(node, what, findings):
        signal = signal_of(key, signals, findings)
        is_shape = entries_of(item, f"{quoted(key.text)} of {what}", findings) is not None
        if signal is not None and is_shape:
            name = f"{what} of {signal.label}"
            yield _Shape(signal, Section(item, name, keys, findings), name, key.span, findings)


def _is_number(shape: _Shape) -> bool:
    kind = shape.signal.type
    if not kind.is_numeric:
        message = f"{shape.what} needs a number; {shape.signal.label} is a {kind.word}"
        shape.findings.add("AMX6737", message, shape.span)
    return kind.is_numeric


def _ramp(shape: _Shape) -> Ramp | None:
    if not _is_number(shape) or not shape.requires("to", "over"):
        return None
    to, over = shape.level("to"), shape.time("over")
    if to is None or over is None or isinstance(to, str):
        return None
    return Ramp(shape.signal.type, to, over)


def _sine(shape: _Shape) -> Sine | None:
    """Read a sine; without ``mean`` it is around 0, without ``for`` it has no end (decision)."""
    if not _is_number(shape) or not shape.requires("amplitude", "hz"):
        return None
    mean = _real(shape, "mean") if "mean" in shape.section else 0.0
    amplitude, hz, for_ns = _real(shape, "amplitude"), shape.hz, shape.time("for")
    if mean is None or amplitude is None or hz is None or (for_ns is None and "for" in shape.section):
        return None
    signal = shape.signal
    low, high = mean - abs(amplitude), mean + abs(amplitude)
    if not signal.low <= low <= high <= signal.high:
        limits = f"{value_text(signal.low)} to {value_text(signal.high)}"
        shape.refuse("AMX6738", f"it goes from {low:g} to {high:g}; {signal.label} takes {limits}", "amplitude")
        return None
    return Sine(signal.type, mean, amplitude, hz, for_ns)


def _square(shape: _Shape) -> Square | None:
    """Read a square; a BOOLEAN alternates between FALSE and TRUE if the file gives no levels."""
    kind = shape.signal.type
    if kind is DataType.STRING:
        shape.findings.add("AMX6737", f"{shape.what} needs two levels; a STRING has none", shape.span)
        return None
    levels = () if kind is DataType.BOOLEAN else ("low", "high")
    if not shape.requires(*levels, "hz"):
        return None
    low = shape.level("low") if "low" in shape.section else False
    high = shape.level("high") if "high" in shape.section else True
    hz, for_ns = shape.hz, shape.time("for")
    if low is None or high is None or hz is None or (for_ns is None and "for" in shape.section):
        return None
    return Square(low, high, hz, for_ns)


def _real(shape: _Shape, key: str) -> float | None:
    node = shape.section.get(key)
    limit = float(DataType.REAL.range[1])
    if node is None:
        return None
    return number_value(node, f"{key} of {shape.what}", shape.findings, low=-limit, high=limit, code="AMX6738")
