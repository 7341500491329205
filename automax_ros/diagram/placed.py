"""A diagram with its places, and as data for JSON (docs/panel.md)."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from itertools import pairwise
from types import MappingProxyType
from typing import Any

from automax_ros.core.diagnostics import SourceText
from automax_ros.diagram.grid import Grid, Port
from automax_ros.diagram.layout import laid_out
from automax_ros.diagram.model import Diagram, End, diagram_of
from automax_ros.diagram.routes import Spot, Trunk, trunks_of, width_of
from automax_ros.language.program import Program

_Tasks = Mapping[str, Sequence[str]]
_EDGE = 12
"""Free space around a drawing, px."""


@dataclass(frozen=True)
class Area:
    """A rectangle, px; ``y`` goes down."""

    x: int
    y: int
    w: int
    h: int


@dataclass(frozen=True)
class Placed:
    """A diagram with the areas of its boxes and flags, the places of its pins, and the corners of its wires.

    ``forks`` are where nets fork: the net's number, and the place.
    """

    diagram: Diagram
    width: int
    height: int
    boxes: tuple[Area, ...]
    flags: tuple[Area, ...]
    pins: tuple[Spot, ...]
    wires: tuple[tuple[Spot, ...], ...]
    forks: tuple[tuple[int, Spot], ...]


def diagram_facts(
    program: Program,
    source: SourceText,
    writers: _Tasks = MappingProxyType({}),
    readers: _Tasks = MappingProxyType({}),
) -> dict[str, Any]:
    """Return the drawing of a task as data for JSON; texts in it are foreign.

    ``writers`` and ``readers`` are the tasks of a rack that write and read each common.
    """
    others = {name for name, tasks in writers.items() if set(tasks) - {program.name}}
    return facts_of(placed(diagram_of(program, source, others)), writers, readers)


def placed(diagram: Diagram) -> Placed:
    """Return a diagram with its places; the same one gives the same places."""
    grid = laid_out(diagram)
    trunks: dict[tuple[int, int], Trunk] = {}
    starts, areas = [], [Area(0, 0, 0, 0)] * grid.first_lane
    x = _EDGE
    for layer, nodes in enumerate(grid.order):
        x += max((grid.sizes[node].left for node in nodes), default=0)
        for node in nodes:
            if node < grid.first_lane:
                areas[node] = Area(x, grid.y[node] + _EDGE, grid.sizes[node].width, grid.sizes[node].height)
        x += max((grid.sizes[node].width + grid.sizes[node].right for node in nodes), default=0)
        found, tracks = trunks_of(grid, grid.hops[layer])
        trunks |= {(layer, net): trunk for net, trunk in found.items()}
        starts.append(x)
        x += width_of(tracks)
    boxes, flags = areas[: len(diagram.boxes)], areas[len(diagram.boxes) :]
    sizes = [grid.sizes[pin.box].pins[number] for number, pin in enumerate(diagram.pins)]
    pins = [
        (boxes[pin.box].x + boxes[pin.box].w * pin.out, boxes[pin.box].y + below)
        for pin, below in zip(diagram.pins, sizes, strict=True)
    ]

    def spot(end: End) -> Spot:
        if not end.is_flag:
            return pins[end.number]
        area, is_out = flags[end.number], diagram.flags[end.number].out
        return area.x + (0 if is_out else area.w), area.y + area.h // 2

    wires = []
    for wire, path in zip(diagram.wires, grid.paths, strict=True):
        points, port = [spot(wire.source)], path[0][1]
        for channel, following in path[1:]:
            if (channel, wire.net) in trunks:
                points += _corners(grid, trunks[channel, wire.net], channel, starts[channel], port, following)
            port = following
        wires.append(_straightened([*points, spot(wire.target)]))
    bottom = max([*(area.y + area.h for area in areas), *(y for points in wires for _, y in points)], default=0)
    forks = tuple(_forks(diagram, wires))
    return Placed(diagram, x + _EDGE, bottom + _EDGE, tuple(boxes), tuple(flags), tuple(pins), tuple(wires), forks)


def _corners(grid: Grid, trunk: Trunk, channel: int, start: int, *ends: Port) -> list[Spot]:
    """Return the corners of a wire between two ports in a channel, which begins at ``start``."""
    columns = [trunk.x(start, is_left=grid.layer[node] == channel) for node, _ in ends]
    heights = [grid.y[node] + below for node, below in ends]
    bend = [] if columns[0] == columns[1] else [(column, trunk.bend) for column in columns]
    corners = [(columns[0], heights[0]), *bend, (columns[1], heights[1])]
    return [(x, y + _EDGE) for x, y in corners]


def _straightened(points: Sequence[Spot]) -> tuple[Spot, ...]:
    """Return points without those in the middle of a straight line."""
    kept: list[Spot] = []
    for point in points:
        while len(kept) > 1 and any(kept[-2][axis] == kept[-1][axis] == point[axis] for axis in (0, 1)):
            kept.pop()
        if point not in kept[-1:]:
            kept.append(point)
    return tuple(kept)


def _forks(diagram: Diagram, wires: Sequence[Sequence[Spot]]) -> Iterator[tuple[int, Spot]]:
    """Yield the corners and ends of wires at which their net leads in three directions or more."""
    pieces: dict[int, dict[tuple[Spot, Spot], None]] = defaultdict(dict)
    for wire, points in zip(diagram.wires, wires, strict=True):
        pieces[wire.net] |= dict.fromkeys(pairwise(points))
    for net, own in pieces.items():
        for x, y in dict.fromkeys(spot for piece in own for spot in piece):
            passing = [
                ((ax, ay), (bx, by))
                for (ax, ay), (bx, by) in own
                if min(ax, bx) <= x <= max(ax, bx) and min(ay, by) <= y <= max(ay, by)
            ]
            ways = {((ax > x) - (ax < x), (ay > y) - (ay < y)) for ends in passing for ax, ay in ends}
            if len(ways - {(0, 0)}) > 2:
                yield net, (x, y)


def facts_of(drawn: Placed, writers: _Tasks, readers: _Tasks) -> dict[str, Any]:
    """Return a placed diagram as data for JSON."""
    diagram = drawn.diagram

    def end(item: End) -> dict[str, int]:
        return {"flag": item.number} if item.is_flag else {"box": diagram.pins[item.number].box, "pin": item.number}

    boxes = [
        {"id": number, "kind": "basic" if box.basic else "block", **asdict(box), **asdict(area)}
        for number, (box, area) in enumerate(zip(diagram.boxes, drawn.boxes, strict=True))
    ]
    flags = [
        {**asdict(flag), **asdict(area), "tasks": list((readers if flag.out else writers).get(flag.name, ()))}
        for flag, area in zip(diagram.flags, drawn.flags, strict=True)
    ]
    wires = [
        {"net": wire.net, "from": end(wire.source), "to": end(wire.target), "points": points, "feedback": wire.feedback}
        for wire, points in zip(diagram.wires, drawn.wires, strict=True)
    ]
    return {
        "task": diagram.task,
        "drawable": not diagram.why,
        "why": diagram.why,
        "width": drawn.width,
        "height": drawn.height,
        "boxes": boxes,
        "pins": [{**asdict(pin), "x": x, "y": y} for pin, (x, y) in zip(diagram.pins, drawn.pins, strict=True)],
        "flags": flags,
        "nets": [{"id": number, **asdict(net)} for number, net in enumerate(diagram.nets)],
        "wires": wires,
        "forks": [{"net": net, "x": x, "y": y} for net, (x, y) in drawn.forks],
        "source": [asdict(row) for row in diagram.source],
    }
