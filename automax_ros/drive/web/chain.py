"""A line at run time: webs, their ends and couplings that hang together pass time as one system of equations.

Time goes in slices, the same for all plants of a chain. Within one, each motor turns by itself with a constant torque
of its webs, that of the middle of the slice (leapfrog, corrected to fourth order); then the webs go by what the motors
did. So a plant can be advanced to an instant within a slice without the others, and where advancing is cut decides
nothing but the last bits.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from math import sqrt
from typing import Final

from automax_ros.drive.base.errors import ParameterError
from automax_ros.drive.plant.coupling import CoupledPlants
from automax_ros.drive.plant.plant import DrivePlant
from automax_ros.drive.web.data import Roll, SurfaceData, WebData
from automax_ros.drive.web.end import WebEnd, WebTime
from automax_ros.drive.web.span import WebSpan
from automax_ros.drive.web.traction import slide

SLICE_RAD: Final = 0.15
"""Longest slice, in radians of the fastest swing of the chain's tensions (decision: a free swing of taut webs stays
true to 0.01 %, and the jerk of a slack web that becomes taut to 0.2 %)."""
LONGEST_SLICE_NS: Final = 2_500_000
"""Longest slice, ns (decision: as long as a firing interval; what webs with swings below 60 rad/s then miss is 0.005 %
of their tension). A motor turns by less than half a turn in it."""
SHORTEST_SLICE_NS: Final = 10_000
"""Shortest slice, ns (decision: stays stable up to swings of 200,000 rad/s, and true up to 15,000)."""


class Member:
    """What passes time by itself within a slice: a plant, or two that are coupled."""

    def __init__(self, chain: WebChain, plant: DrivePlant, pair: CoupledPlants | None) -> None:
        self._chain = chain
        self._plant = plant
        self._pair = pair
        self.plants = [plant] if pair is None else [pair.first, pair.second]
        self.first: WebEnd | None = None
        self.second: WebEnd | None = None
        self._own_kg_m2 = plant.motor.inertia_kg_m2
        for each in self.plants:
            each.go_together(self.advance)

    @property
    def now_ns(self) -> int:
        """The present, ns."""
        return self._plant.now_ns

    def put(self, end: WebEnd) -> None:
        """Put an end on one of its plants."""
        if end.plant is self._plant:
            self.first = end
        else:
            self.second = end

    def turn_at(self, end: WebEnd, speed_rad_s: float) -> None:
        """Set the speed of the motor of an end, rad/s."""
        if self._pair is None:
            end.motor.speed_rad_s = speed_rad_s
        else:
            self._pair.coupling.turn_at(speed_rad_s, first=end is self.first)

    def carry(self) -> None:
        """Give the motors the inertias of the rolls as they are."""
        first = 0.0 if self.first is None else self.first.inertia_kg_m2
        if self._pair is not None:
            self._pair.coupling.carry(first, 0.0 if self.second is None else self.second.inertia_kg_m2)
        else:
            self._plant.motor.inertia_kg_m2 = self._own_kg_m2 + first

    def advance(self, until_ns: int) -> None:
        """Advance to an instant, ns, and all that hangs together up to the slice in which it is."""
        chain = self._chain
        if until_ns > chain.ends_ns:
            chain.pass_slices(until_ns)
        self.go(until_ns)

    def go(self, until_ns: int) -> None:
        """Advance to an instant of the present slice, ns."""
        if self._pair is not None:
            self._pair.advance(until_ns)
        else:
            self._plant.advance_alone(until_ns)


class WebChain(WebTime):
    """All that hangs together, advanced as one system.

    Attributes:
        ends, webs, couplings: what it was created from.
        began_ns, ends_ns: bounds of the present slice, ns.
    """

    def __init__(
        self,
        ends: Mapping[str, WebEnd],
        webs: Mapping[str, tuple[str, str, WebSpan]],
        couplings: Mapping[str, CoupledPlants],
    ) -> None:
        """Create the chain at the plants' start.

        Args:
            ends: rolls and rollers by plant.
            webs: (from, to, span) by web, from the first end of each strand to its last.
            couplings: the couplings of these plants, with plants that have no end too.
        """
        self.ends, self.webs, self.couplings = dict(ends), dict(webs), dict(couplings)
        self._ends = list(ends.values())
        self._spans = [span for _, _, span in webs.values()]
        self._there: list[WebSpan] = []
        self._rolls = [end for end in self._ends if end.roll is not None]
        before = {sink: span for _, sink, span in webs.values()}
        after = {source: span for source, _, span in webs.values()}
        self._rollers = [
            (end, before.get(name), after.get(name))
            for name, end in ends.items()
            if end.roll is None and (name in before or name in after)
        ]
        self._members = [Member(self, pair.first, pair) for pair in couplings.values()]
        coupled = {id(plant): member for member in self._members for plant in member.plants}
        for end in self._ends:
            end.time = self
            member = coupled.get(id(end.plant))
            if member is None:
                member = Member(self, end.plant, None)
                self._members.append(member)
            member.put(end)
        self.began_ns = self.ends_ns = self._ends[0].plant.now_ns
        self.carry()
        self.begin()

    def advance(self, until_ns: int) -> None:
        """Advance all plants to an instant, ns; an instant in the past counts as the present."""
        for member in self._members:
            member.advance(until_ns)

    def pass_slices(self, until_ns: int) -> None:
        """Pass slices up to the one that an instant (ns) is in, or at the end of."""
        while self.ends_ns < until_ns:
            ends_ns = self.ends_ns
            for member in self._members:
                member.go(ends_ns)
            self._finish(ends_ns)
            self._begin()

    def settle(self) -> None:
        """End the slice at the present of the plant that is ahead."""
        now_ns = max([member.now_ns for member in self._members])
        if now_ns > self.began_ns:
            for member in self._members:
                member.go(now_ns)
            self._finish(now_ns)

    def begin(self) -> None:
        """Begin a slice where the last one ended."""
        self.arrange()
        self._begin()

    def arrange(self) -> None:
        """Note which webs there are."""
        self._there = [span for span in self._spans if not span.broken]
        for end in self._ends:
            end.webs, end.growth, end.supply = 0, 0.0, 1.0
        for span in self._there:
            source, sink = span.source, span.sink
            source.webs += 1
            sink.webs += 1
            if source.roll is not None:
                source.growth, source.supply = -1.0, 1.0 / (1.0 + source.roll.wound_at_n / span.stiffness_n)
            if sink.roll is not None:
                sink.growth, sink.supply = 1.0, 1.0 / (1.0 + sink.roll.wound_at_n / span.stiffness_n)

    def turn_at(self, end: WebEnd, speed_mps: float) -> None:
        """Bring the surface of an end to a speed, m/s, at once; a held shaft keeps its own."""
        for member in self._members:
            if (end is member.first or end is member.second) and not end.motor.held:
                member.turn_at(end, speed_mps * end.gear / (end.sign * end.radius_m))

    def carry(self) -> None:
        """Give the motors the inertias of the rolls as they are."""
        for member in self._members:
            member.carry()

    def _begin(self) -> None:
        """Find the torques of a slice."""
        ends, there = self._ends, self._there
        for end in ends:
            end.look()
        fastest = 0.0
        for span in there:
            fastest = max(fastest, span.begin())
        slice_ns = LONGEST_SLICE_NS
        if fastest > (SLICE_RAD / (LONGEST_SLICE_NS * 1e-9)) ** 2:
            slice_ns = max(SHORTEST_SLICE_NS, int(SLICE_RAD * 1e9 / sqrt(fastest)))
        self.ends_ns = self.began_ns + slice_ns
        time_s = slice_ns * 1e-9
        half_s = 0.5 * time_s
        for span in there:
            span.predict(half_s)
        for end, before, after in self._rollers:
            if (end.grip or end.slip is not None) and slide(end, before, after) != 0.0:
                if before is not None:
                    before.slide(half_s)
                if after is not None:
                    after.slide(half_s)
        for span in there:
            span.pull()
        for end in ends:
            end.accelerate()
        for span in there:
            span.refine(time_s * time_s / 12.0)
        for end in ends:
            end.apply()

    def _finish(self, now_ns: int) -> None:
        """Let the webs go by what the motors did in the slice up to now."""
        there = self._there
        time_s = (now_ns - self.began_ns) * 1e-9
        self.began_ns = now_ns
        for end in self._ends:
            end.follow(time_s)
        for span in there:
            if span.hangs:
                span.swing(time_s)
        count = len(there)
        start = 0
        while start < count:
            # Where a roller turns backwards, the web comes from the span after it: that one flows first.
            last = start
            while last + 1 < count and there[last].sink is there[last + 1].source and there[last].sink.way_m < 0.0:
                last += 1
            for number in range(last, start - 1, -1):
                there[number].flow()
            start = last + 1
        for end, before, after in self._rollers:
            if end.grip or end.slip is not None:
                end.slipped_m += slide(end, before, after)
                if end.slip is not None and not end.has_note():
                    end.slip = None
        whole = True
        for span in there:
            whole = span.finish() and whole
        if not whole:
            self.arrange()
        if self._rolls:
            self.carry()


@dataclass(frozen=True)
class Line:
    """The ends by plant, the spans by web, and the chains that advance them."""

    ends: dict[str, WebEnd]
    spans: dict[str, WebSpan]
    chains: tuple[WebChain, ...]


def build_chains(
    plants: Mapping[str, DrivePlant],
    surfaces: Mapping[str, SurfaceData],
    webs: Mapping[str, tuple[str, str, WebData]],
    couplings: Mapping[str, CoupledPlants],
) -> Line:
    """Put rolls and rollers on the plants at their start, and webs between them; a web is (from, to, data).

    Couplings of plants without roll and roller stay as they are.

    Raises:
        ParameterError: an end of a web is missing or has too many webs, or webs close to a ring.
    """
    for name, (source, sink, _) in webs.items():
        for plant in (source, sink):
            if plant not in plants or plant not in surfaces:
                raise ParameterError(f"web {name}: {plant} has neither roll nor roller: give it one, with its motor")
    order = in_order(surfaces, webs)
    ends = {name: WebEnd(plants[name], data) for name, data in surfaces.items() if name in plants}
    spans = {name: WebSpan(data, ends[source], ends[sink]) for name, (source, sink, data) in webs.items()}
    links = [(source, sink) for source, sink, _ in webs.values()]
    names = {id(plant): name for name, plant in plants.items()}
    links += [(names[id(pair.first)], names[id(pair.second)]) for pair in couplings.values()]
    chains = []
    for group in groups_of(plants, links):
        held = {name: ends[name] for name in plants if name in group and name in ends}
        if held:
            chain_webs = {name: (*webs[name][:2], spans[name]) for name in order if webs[name][0] in group}
            pairs = {name: pair for name, pair in couplings.items() if names[id(pair.first)] in group}
            chains.append(WebChain(held, chain_webs, pairs))
    return Line(ends, spans, tuple(chains))


def in_order(surfaces: Mapping[str, SurfaceData], webs: Mapping[str, tuple[str, str, WebData]]) -> list[str]:
    """Return the webs in the order in which they hang together, from the first end of each strand on.

    Raises:
        ParameterError: an end has too many webs, or webs close to a ring.
    """
    leaving: dict[str, str] = {}
    coming: dict[str, str] = {}
    for name, (source, sink, _) in webs.items():
        for plant, found, what in ((source, leaving, "leave"), (sink, coming, "come to")):
            if plant in found:
                raise ParameterError(f"webs {found[plant]} and {name} {what} {plant}: it has room for one")
            found[plant] = name
    for plant, name in leaving.items():
        if plant in coming and isinstance(surfaces[plant].surface, Roll):
            raise ParameterError(f"webs {coming[plant]} and {name} are on the roll of {plant}: it has room for one")
    order: list[str] = []
    for first in webs:
        if webs[first][0] not in coming:
            here: str | None = first
            while here is not None:
                order.append(here)
                here = leaving.get(webs[here][1])
    if len(order) < len(webs):
        ring = ", ".join(name for name in webs if name not in order)
        raise ParameterError(f"webs {ring} close to a ring: a web begins at one plant and ends at another")
    return order


def groups_of(names: Iterable[str], links: Iterable[tuple[str, str]]) -> list[list[str]]:
    """Return names in groups that links hold together, in the order of their first names."""
    group = {name: [name] for name in names}
    for one, two in links:
        first, second = group[one], group[two]
        if first is not second:
            first.extend(second)
            for name in second:
                group[name] = first
    found: list[list[str]] = []
    for item in group.values():
        if not any(item is other for other in found):
            found.append(item)
    return found
