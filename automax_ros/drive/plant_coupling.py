"""Two plants whose shafts are coupled: whoever looks at one of them lets the time of both pass."""

from __future__ import annotations

from dataclasses import dataclass

from automax_ros.drive.coupling import LEAST_RATIO, MOST_RATIO, Coupling, swing_rad_s
from automax_ros.drive.errors import ParameterError, require
from automax_ros.drive.plant import DrivePlant
from automax_ros.drive.state import SavedState

DAMPING_RATIO = 0.05
"""Damping over the critical one of a coupling without damping of its own (decision: steel shafts and couplings)."""
FASTEST_SWING = 1000.0
"""Fastest swing of a coupling, rad/s (decision: the circuits exchange torque at least every 50 us; what is quicker is a
stiff shaft to every controller of a drive)."""


@dataclass(frozen=True)
class CouplingData:
    """How two plants are coupled.

    Attributes:
        ratio: speed of the first plant's motor over that of the second's.
        stiffness_nm_per_rad: torque per twist at the first motor, N m/rad; None for a stiff shaft.
        damping_nms_per_rad: torque per difference of speeds at the first motor, N m s/rad; None for
            ``DAMPING_RATIO``.
    """

    ratio: float = 1.0
    stiffness_nm_per_rad: float | None = None
    damping_nms_per_rad: float | None = None


class CoupledPlants:
    """Two plants that pass time together.

    Attributes:
        coupling: what is between them.
    """

    def __init__(self, first: DrivePlant, second: DrivePlant, data: CouplingData) -> None:
        """Couple two plants at their start.

        Raises:
            ParameterError: a value is outside its range, the coupling would swing faster than is followed, or a held
                shaft would be coupled stiffly.
        """
        self._first, self._second = first, second
        self.coupling = Coupling(
            first.circuit,
            second.circuit,
            stiffness_n_m_rad=data.stiffness_nm_per_rad,
            damping_n_m_s=_damping(first, second, data),
            ratio=data.ratio,
        )
        first.go_together(self.advance)
        second.go_together(self.advance)

    def advance(self, until_ns: int) -> None:
        """Let the time of both pass to an instant, ns."""
        first, second, coupling = self._first, self._second, self.coupling
        while True:
            due_ns = min(first.contacts_ns, second.contacts_ns, until_ns)
            coupling.advance(int(due_ns))
            moved = [plant for plant in (first, second) if plant.contacts_ns <= due_ns]
            if not moved:
                return
            for plant in moved:
                plant.switch_contacts()

    def state(self) -> SavedState:
        """Return what the shaft between them has in it; the plants have states of their own."""
        return self.coupling.state()

    def restore(self, state: SavedState) -> None:
        """Take a state over.

        Raises:
            ParameterError: it is not the state of a coupling.
        """
        self.coupling.restore(state)


def _damping(first: DrivePlant, second: DrivePlant, data: CouplingData) -> float:
    """Return the damping, N m s/rad, of a coupling whose swing the model follows."""
    if data.stiffness_nm_per_rad is None:
        return 0.0
    require("ratio of the coupling", data.ratio, LEAST_RATIO, MOST_RATIO)
    require("stiffness of the coupling in N m/rad", data.stiffness_nm_per_rad, 0.0, above=True)
    stiffness = data.stiffness_nm_per_rad
    swing = swing_rad_s(first.motor, second.motor, stiffness, data.ratio)
    # Critical damping of a spring K and an inertia J is 2 sqrt(K J); the swing is sqrt(K / J).
    damping = data.damping_nms_per_rad
    if damping is None:
        damping = 2 * DAMPING_RATIO * stiffness / swing if swing else 0.0
    rate = max(swing, damping * swing**2 / stiffness)
    if rate > FASTEST_SWING:
        raise ParameterError(
            f"the coupling would swing or settle at {rate:.4g} rad/s; the model follows {FASTEST_SWING:g} at most: "
            "take less stiffness or damping, or leave the stiffness out for a stiff shaft"
        )
    return damping
