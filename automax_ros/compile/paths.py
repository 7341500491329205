"""Shortest and longest paths through a graph whose edges take time.

Nodes are 0, 1 ...; an edge leads to a node, or out of the graph to an exit that the caller names.
"""

from __future__ import annotations

import heapq
from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class Bounds:
    """The least and the most time, in ns."""

    least: int
    most: int

    def plus(self, other: Bounds) -> Bounds:
        """Return the times of both, one after the other."""
        return Bounds(self.least + other.least, self.most + other.most)

    def joined(self, other: Bounds | None) -> Bounds:
        """Return the bounds of both alternatives."""
        return self if other is None else Bounds(min(self.least, other.least), max(self.most, other.most))


NOTHING = Bounds(0, 0)
Edges = Sequence[Mapping[Hashable, Bounds]]
"""The targets of each node, the number of a node or an exit, with the time to each."""


def ways_out(edges: Edges, entry: int) -> dict[Hashable, Bounds]:
    """Return the least and most time from a node to each exit of the graph.

    On a longest path each node counts once: where edges lead in a circle, one turn counts, of all its nodes (decision).
    """
    least = _least(edges, entry)
    most = _most(edges, entry)
    return {way: Bounds(least[way], most[way]) for way in most}


def longest_turn(edges: Edges, entry: int) -> int:
    """Return the most time on paths from a node, which need not leave the graph, each node once."""
    longest = 0
    arrivals: dict[Hashable, int] = {entry: 0}
    for circle in reversed(_circles(edges, entry)):
        begin = max(arrivals[node] for node in circle if node in arrivals)
        end = begin + sum(max((span.most for span in edges[node].values()), default=0) for node in circle)
        longest = max(longest, end)
        arrivals.update({to: max(arrivals.get(to, 0), end) for node in circle for to in edges[node]})
    return longest


def _is_node(name: Hashable) -> bool:
    return type(name) is int


def _least(edges: Edges, entry: int) -> dict[Hashable, int]:
    reached: dict[Hashable, int] = {entry: 0}
    waiting = [(0, entry)]
    while waiting:
        time, node = heapq.heappop(waiting)
        if time > reached[node]:
            continue
        for to, span in edges[node].items():
            arrival = time + span.least
            if arrival < reached.get(to, arrival + 1):
                reached[to] = arrival
                if isinstance(to, int):
                    heapq.heappush(waiting, (arrival, to))
    return {name: time for name, time in reached.items() if not _is_node(name)}


def _most(edges: Edges, entry: int) -> dict[Hashable, int]:
    arrivals: dict[Hashable, int] = {entry: 0}
    for circle in reversed(_circles(edges, entry)):
        begin = max(arrivals[node] for node in circle if node in arrivals)
        longest = {node: max((span.most for span in edges[node].values()), default=0) for node in circle}
        others = sum(longest.values())
        for node in circle:
            for to, span in edges[node].items():
                if to not in longest:
                    arrival = begin + others - longest[node] + span.most
                    arrivals[to] = max(arrivals.get(to, 0), arrival)
    return {name: time for name, time in arrivals.items() if not _is_node(name)}


def _circles(edges: Edges, entry: int) -> list[list[int]]:
    """Return the reachable nodes, those of one circle together, the last ones first (Tarjan)."""
    found: list[list[int]] = []
    numbers: dict[int, int] = {entry: 0}
    low = {entry: 0}
    stack, open_nodes = [entry], {entry}
    work = [(entry, iter(_nodes_after(edges, entry)))]
    while work:
        node, rest = work[-1]
        to = next(rest, None)
        if to is None:
            work.pop()
            if work:
                low[work[-1][0]] = min(low[work[-1][0]], low[node])
            if low[node] == numbers[node]:
                found.append(_pop_circle(stack, open_nodes, node))
        elif to not in numbers:
            numbers[to] = low[to] = len(numbers)
            stack.append(to)
            open_nodes.add(to)
            work.append((to, iter(_nodes_after(edges, to))))
        elif to in open_nodes:
            low[node] = min(low[node], numbers[to])
    return found


def _nodes_after(edges: Edges, node: int) -> list[int]:
    return [to for to in edges[node] if isinstance(to, int)]


def _pop_circle(stack: list[int], open_nodes: set[int], last: int) -> list[int]:
    circle: list[int] = []
    while not circle or circle[-1] != last:
        circle.append(stack.pop())
        open_nodes.discard(circle[-1])
    return circle
