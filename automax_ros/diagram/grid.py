"""What a layout places: boxes, flags and lanes with their sizes, in layers, and what is joined between these."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, field
from itertools import pairwise
from math import ceil

from automax_ros.diagram.model import Diagram, End, Wire

LETTER, SMALL = 6.7, 6.1
"""Width of a character of the fixed-width font at 11 and at 10 px."""
PITCH, FIRST_PIN, LINE, FOOT = 22, 33, 14, 17
"""Distance of pins, of the first pin from the top, of lines of text, height below the last pin, px."""
FLAG_HEIGHT, FLAG_TIP = 18, 8
_VALUE = 8 * LETTER
"""Room for a value that the panel writes."""
_LEAST_WIDTH = 84

Port = tuple[int, int]
"""A node, and how far a wire's end is below its top, px."""


@dataclass
class Size:
    """Width and height of a node, its ``pins`` below its top, and the room for texts left and right of it, px."""

    width: int = 0
    height: int = 0
    left: int = 0
    right: int = 0
    pins: dict[int, int] = field(default_factory=dict)


@dataclass
class Hop:
    """What one net joins in the channel between a layer and the next: ports of the nodes on both sides."""

    left: list[Port] = field(default_factory=list)
    right: list[Port] = field(default_factory=list)


@dataclass
class Grid:
    """The nodes: boxes, then flags, then lanes; ``order`` has those of each layer, ``y`` their tops, px.

    ``edges`` are, between each layer and the next, what is joined from left to right, with the weight of a straight
    wire. ``turns`` are the ends of feedback: a side (0 left, 1 right), a lane, a port of the same layer. ``hops`` are
    by layer and net, ``paths`` the ports of each wire, with the channel before each but the first.
    """

    sizes: list[Size]
    layer: list[int]
    order: list[list[int]] = field(default_factory=list)
    y: list[int] = field(default_factory=list)
    edges: list[dict[tuple[Port, Port], int]] = field(default_factory=list)
    turns: dict[tuple[int, Port, Port], None] = field(default_factory=dict)
    hops: list[dict[int, Hop]] = field(default_factory=list)
    paths: list[list[tuple[int, Port]]] = field(default_factory=list)
    first_lane: int = 0


def grid_of(diagram: Diagram) -> Grid:
    """Return the nodes of a diagram in layers, in the order of the text."""
    grid = Grid([_box_size(diagram, box) for box in range(len(diagram.boxes))], _layers(diagram))
    for flag in diagram.flags:
        room = 0 if flag.out else ceil(_VALUE)
        grid.sizes.append(Size(ceil(len(flag.name) * LETTER) + 8 + FLAG_TIP, FLAG_HEIGHT, right=room))
    grid.first_lane = len(grid.layer)
    layers = max(grid.layer, default=0) + 1
    grid.edges, grid.order = [{} for _ in range(layers)], [[] for _ in range(layers)]
    grid.hops = [defaultdict(Hop) for _ in range(layers)]
    keys = [[float(node)] if node < len(diagram.boxes) else [] for node in range(grid.first_lane)]
    lanes: dict[tuple[int, int, bool], int] = {}
    for wire in diagram.wires:
        _add_wire(diagram, grid, wire, lanes, keys)
    for node in sorted(range(len(grid.layer)), key=lambda node: min(keys[node], default=0.0)):
        grid.order[grid.layer[node]].append(node)
    return grid


def _box_size(diagram: Diagram, number: int) -> Size:
    box, size = diagram.boxes[number], Size()
    rows, symbols = [0, 0], [0]
    top = FIRST_PIN + LINE * len(box.text) + (4 if box.text else 0)
    for place, pin in enumerate(diagram.pins):
        if pin.box != number:
            continue
        size.pins[place] = top + PITCH * rows[pin.out]
        rows[pin.out] += 1
        symbols.append(len(pin.symbol))
        if pin.out:
            text = diagram.nets[pin.net].name if pin.net is not None else pin.var or pin.value
            size.right = max(size.right, ceil(len(text) * SMALL + 10), ceil(_VALUE))
        else:
            room = len(pin.var or pin.value) * LETTER + (_VALUE if pin.var else 0) + 12 * pin.negated + 8
            size.left = max(size.left, ceil(room))
    widths = [len(box.title) * LETTER + 16, 2 * (max(symbols) * SMALL + 9) + 28]
    size.width = ceil(max(_LEAST_WIDTH, *widths, *(len(text) * LETTER + 16 for text in box.text)))
    size.height = top + PITCH * (max(rows) - 1) + FOOT
    return size


def _layers(diagram: Diagram) -> list[int]:
    """Return the layer of each box and flag: boxes far left, but near what they have more nets with; flags outside."""
    count = len(diagram.boxes)
    before: list[set[int]] = [set() for _ in range(count)]
    after: list[set[int]] = [set() for _ in range(count)]
    pull: list[dict[int, int]] = [{} for _ in range(count)]
    for wire in diagram.wires:
        source, target = (None if end.is_flag else diagram.pins[end.number].box for end in (wire.source, wire.target))
        if wire.feedback:
            continue
        weight = 1 if source is None or target is None else 2
        if source is not None:
            pull[source][wire.net] = max(weight, pull[source].get(wire.net, 0))
        if target is not None:
            pull[target][wire.net] = -weight
        if source is not None and target is not None:
            before[target].add(source)
            after[source].add(target)
    layer: list[int] = []
    for box in range(count):
        layer.append(1 + max((layer[other] for other in before[box]), default=0))
    last = max(layer, default=0) + 1
    for box in reversed(range(count)):
        if after[box] and sum(pull[box].values()) > 0:
            layer[box] = min(layer[other] for other in after[box]) - 1
    return [*layer, *(last if flag.out else 0 for flag in diagram.flags)]


def _port(diagram: Diagram, grid: Grid, end: End) -> Port:
    if end.is_flag:
        return len(diagram.boxes) + end.number, FLAG_HEIGHT // 2
    box = diagram.pins[end.number].box
    return box, grid.sizes[box].pins[end.number]


def _add_wire(
    diagram: Diagram, grid: Grid, wire: Wire, lanes: dict[tuple[int, int, bool], int], keys: list[list[float]]
) -> None:
    """Add a wire with its lanes. ``lanes`` are by net, layer and direction, ``keys`` where nodes belong in the text."""
    source, target = _port(diagram, grid, wire.source), _port(diagram, grid, wire.target)
    first, last = grid.layer[source[0]], grid.layer[target[0]]
    is_back = last <= first
    key = max(source[0], target[0]) + 0.5 if is_back else float(source[0] if wire.target.is_flag else target[0])
    for end, node in ((wire.source, source[0]), (wire.target, target[0])):
        if end.is_flag:
            keys[node].append(key)
    ports = []
    for layer in range(first, last - 1, -1) if is_back else range(first + 1, last):
        lane = lanes.setdefault((wire.net, layer, is_back), len(grid.layer))
        if lane == len(grid.layer):
            grid.layer.append(layer)
            grid.sizes.append(Size())
            keys.append([])
        keys[lane].append(key)
        ports.append((lane, 0))
    if is_back:
        grid.turns[1, ports[0], source] = grid.turns[0, ports[-1], target] = None
        joined, channels = [*reversed(ports)], [first, *range(first - 1, last - 1, -1), last - 1]
    else:
        joined, channels = [source, *ports, target], [*range(first, last)]
    for layer, (one, other) in enumerate(pairwise(joined), min(first, last)):
        edges = grid.edges[layer]
        edges[one, other] = max(edges.get((one, other), 0), _weight(diagram, grid, wire, one, other))
    path = [source, *ports, target]
    grid.paths.append([(0, source), *zip(channels, path[1:], strict=True)])
    for channel, ends in zip(channels, pairwise(path), strict=True):
        hop = grid.hops[channel][wire.net]
        for port in ends:
            side = hop.left if grid.layer[port[0]] == channel else hop.right
            if port not in side:
                side.append(port)


def _weight(diagram: Diagram, grid: Grid, wire: Wire, one: Port, other: Port) -> int:
    """Return how much a straight wire matters: most along lanes, then between numbers, then at the first pin."""
    if min(one[0], other[0]) >= grid.first_lane:
        return 16
    if max(one[0], other[0]) < len(diagram.boxes):
        return (2 if diagram.nets[wire.net].boolean else 4) * (3 if other[1] == FIRST_PIN else 2)
    return 2 if wire.source.is_flag or wire.target.is_flag else 3
