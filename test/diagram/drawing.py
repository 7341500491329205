"""What the tests of diagrams share: tasks from texts, random tasks, and what a drawing must fulfil."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations, pairwise
from pathlib import Path

from hypothesis import strategies as st

from automax_ros.blocks.catalogue import CATALOGUE
from automax_ros.blocks.declare.declaration import Platform
from automax_ros.core.diagnostics import SourceText
from automax_ros.core.ticks import DEFAULT_TICK_NS, UDC_TICK_NS
from automax_ros.diagram.model import Diagram, End, Wire, diagram_of
from automax_ros.diagram.placed import Area, Placed
from automax_ros.language.checks.checker import check
from automax_ros.language.program import Program

ROOT = Path(__file__).parents[2]
EXAMPLES = sorted((ROOT / "config").rglob("*.BLK"))
HEAD = """\
10 COMMON A%, B%, C%, P@, Q@, R@
20 LOCAL X%, Y%, Z%, U@, V@, W@, TABLE%(5)
30 LOCAL GAIN% [CURRENT=3, HIGH=9, LOW=0, STEP=1]
40 CALL SCAN_LOOP(TICKS=2)
"""
_NUMBERS, _BOOLEANS = ("A%", "B%", "C%", "X%", "Y%", "Z%"), ("P@", "Q@", "R@", "U@", "V@", "W@")
Line = tuple[int, int, int, int]
"""A piece of a wire: left, top, right, bottom."""


def checked(text: str, name: str = "TASK.BLK", target: Platform = Platform.AUTOMAX) -> tuple[Program, SourceText]:
    source = SourceText(name, text)
    tick = UDC_TICK_NS if target is Platform.UDC else DEFAULT_TICK_NS
    result = check(source, name=Path(name).stem, catalogue=CATALOGUE, target=target, tick_ns=tick)
    assert result.program is not None, result.diagnostics
    return result.program, source


def example(path: Path) -> tuple[Program, SourceText]:
    target = Platform.UDC if path.stem in ("WIND_A", "WIND_B", "UNW_A", "WND_B") else Platform.AUTOMAX
    return checked(path.read_text(encoding="utf-8"), path.name, target)


def drawn(*lines: str, elsewhere: Sequence[str] = ()) -> Diagram:
    """The diagram of a scan of these lines, numbered 100, 110 ..., with the declarations of HEAD."""
    return diagram_of(*checked(scan(lines)), elsewhere)


def scan(lines: Sequence[str]) -> str:
    return HEAD + "".join(f"{100 + 10 * place} {line}\n" for place, line in enumerate(lines)) + "9000 END\n"


def wires(diagram: Diagram) -> set[str]:
    """The wires as texts: ``110 OUTPUT -> 120 INPUT``, ``A% -> 110 INPUT1``, ``~>`` for feedback."""
    return {
        f"{_end(diagram, wire.source)} {'~>' if wire.feedback else '->'} {_end(diagram, wire.target)}"
        for wire in diagram.wires
    }


def _end(diagram: Diagram, end: End) -> str:
    if end.is_flag:
        return diagram.flags[end.number].name
    pin = diagram.pins[end.number]
    return f"{diagram.boxes[pin.box].line} {pin.name}"


@st.composite
def tasks(draw: st.DrawFn, most: int = 14) -> str:
    """Texts of tasks whose blocks and BASIC statements read and write what they like."""
    number = st.sampled_from((*_NUMBERS, "7", "GAIN%", "TABLE%(2)"))
    boolean = st.sampled_from((*_BOOLEANS, *(f"-{name}" for name in _BOOLEANS)))
    to_number, to_boolean = st.sampled_from(_NUMBERS), st.sampled_from(_BOOLEANS)
    lines = []
    for _ in range(draw(st.integers(0, most))):
        kind = draw(st.sampled_from(("sum", "switch", "limit", "and", "basic", "if", "latch")))
        if kind == "sum":
            lines.append(f"CALL SUMMER(INPUT1={draw(number)}, INPUT2={draw(number)}, OUTPUT={draw(to_number)})")
        elif kind == "switch":
            given = f"INPUT1={draw(number)}, INPUT2={draw(number)}, SELECT={draw(boolean)}"
            lines.append(f"CALL SWITCH({given}, OUTPUT={draw(to_number)})")
        elif kind == "limit":
            outputs = f"SATURATED_PLUS={draw(to_boolean)}, SATURATED_MINUS={draw(to_boolean)}, OUTPUT={draw(to_number)}"
            lines.append(f"CALL LIMIT(INPUT={draw(to_number)}, LIMIT_PLUS={draw(number)}, {outputs})")
        elif kind == "latch":
            lines.append(f"CALL LATCH(RESET={draw(boolean)}, SET={draw(boolean)}, OUTPUT={draw(to_boolean)})")
        elif kind == "and":
            inputs = ", ".join(f"INPUT{k}={draw(boolean)}" for k in range(1, draw(st.integers(3, 9))))
            lines.append(f"CALL AND({inputs}, OUTPUT={draw(to_boolean)})")
        elif kind == "basic":
            lines.append(f"{draw(to_number)} = {draw(number)} + {draw(number)}")
        else:
            lines.append(f"IF {draw(to_boolean)} THEN {draw(to_boolean)} = NOT {draw(to_boolean)}")
    return scan(lines)


def pieces(points: Sequence[tuple[int, int]]) -> Iterator[Line]:
    for (ax, ay), (bx, by) in pairwise(points):
        assert (ax == bx) != (ay == by), f"neither level nor upright: {points}"
        yield min(ax, bx), min(ay, by), max(ax, bx), max(ay, by)


def meet(one: Line, other: Line, free: int = 0) -> bool:
    """Whether two rectangles overlap or are nearer than ``free`` px."""
    return (
        one[0] < other[2] + free and other[0] < one[2] + free and one[1] < other[3] + free and other[1] < one[3] + free
    )


def rectangle(area: Area) -> Line:
    return area.x, area.y, area.x + area.w, area.y + area.h


def texts(placed: Placed) -> Iterator[tuple[int | None, Line]]:
    """Where the texts outside boxes stand, with the net that they name."""
    for pin, (x, y) in zip(placed.diagram.pins, placed.pins, strict=True):
        if pin.out:
            name = placed.diagram.nets[pin.net].name if pin.net is not None else pin.var
            yield pin.net, (x + 3, y - 12, x + 3 + 6 * len(name), y - 3)
        elif pin.net is None:
            end = x - (12 if pin.negated else 4)
            yield None, (end - round(6.6 * len(pin.var or pin.value)), y - 5, end, y + 5)


def assert_is_readable(placed: Placed) -> None:
    """Boxes and flags stand apart, wires go from pin to pin around them and around texts, and touch only their own."""
    diagram = placed.diagram
    areas = [rectangle(area) for area in (*placed.boxes, *placed.flags)]
    lines = [
        (wire.net, line) for wire, points in zip(diagram.wires, placed.wires, strict=True) for line in pieces(points)
    ]
    assert all(0 <= area[0] < area[2] <= placed.width and 0 <= area[1] < area[3] <= placed.height for area in areas)
    assert all(
        line[0] >= 0 and line[2] <= placed.width and line[1] >= 0 and line[3] <= placed.height for _, line in lines
    )
    for one, other in combinations(areas, 2):
        assert not meet(one, other, 4), (one, other)
    for net, line in lines:
        assert not any(meet(line, area) for area in areas), (diagram.nets[net], line)
        assert not any(meet(line, text) for named, text in texts(placed) if named != net), (diagram.nets[net], line)
    for (net, one), (other_net, other) in combinations(lines, 2):
        if net != other_net:
            assert_cross(one, other)
    for wire, points in zip(diagram.wires, placed.wires, strict=True):
        assert points[0] == place_of(placed, wire, is_source=True)
        assert points[-1] == place_of(placed, wire, is_source=False)


def assert_cross(one: Line, other: Line) -> None:
    """Wires of two nets only cross at right angles, away from their corners: else they would look like one."""
    if (one[0] == one[2]) == (other[0] == other[2]):
        assert not meet(one, other, 4), (one, other)
        return
    level, upright = (other, one) if one[0] == one[2] else (one, other)
    x, y = upright[0], level[1]
    if level[0] - 4 < x < level[2] + 4 and upright[1] - 4 < y < upright[3] + 4:
        assert level[0] + 4 <= x <= level[2] - 4, (one, other)
        assert upright[1] + 4 <= y <= upright[3] - 4, (one, other)


def place_of(placed: Placed, wire: Wire, *, is_source: bool) -> tuple[int, int]:
    end = wire.source if is_source else wire.target
    if not end.is_flag:
        return placed.pins[end.number]
    area = placed.flags[end.number]
    return area.x + (area.w if is_source else 0), area.y + area.h // 2
