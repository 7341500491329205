"""Chooses the signals that the report on a rack shows: what is watched, with unit and scale, and the alarms."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from automax_ros.core.names import NameFault
from automax_ros.core.types import DataType, bare_name
from automax_ros.language.program import Program
from automax_ros.rackfile.model.config import CommonElement, RackConfig
from automax_ros.rackfile.model.value_names import watched
from automax_ros.rackfile.reading.scale import Scale
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.recordings.tables.states import WatchedStates, states_for

REFERENCE_WORDS = frozenset({"REF", "REFERENCE", "SP", "SETPOINT", "SETPT", "CMD", "TARGET"})
"""Words of a name, between underscores, that make it a reference (decision: as the examples and manuals name them)."""


@dataclass(frozen=True)
class LineSignal:
    """A signal that a report shows.

    Attributes:
        label: its name in the recording.
        kind: its type; REAL if it has a scale.
        unit: the unit of ``value_of``.
        text: its description, "" without one.
        scale: what its counts mean, None if its values are shown as they are.
        is_reference: whether others follow it.
    """

    label: str
    kind: DataType
    unit: str = ""
    text: str = ""
    scale: Scale | None = None
    is_reference: bool = False

    def value_of(self, value: float) -> float:
        """Return a recorded value in the signal's unit."""
        return float(value) if self.scale is None else self.scale.value_of(int(value))


def line_signals(
    bag: Path, config: RackConfig, programs: Iterable[Program], recorded: Collection[str], watch: Sequence[str] | None
) -> list[LineSignal]:
    """Return the signals of ``watch``, or those that the rack file watches; of the latter those in the recording.

    ``watch`` may name locals and signals of plants too. ``recorded`` are the names of the recorded commons.

    Raises:
        BagError: a name of ``watch`` is unknown, or that of a text.
    """
    if watch is None:
        return [
            _of_common(item, config)
            for item in watched(config, None, programs)
            if item.name in recorded and item.variable.type is not DataType.STRING
        ]
    found: dict[str, LineSignal] = {}
    for name in watch:
        signal = _named(bag, config, name)
        found.setdefault(signal.label, signal)
    return list(found.values())


def alarm_signals(config: RackConfig, recorded: Collection[str]) -> list[LineSignal]:
    """Return the recorded booleans that the rack file calls alarms; the text of one without description is its name."""
    return [
        LineSignal(item.label, DataType.BOOLEAN, text=item.variable.description or item.label)
        for item in config.alarms
        if item.name in recorded
    ]


def _named(bag: Path, config: RackConfig, name: str) -> LineSignal:
    if states_for([name]):
        item = WatchedStates(bag).add(0, name)
        return LineSignal(item.label, item.kind, item.unit)
    try:
        meant = config.common(name)
    except NameFault as fault:
        raise BagError("AMX6821", bag, fault.message, fault.hint) from fault
    if meant.variable.type is DataType.STRING:
        raise BagError("AMX6828", bag, f"{meant.label} holds texts, which have no numbers", "leave it out")
    return _of_common(meant, config)


def _of_common(item: CommonElement, config: RackConfig) -> LineSignal:
    variable = item.variable
    kind = variable.type if variable.scale is None else DataType.REAL
    commanded = any(command.common == item.label for command in config.joint_commands)
    is_reference = kind is not DataType.BOOLEAN and (commanded or _is_reference(variable.name))
    return LineSignal(item.label, kind, variable.unit.strip(), variable.description, variable.scale, is_reference)


def _is_reference(name: str) -> bool:
    words = bare_name(name).split("_")
    return any(word in REFERENCE_WORDS for word in words) or words[-1].endswith("REF")


def is_followed(reference: LineSignal, signals: Iterable[LineSignal]) -> bool:
    """Whether one of the signals is meant to follow a reference.

    It has its unit and is none itself; where the unit is counts, or there is none, which many a quantity has, their
    names begin with the same word as well (decision).
    """
    for signal in signals:
        if signal.unit != reference.unit or signal.is_reference or signal.kind is DataType.BOOLEAN:
            continue
        if reference.unit.lower() not in _OF_ANYTHING or _stem(signal.label) == _stem(reference.label):
            return True
    return False


_OF_ANYTHING = ("", "count", "counts")


def _stem(label: str) -> str:
    return bare_name(label.partition("(")[0]).partition("_")[0]
