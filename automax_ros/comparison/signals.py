"""The signals of plants, rolls and webs that a recording has, by the names under which they are read."""

from __future__ import annotations

from collections.abc import Collection, Mapping

from automax_ros.drive.web.signals import END_KINDS, WEB_KINDS
from automax_ros.messages.types.messages import NAMES, PlantState, RollState, WebState
from automax_ros.rackfile.model.plant_signals import SIGNAL_KINDS
from automax_ros.recordings.read.reader import BagReader

_SIGNALS: Mapping[str, Collection[str]] = {
    NAMES[PlantState]: SIGNAL_KINDS,
    NAMES[RollState]: END_KINDS,
    NAMES[WebState]: WEB_KINDS,
}
"""The signals in the messages of a type; the last part of their topic is the name of what they are of."""


def plain_name(name: str) -> str:
    """Return a variable's or signal's name as it is looked up: capitals, no blanks, round brackets, no slash."""
    return "".join(name.upper().split()).replace("[", "(").replace("]", ")").replace("/", ".")


def recorded_signals(reader: BagReader) -> list[str]:
    """Return the signals of a recording, such as ``UNWIND/speed_rpm`` and ``W1/tension_n``.

    There are none where it does not list its topics.
    """
    found: list[str] = []
    for topic, kind in reader.topics.items():
        found += [f"{topic.rpartition('/')[2]}/{signal}" for signal in _SIGNALS.get(kind, ())]
    return list(dict.fromkeys(found))
