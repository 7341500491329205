"""Routes wires: in each channel between two layers every net that bends there has a track of its own."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from automax_ros.diagram.grid import Grid, Hop

_TRACK, _MARGIN, _NEAR = 10, 12, 5
"""Distance of tracks, of a track from what stands next to it; ends this near would touch, px."""
Spot = tuple[int, int]


@dataclass(eq=False)
class Trunk:
    """The upright part of a net in a channel, with the heights of its ends; ``track`` counts from the left.

    ``other`` is a second trunk, to which it leads at the height ``bend``, where one alone would touch another net.
    """

    left: list[int]
    right: list[int]
    track: int = 0
    bend: int = 0
    other: Trunk | None = None

    @property
    def span(self) -> tuple[int, int]:
        """Its upper and lower end."""
        return min(*self.left, *self.right), max(*self.left, *self.right)

    def x(self, start: int, *, is_left: bool) -> int:
        """Return where it is, for its ends at the left or the right, in a channel that begins at ``start``, px."""
        trunk = self if is_left or self.other is None else self.other
        return start + _MARGIN + _TRACK * trunk.track


def trunks_of(grid: Grid, hops: Mapping[int, Hop]) -> tuple[dict[int, Trunk], int]:
    """Return the trunks of the nets of a channel that bend there, and the number of tracks."""
    ends = {
        net: Trunk(
            [grid.y[node] + below for node, below in hop.left], [grid.y[node] + below for node, below in hop.right]
        )
        for net, hop in hops.items()
    }
    found = {net: trunk for net, trunk in ends.items() if trunk.span[0] != trunk.span[1]}
    done: list[Trunk] = []
    taken = [y for trunk in ends.values() for y in (*trunk.left, *trunk.right)]
    for trunk in _from_left(list(found.values()), taken):
        low, high = trunk.span
        before = [item.track for item in done if item.span[0] <= high + _NEAR and low <= item.span[1] + _NEAR]
        trunk.track = max(before, default=-1) + 1
        done.append(trunk)
    return found, max((trunk.track for trunk in done), default=-1) + 1


def width_of(tracks: int) -> int:
    """Return the width of a channel with this many tracks, px."""
    return 2 * _MARGIN + _TRACK * max(tracks - 1, 0)


def _blocked(trunks: Sequence[Trunk]) -> dict[Trunk, set[Trunk]]:
    """Return for each trunk those that must be left of it: a left end of theirs would touch a right end of its own."""
    lefts: dict[int, list[tuple[int, Trunk]]] = defaultdict(list)
    for trunk in trunks:
        for y in trunk.left:
            lefts[y // _NEAR].append((y, trunk))
    found: dict[Trunk, set[Trunk]] = {trunk: set() for trunk in trunks}
    for trunk in trunks:
        near = (item for y in trunk.right for away in (-1, 0, 1) for item in lefts.get(y // _NEAR + away, ()))
        for left, other in near:
            is_own = other is trunk or other.other is trunk or trunk.other is other
            if not is_own and any(abs(left - y) < _NEAR for y in trunk.right):
                found[trunk].add(other)
    return found


def _crossings(one: Trunk, other: Trunk) -> int:
    """Return how often two nets cross if one stands left of the other."""
    (low, high), (top, bottom) = one.span, other.span
    return sum(top < y < bottom for y in one.right) + sum(low < y < high for y in other.left)


def _from_left(trunks: Sequence[Trunk], taken: list[int]) -> list[Trunk]:
    """Return trunks from left to right: what must be left, then what crosses least; circles are split in two trunks.

    ``taken`` are the heights of all ends in the channel.
    """
    waiting, ordered = sorted(trunks, key=lambda trunk: (trunk.span, trunk.left)), []
    worse = {one: sum(_crossings(one, two) - _crossings(two, one) for two in waiting) for one in waiting}
    blocked = _blocked(waiting)
    while waiting:
        free = [one for one in waiting if not blocked[one]]
        if free:
            chosen = min(free, key=worse.__getitem__)
            waiting.remove(chosen)
            ordered.append(chosen)
            for one in waiting:
                worse[one] -= _crossings(one, chosen) - _crossings(chosen, one)
                blocked[one].discard(chosen)
            continue
        circles = [one for one in waiting if any(one in others for others in blocked.values())]
        split = min(circles, key=lambda one: one.span[1] - one.span[0])
        split.bend = _free_height(sum(split.span) // 2, taken)
        taken.append(split.bend)
        split.other = Trunk([split.bend], split.right)
        split.right = [split.bend]
        waiting.append(split.other)
        worse[split.other], blocked = 0, _blocked(waiting)
    return ordered


def _free_height(middle: int, taken: Sequence[int]) -> int:
    """Return the height nearest to ``middle`` at which no wire of the channel begins or ends."""
    places = (middle + sign * away for away in range(_NEAR * 2 * len(taken) + _NEAR) for sign in (1, -1))
    return next(y for y in places if all(abs(y - other) >= _NEAR for other in taken))
