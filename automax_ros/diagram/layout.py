"""Places a diagram: boxes in layers from left to right, few crossings, straight main paths, room for every wire.

The layered method of Sugiyama, without its first step: a wire leads from a statement to a later one, so there are no
circles, and feedback runs back in lanes of its own. A wire that passes layers has a lane in each; all wires of a net
share theirs. Nothing depends on hashes or chance: the same task has the same drawing.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right, insort
from collections import defaultdict
from collections.abc import Sequence
from itertools import accumulate, pairwise

from automax_ros.diagram.grid import FLAG_HEIGHT, Grid, Port, grid_of
from automax_ros.diagram.model import Diagram

_BOX_GAP, _LANE_GAP, _FLAG_GAP = 26, 12, 4
"""Least free height between neighbours of a layer, px."""
_SWEEPS, _LARGE = 12, 2500
"""Sweeps over all layers, fewer for more nodes than this."""
_TRIED, _MANY = 3, 500
"""Orders of the nodes that are placed, of which the best stays; of this many nodes or more only one is."""
_BEND, _CROSSING = 40, 200
"""What a bend and a crossing cost, in px of bends of weight 1."""
_VISITS = 60_000
"""Most nodes that are moved on trial (decision: a bound on time)."""


def laid_out(diagram: Diagram) -> Grid:
    """Return the nodes of a diagram in layers, in their order and with their heights."""
    grid = grid_of(diagram)
    tried: list[tuple[int, int, list[list[int]], list[int]]] = []
    for crossings, order in _Order(grid).best():
        grid.order = order
        cost = _Heights(grid).settle() + _CROSSING * crossings
        tried.append((cost, len(tried), grid.order, grid.y))
    _, _, grid.order, grid.y = min(tried)
    return grid


class _Order:
    """The order of the nodes in each layer: sweeps by barycentre, then exchanges of neighbours."""

    def __init__(self, grid: Grid) -> None:
        self._grid, self._order = grid, grid.order
        self._sweeps = _sweeps(grid)
        self._rank = [0.0] * len(grid.layer)
        self._sides: tuple[dict[int, list[Port]], ...] = (defaultdict(list), defaultdict(list))
        self._turns: dict[int, list[tuple[int, int]]] = defaultdict(list)
        for one, other in (edge for edges in grid.edges for edge in edges):
            self._sides[0][other[0]].append(one)
            self._sides[1][one[0]].append(other)
        for side, lane, port in grid.turns:
            self._turns[lane[0]].append((port[0], side))
            self._turns[port[0]].append((lane[0], side))
        for nodes in self._order:
            self._number(nodes)

    def best(self) -> list[tuple[int, list[list[int]]]]:
        """Return the best orders that are found, with their crossings."""
        found: dict[str, tuple[int, list[list[int]]]] = {}
        for sweep in range(self._sweeps):
            for nodes in reversed(self._order) if sweep % 2 else self._order:
                centre = {node: self._centre(node, sweep % 2) for node in nodes}
                nodes.sort(key=centre.__getitem__)
                self._number(nodes)
            for _ in range(self._sweeps):
                if not self._exchange():
                    break
            order = [list(nodes) for nodes in self._order]
            found.setdefault(repr(order), (self._crossings(), order))
        return sorted(found.values(), key=lambda item: item[0])[: _TRIED if len(self._rank) < _MANY else 1]

    def _number(self, nodes: Sequence[int]) -> None:
        for rank, node in enumerate(nodes):
            self._rank[node] = rank

    def _place(self, port: Port) -> float:
        return self._rank[port[0]] + port[1] / (self._grid.sizes[port[0]].height + 1)

    def _centre(self, node: int, side: int) -> float:
        places = [self._place(port) for port in self._sides[side][node]]
        places += [self._rank[other] + 0.5 for other, _ in self._turns[node]]
        return sum(places) / len(places) if places else self._rank[node]

    def _crossings(self) -> int:
        count = 0
        for edges in self._grid.edges:
            ends: list[float] = []
            for _, end in sorted((self._place(one), self._place(other)) for one, other in edges):
                count += len(ends) - bisect_right(ends, end)
                insort(ends, end)
        return count

    def _exchange(self) -> bool:
        """Exchange neighbours where fewer wires cross then; return whether any were."""
        changed = False
        for nodes in self._order:
            for rank in range(len(nodes) - 1):
                upper, lower = nodes[rank : rank + 2]
                if self._cost(upper, lower) > self._cost(lower, upper):
                    nodes[rank : rank + 2] = lower, upper
                    self._rank[upper], self._rank[lower] = rank + 1, rank
                    changed = True
        return changed

    def _cost(self, upper: int, lower: int) -> int:
        """Return how many wires of two neighbours cross if one is above the other."""
        cost = 0
        for side in self._sides:
            ends = [self._place(port) for port in side[lower]]
            cost += sum(1 for port in side[upper] for end in ends if self._place(port) > end)
        for node, passed, sign in ((upper, lower, 1), (lower, upper, -1)):
            for other, way in self._turns[node]:
                if other != passed and (self._rank[other] - self._rank[passed]) * sign > 0:
                    cost += len(self._sides[way][passed])
        return cost


class _Heights:
    """The heights of the nodes, in their order, at the least sum of weighted bends that is found."""

    def __init__(self, grid: Grid) -> None:
        self._grid, self._visits = grid, _VISITS
        self._wants: tuple[list[list[tuple[int, int, int, int]]], ...] = tuple([[] for _ in grid.layer] for _ in "12")
        """For each side and node: a port below its top, the node and the port to which it leads, the weight."""
        for edges in grid.edges:
            for (one, other), weight in edges.items():
                self._wants[0][other[0]].append((other[1], *one, weight))
                self._wants[1][one[0]].append((one[1], *other, weight))
        for side, lane, port in grid.turns:
            self._wants[side][lane[0]].append((0, *port, 1))
            self._wants[side][port[0]].append((port[1], *lane, 1))
        self._both = [[*one, *other] for one, other in zip(*self._wants, strict=True)]
        self._above, self._below, self._gaps = ([-1] * len(grid.layer) for _ in "123")
        for nodes in grid.order:
            for above, below in pairwise(nodes):
                self._below[above], self._above[below] = below, above
                self._gaps[above] = self._gap(above, below)

    def settle(self) -> int:
        """Place all nodes; return what bends cost."""
        grid = self._grid
        grid.y = [0] * len(grid.layer)
        few = _sweeps(grid) // 3
        for sides in [(0,), (1,)] * few + [(0, 1)] * (few + 2):
            for nodes in grid.order if 0 in sides else reversed(grid.order):
                self._place(nodes, sides)
        for turn in range(2 * _SWEEPS):
            if not self._push(lanes_only=turn % 2 == 0) and turn % 2:
                break
        self._close_bands()
        bends = [
            weight * abs(bend) + (_BEND if bend else 0)
            for node in range(len(grid.y))
            for bend, _, weight in self._bends(node, self._wants[0])
        ]
        return sum(bends)

    def _gap(self, above: int, below: int) -> int:
        """Return the least distance between the tops of two neighbours."""
        grid = self._grid
        boxes = len([node for node in (above, below) if grid.sizes[node].height > FLAG_HEIGHT])
        free = _BOX_GAP if boxes == 2 else _LANE_GAP if boxes or max(above, below) >= grid.first_lane else _FLAG_GAP
        return grid.sizes[above].height + free

    def _bends(self, node: int, wants: list[list[tuple[int, int, int, int]]]) -> list[tuple[int, int, int]]:
        """Return the bends of a node's wires, with the nodes at their other ends and their weights."""
        y = self._grid.y
        return [(y[other] + far - y[node] - own, other, weight) for own, other, far, weight in wants[node]]

    def _place(self, nodes: Sequence[int], sides: Sequence[int]) -> None:
        """Place a layer best for the layers next to it, which stay: isotonic regression by weighted medians."""
        y, offset, offsets = self._grid.y, 0, []
        groups: list[tuple[list[tuple[int, float]], int, int]] = []
        for node in nodes:
            offsets.append(offset)
            wants: list[tuple[int, float]] = [(y[node] - offset, 0.1)]
            for side in sides:
                wants += [(y[node] + bend - offset, weight) for bend, _, weight in self._bends(node, self._wants[side])]
            count = 1
            while groups and groups[-1][2] > _median(wants):
                wants = groups[-1][0] + wants
                count += groups.pop()[1]
            groups.append((wants, count, _median(wants)))
            offset += self._gaps[node]
        places = [middle for _, count, middle in groups for _ in range(count)]
        for node, place, offset in zip(nodes, places, offsets, strict=True):
            y[node] = place + offset

    def _push(self, *, lanes_only: bool) -> bool:
        """Move nodes that straight wires join together, and what is in their way, where that saves bends."""
        y, group, changed = self._grid.y, self._groups(lanes_only), False
        members: dict[int, list[int]] = defaultdict(list)
        for node, number in enumerate(group):
            members[number].append(node)
        for number, items in members.items():
            bends = {bend for node in items for bend, to, _ in self._bends(node, self._both) if group[to] != number}
            up = sorted((bend for bend in bends if bend < 0), reverse=True)
            down = sorted(bend for bend in bends if bend > 0)
            for step in (*up[:2], *down[:2]):
                moved = self._pushed(items, step, group, members)
                self._visits -= len(moved)
                if self._visits < 0:
                    return False
                if self._gain(moved, step) > 0:
                    for node in moved:
                        y[node] += step
                    changed = True
                    break
        return changed

    def _groups(self, lanes_only: bool) -> list[int]:
        """Return for each node the number of its group: nodes that straight wires join, or straight lanes alone."""
        grid, group = self._grid, list(range(len(self._grid.y)))

        def root(node: int) -> int:
            while group[node] != node:
                node = group[node]
            return node

        for (one, at), (other, far) in (edge for edges in grid.edges for edge in edges):
            if grid.y[one] + at == grid.y[other] + far and not (lanes_only and min(one, other) < grid.first_lane):
                group[root(other)] = root(one)
        return [root(node) for node in range(len(group))]

    def _pushed(self, items: Sequence[int], step: int, group: Sequence[int], members: dict[int, list[int]]) -> set[int]:
        """Return the nodes that move if ``items`` move by ``step``: with what stands in the way its group goes too."""
        y, moved, pending = self._grid.y, set(items), list(items)
        while pending:
            node = pending.pop()
            other = (self._below if step > 0 else self._above)[node]
            if other < 0 or other in moved:
                continue
            upper = node if step > 0 else other
            if abs(y[other] - y[node]) - self._gaps[upper] < abs(step):
                new = [item for item in members[group[other]] if item not in moved]
                moved.update(new)
                pending += new
        return moved

    def _gain(self, moved: set[int], step: int) -> int:
        gain = 0
        for node in moved:
            for bend, other, weight in self._bends(node, self._both):
                if other not in moved:
                    gain += weight * (abs(bend) - abs(bend - step)) + _BEND * ((bend != 0) - (bend != step))
        return gain

    def _close_bands(self) -> None:
        """Move everything up that is below an empty band; the topmost node comes to 0."""
        grid, bottom, up = self._grid, 0, min(self._grid.y, default=0)
        for node in sorted(range(len(grid.y)), key=lambda node: grid.y[node]):
            up += max(0, grid.y[node] - up - bottom - _BOX_GAP)
            grid.y[node] -= up
            bottom = max(bottom, grid.y[node] + grid.sizes[node].height)


def _sweeps(grid: Grid) -> int:
    return max(2, min(_SWEEPS, _SWEEPS * _LARGE // max(len(grid.layer), 1)))


def _median(wants: list[tuple[int, float]]) -> int:
    """Return the lower weighted median."""
    places = sorted(wants)
    sums = list(accumulate(weight for _, weight in places))
    return places[bisect_left(sums, sums[-1] / 2 - 1e-9)][0]
