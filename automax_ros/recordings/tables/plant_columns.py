"""Signals of plants as columns: names such as ``UNWIND/current_a``, from the recorded PlantStates."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

from automax_ros.core.text import near_or_listed
from automax_ros.core.types import DataType
from automax_ros.messages.types.messages import PlantState
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.recordings.read.common_log import Watched
from automax_ros.recordings.tables.locals import NOT_COMMON

UNITS = {
    "current_a": "A",
    "current_rms_a": "A",
    "voltage_v": "V",
    "torque_nm": "N m",
    "load_nm": "N m",
    "speed_rpm": "rpm",
    "position_rad": "rad",
    "field": "",
    "line_hz": "Hz",
    "line_v": "V",
    "line_j": "J",
    "loss_j": "J",
    "stored_j": "J",
    "shaft_j": "J",
}
"""Units of the signals that are REALs; ``bridge`` is an INTEGER, ``contactor`` a BOOLEAN."""
_KINDS = {**dict.fromkeys(UNITS, DataType.REAL), "bridge": DataType.INTEGER, "contactor": DataType.BOOLEAN}
_NAME = re.compile(r"(?P<plant>[A-Z][A-Z0-9_]{0,63})/(?P<signal>[A-Z_]{1,40})")
_HINT = "write PLANT/SIGNAL, such as UNWIND/current_a"


def is_plant(name: str) -> bool:
    """Whether a requested name is that of a plant's signal: no other name has a slash."""
    return "/" in name


class WatchedPlants:
    """The watched signals of plants.

    Raises:
        BagError: a name is not that of a signal.
    """

    def __init__(self, bag: Path) -> None:
        self._bag = bag
        self._columns: dict[str, Watched] = {}
        self._asked: dict[str, list[tuple[int, str]]] = {}
        self._seen: set[str] = set()

    def add(self, column: int, asked: str) -> Watched:
        """Watch a signal, in the column of this index unless it has one already; return its description."""
        match = _NAME.fullmatch("".join(asked.upper().split()))
        if match is None:
            raise BagError("AMX6821", self._bag, f"{asked[:80]!r} is not a name of a plant's signal", _HINT)
        plant, signal = match["plant"], match["signal"].lower()
        if signal not in _KINDS:
            text = f"a plant has no signal {signal!r}"
            raise BagError("AMX6821", self._bag, text, near_or_listed(signal, _KINDS, f"{plant}/"))
        label = f"{plant}/{signal}"
        if label not in self._columns:
            kind, unit = _KINDS[signal], UNITS.get(signal, "")
            self._columns[label] = Watched(label, NOT_COMMON, column, kind, unit)
            self._asked.setdefault(plant, []).append((column, signal))
        return self._columns[label]

    def values(self, state: PlantState) -> Iterator[tuple[int, float]]:
        """Yield column and value of each watched signal in the state of a plant."""
        self._seen.add(state.plant)
        for column, signal in self._asked.get(state.plant, ()):
            yield column, getattr(state, signal)

    def require_all(self) -> None:
        """Check that the recording contained states of all requested plants.

        Raises:
            BagError: it contained none of a plant.
        """
        missing = [plant for plant in self._asked if plant not in self._seen]
        if missing:
            hint = f"it holds those of {', '.join(sorted(self._seen)[:8])}" if self._seen else ""
            raise BagError("AMX6850", self._bag, f"holds no states of a plant {missing[0][:40]!r}", hint)
