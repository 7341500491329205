"""The span at run time: the web between two ends, with its dancer.

Its state is the unstretched length of web in it: what comes, less what goes. The tension is that of the strain.
"""

from __future__ import annotations

from math import expm1, inf
from typing import Final

from automax_ros.drive.base.state import SavedState, Stateful
from automax_ros.drive.web.data import WebData
from automax_ros.drive.web.end import WebEnd

CREEP_MPS: Final = 0.01
"""Slowest speed of the source at which there is a draw, m/s (decision: below, a ratio of two speeds says nothing)."""


def part_of(x: float) -> float:
    """Return (1 - exp(-x)) / x: which part of its first rate a decay keeps over ``x`` time constants."""
    if x > 0.05 or x < -0.05:
        return -expm1(-x) / x
    return 1.0 - x * (1.0 / 2.0 - x * (1.0 / 6.0 - x * (1.0 / 24.0 - x * (1.0 / 120.0 - x / 720.0))))


class WebSpan(Stateful):
    """A web between two ends.

    Attributes:
        data: what it is made of.
        source, sink: the ends that it comes from and goes to.
        m: unstretched length of web in the span when the slice began, m.
        broken: whether there is no web: broken, run out, or not threaded yet.
        stiffness_n: tension at 100 % strain now, N.
        x_m, v_mps: way and speed of the dancer when the slice began; the span is longer by twice the way.
        pull_n: tension that acts on ends and dancer in this slice, N.
        rate, bend, lift: rate of ``m`` (m/s), its rate (m/s2), and acceleration of the dancer (m/s2) in this slice.
    """

    _kept = ("m", "broken", "stiffness_n", "x_m", "v_mps", "pull_n", "rate", "bend", "lift")

    def __init__(self, data: WebData, source: WebEnd, sink: WebEnd) -> None:
        """Span a web, at rest: without tension and without slack if it is threaded."""
        dancer = data.dancer
        self.data = data
        self.source = source
        self.sink = sink
        self.m = data.length_m
        self.broken = not data.threaded
        self.stiffness_n = data.stiffness_n
        self.x_m = self.v_mps = self.pull_n = 0.0
        self.rate = self.bend = self.lift = 0.0
        self.hangs = dancer is not None
        self.force_n = dancer.force_n if dancer else 0.0
        self.mass_kg = dancer.mass_kg if dancer else 1.0
        self.damping_ns_m = dancer.damping_ns_m if dancer else 0.0
        self.stop_m = 0.5 * dancer.range_m if dancer else 0.0
        self._full_m = data.length_m
        self._breaks_n = inf if data.breaks_above_n is None else data.breaks_above_n
        # What a chain tries within a slice.
        self.trial_m = self.length_m = data.length_m
        self.share = 1.0
        self.slides = False
        self._next_x_m = self._next_mps = 0.0

    # At the present

    def advance(self, until_ns: int) -> None:
        """Advance the plants at both ends to an instant, ns."""
        self.source.plant.advance(until_ns)
        self.sink.plant.advance(until_ns)

    def _since_s(self) -> float:
        """Return the time since the slice began, s, at the end that is ahead."""
        time = self.source.time
        if time is None:
            return 0.0
        return max(self.source.plant.now_ns, self.sink.plant.now_ns) * 1e-9 - time.began_ns * 1e-9

    @property
    def present_m(self) -> float:
        """Unstretched length of web in the span, m."""
        since_s = self._since_s()
        return self.m + since_s * (self.rate + 0.5 * since_s * self.bend)

    @property
    def dancer_m(self) -> float:
        """Way of the dancer from its middle, m; positive lengthens the span."""
        since_s = self._since_s()
        way = self.x_m + since_s * (self.v_mps + 0.5 * since_s * self.lift)
        return min(max(way, -self.stop_m), self.stop_m)

    @property
    def strain(self) -> float:
        """Strain, 0 where the web hangs slack or is broken."""
        return 0.0 if self.broken else max((self._full_m + 2.0 * self.dancer_m) / self.present_m - 1.0, 0.0)

    @property
    def tension_n(self) -> float:
        """Tension, N."""
        return self.stiffness_n * self.strain

    @property
    def slack_m(self) -> float:
        """Length that hangs slack, m; 0 where the web is broken."""
        return 0.0 if self.broken else max(self.present_m - self._full_m - 2.0 * self.dancer_m, 0.0)

    @property
    def draw(self) -> float:
        """Speed of the sink over that of the source, less 1; 0 where the source is slower than ``CREEP_MPS``."""
        speed = self.source.speed_mps
        return self.sink.speed_mps / speed - 1.0 if abs(speed) >= CREEP_MPS else 0.0

    # Events

    def part(self) -> None:
        """Let go of the web: what is in the span is of no further account, and its dancer falls to rest."""
        self.broken = True
        self.m = self._full_m + 2.0 * self.x_m
        self.v_mps = self.pull_n = self.rate = self.bend = self.lift = 0.0

    def thread(self) -> None:
        """Lay a web from end to end without tension."""
        self.part()
        self.broken = False

    def restore(self, state: SavedState) -> None:
        """Restore a state; raises ParameterError if it is not the state of a web."""
        super().restore(state)
        if self.source.time is not None:
            self.source.time.arrange()

    # Within a slice

    def begin(self) -> float:
        """Tell the ends which web passes over them; return the square of the fastest swing of the tension, 1/s2."""
        source, sink = self.source, self.sink
        self.length_m = length = self._full_m + 2.0 * self.x_m
        self.slides = False
        self.share = share = self.m / length if self.m < length else 1.0
        source.back = sink.ahead = share
        give = source.webs * source.give + sink.webs * sink.give
        if self.hangs:
            give += 4.0 / self.mass_kg
        # A row of the chain's matrix of stiffness and inertia: no mode is faster than the greatest.
        return self.stiffness_n / length * give

    def predict(self, half_s: float) -> None:
        """Try the middle of the slice (s from now), at the speeds of its beginning."""
        source, sink = self.source, self.sink
        comes = source.speed * (source.ahead if source.speed >= 0.0 else source.back)
        goes = sink.speed * (sink.ahead if sink.speed >= 0.0 else sink.back)
        self.rate = rate = comes - goes
        if self.m <= self.length_m:
            away = max(sink.speed, 0.0) - min(source.speed, 0.0)
            self.bend = -rate * away / self.length_m
        else:
            self.bend = 0.0
        self.trial_m = self.m + half_s * self.rate
        if self.hangs:
            self.length_m = self._full_m + 2.0 * self._stopped(self.x_m + half_s * self.v_mps)

    def pull(self) -> None:
        """Pull at the ends with the tension of what was tried."""
        self.pull_n = tension = self.tension_of(self.trial_m)
        self.source.pull_n += tension
        self.sink.pull_n -= tension

    def refine(self, weight_s2: float) -> None:
        """Correct the pull by the acceleration of the span: the leapfrog's swings then have their true frequency.

        ``weight_s2`` is a twelfth of the slice's square (Takahashi and Imada, 1984: fourth order).
        """
        source, sink, tension = self.source, self.sink, self.pull_n
        longer = sink.acceleration - source.acceleration
        self.bend = 0.0 if self.slides else self.bend - longer * self.share
        if self.hangs:
            self.lift = (self.force_n - 2.0 * tension - self.damping_ns_m * self.v_mps) / self.mass_kg
            if abs(self.x_m) >= self.stop_m and self.lift * self.x_m > 0.0:
                self.lift = 0.0
            longer += 2.0 * self.lift
        if tension > 0.0 and not self.slides:
            change = max(weight_s2 * self.stiffness_n / self.length_m * longer, -tension)
            self.pull_n += change
            source.pull_n += change
            sink.pull_n -= change

    def slide(self, half_s: float) -> None:
        """Go by what a slipping roller left of the middle of the slice."""
        self.slides = True
        self.rate = (self.trial_m - self.m) / half_s

    def swing(self, time_s: float) -> None:
        """Move the dancer through the slice."""
        decay = self.damping_ns_m * time_s / self.mass_kg
        push = (self.force_n - 2.0 * self.pull_n) * time_s / self.mass_kg
        speed = self.v_mps + part_of(decay) * (push - decay * self.v_mps)
        way = self.x_m + 0.5 * time_s * (self.v_mps + speed)
        self._next_x_m = stopped = self._stopped(way)
        self._next_mps = speed if stopped == way else 0.0
        self.length_m = self._full_m + self.x_m + stopped

    def flow(self) -> None:
        """Let web come and go in the slice: closed at constant speeds, of which the ends' ways are the means."""
        source, sink, m, length = self.source, self.sink, self.m, self.length_m
        comes = away = 0.0
        if source.way_m >= 0.0:
            comes = source.flow_m
        else:
            away = -source.way_m
        if sink.way_m >= 0.0:
            away += sink.way_m
        else:
            comes -= sink.flow_m
        slack = m - length
        if slack >= 0.0 and slack >= away - comes:
            self.trial_m = m + comes - away
        else:
            rest = 1.0
            if slack > 0.0:  # becomes taut within the slice
                m, rest = length, 1.0 - slack / (away - comes)
            fraction = rest * away / length
            self.trial_m = m + part_of(fraction) * (rest * comes - fraction * m)
        gone = self.m + comes - self.trial_m
        if away > 0.0:
            if sink.way_m >= 0.0:
                sink.flow_m = gone * sink.way_m / away
            if source.way_m < 0.0:
                source.flow_m = gone * source.way_m / away

    def finish(self) -> bool:
        """Go to the end of the slice: rolls give and take; return False where the web has run out or torn."""
        source, sink = self.source, self.sink
        self.m = self.trial_m
        if self.hangs:
            self.x_m, self.v_mps = self._next_x_m, self._next_mps
            self.length_m = self._full_m + 2.0 * self.x_m
        there = source.roll is None or source.wind(source.wound_m - source.flow_m)
        there = (sink.roll is None or sink.wind(sink.wound_m + sink.flow_m)) and there
        if there and self.tension_of(self.m) <= self._breaks_n:
            return True
        self.part()
        return False

    def tension_of(self, m: float) -> float:
        """Return the tension at an unstretched length (m) in the span as it is tried, N."""
        return self.stiffness_n * (self.length_m / m - 1.0) if m < self.length_m else 0.0

    def _stopped(self, way_m: float) -> float:
        stop = self.stop_m
        return way_m if -stop <= way_m <= stop else stop if way_m > 0.0 else -stop
