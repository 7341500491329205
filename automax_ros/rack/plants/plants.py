"""The plants of a running rack, and their state in snapshots."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from automax_ros.drive.base.errors import DriveError
from automax_ros.drive.base.state import SavedState
from automax_ros.drive.plant.coupling import CoupledPlants
from automax_ros.drive.plant.plant import DrivePlant
from automax_ros.rackfile.model.plants import PlantConfig, build_plants, couple_plants


class RackPlants(dict[str, DrivePlant]):
    """The plants with a motor, by name. They continue whether or not the rack has power."""

    def __init__(self, configs: Sequence[PlantConfig]) -> None:
        """Create all plants, at rest, and couple them."""
        super().__init__(build_plants(configs))
        self._parts: dict[str, DrivePlant | CoupledPlants] = {**self, **couple_plants(self, configs)}

    def state(self) -> dict[str, SavedState]:
        """Return the whole state, by plant; that of a coupling by the names of both plants."""
        return {name: part.state() for name, part in self._parts.items()}

    def load(self, state: Mapping[str, SavedState]) -> None:
        """Restore a state; ValueError if it is not that of these plants."""
        if set(state) != set(self._parts):
            raise ValueError("the state is that of a rack with other plants")
        try:
            for name, part in self._parts.items():
                part.restore(state[name])
        except DriveError as error:
            raise ValueError(f"the state of a plant does not fit: {error}") from error
