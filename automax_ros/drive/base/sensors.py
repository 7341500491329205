"""Tachometer and resolver on a motor's shaft, with loss of signal and seeded noise."""

from __future__ import annotations

from math import pi
from random import Random

from automax_ros.drive.base.errors import ParameterError, require
from automax_ros.drive.base.state import SavedState, Stateful, check_names

TURN = 2 * pi


class _Sensor(Stateful):
    """A sensor with a source of noise."""

    def __init__(self, seed: int) -> None:
        self.lost = False
        self._random = Random(seed)

    def state(self) -> SavedState:
        version, words, following = self._random.getstate()
        return super().state() | {"noise": [version, list(words), following]}

    def restore(self, state: SavedState) -> None:
        """Restore a state; readings continue as they would have from it.

        Raises:
            ParameterError: it is not the state of such a sensor.
        """
        check_names("sensor", state, (*self._kept, "noise"))
        super().restore({name: state[name] for name in self._kept})
        try:
            version, words, following = state["noise"]
            self._random.setstate((version, tuple(words), following))
        except (TypeError, ValueError) as error:
            raise ParameterError(f"this is not the state of a sensor's noise: {error}") from error


class Tachometer(_Sensor):
    """A voltage in proportion to speed.

    Attributes:
        volts_per_rad_s: the gain, V s/rad; negative where its wires are swapped.
        noise_v: standard deviation of the noise, V.
        lost: whether it has come off: it then reads noise about 0.
    """

    _kept = ("volts_per_rad_s", "noise_v", "lost")

    def __init__(self, volts_per_1000_rpm: float, *, noise_v: float = 0.0, seed: int = 0) -> None:
        """Create a sound tachometer; readings repeat for the same seed."""
        super().__init__(seed)
        self.volts_per_rad_s = volts_per_1000_rpm * 60 / (1000 * TURN)
        self.noise_v = require("noise in V", noise_v, 0.0)

    def read(self, speed_rad_s: float) -> float:
        """Return the voltage (V) at a speed (rad/s)."""
        volts = 0.0 if self.lost else self.volts_per_rad_s * speed_rad_s
        return volts + self._random.gauss(0.0, self.noise_v) if self.noise_v else volts


class Resolver(_Sensor):
    """The shaft's angle in counts of a turn.

    Attributes:
        counts: counts of one electrical turn.
        speed: electrical turns of one of the shaft (a x1, x2 or x5 resolver).
        noise_rad: standard deviation of the noise, rad of the shaft.
        lost: whether its signal is gone: the last count stays.
    """

    _kept = ("noise_rad", "lost", "_last")

    def __init__(self, counts: int = 4096, *, speed: int = 1, noise_rad: float = 0.0, seed: int = 0) -> None:
        """Create a sound resolver at count 0; readings repeat for the same seed."""
        super().__init__(seed)
        self.counts = int(require("counts of a turn", counts, 2, 1 << 24))
        self.speed = int(require("speed of the resolver", speed, 1, 64))
        self.noise_rad = require("noise in rad", noise_rad, 0.0)
        self._last = 0

    def read(self, angle_rad: float) -> int:
        """Return the count, 0 to counts - 1, at an angle of the shaft (rad)."""
        if self.lost:
            return self._last
        if self.noise_rad:
            angle_rad += self._random.gauss(0.0, self.noise_rad)
        self._last = int(angle_rad * self.speed / TURN % 1.0 * self.counts) % self.counts
        return self._last
