"""A placed diagram as a picture in SVG that needs nothing else; all texts in it are escaped."""

from __future__ import annotations

from html import escape

from automax_ros.core.text import printable
from automax_ros.diagram.grid import FIRST_PIN, FLAG_TIP, LINE
from automax_ros.diagram.model import Pin
from automax_ros.diagram.placed import Placed
from automax_ros.diagram.routes import Spot

_STYLE = """\
text { font: 11px "DejaVu Sans Mono", Consolas, Menlo, monospace; fill: #1d2733; white-space: pre; }
.paper { fill: #fff; } .box { fill: #eef3f8; stroke: #51616f; stroke-width: 1.2; }
.basic { fill: #fff; stroke-dasharray: 6 4; } .flag { fill: #fff8e6; stroke: #8a6d1d; }
.title { font-weight: bold; text-anchor: middle; } .line { font-size: 10px; fill: #7b8894; text-anchor: middle; }
.symbol { font-size: 10px; fill: #51616f; } .end { text-anchor: end; } .name { font-size: 10px; fill: #7b8894; }
.wire { fill: none; stroke: #33414e; stroke-width: 1.4; shape-rendering: crispEdges; } .boolean { stroke: #0a7f46; }
.feedback { stroke-dasharray: 5 3; } .dot { fill: #33414e; } .dot.boolean { fill: #0a7f46; stroke: none; }
.bubble { fill: #fff; stroke: #51616f; }
"""


def svg_of(drawn: Placed) -> str:
    """Return the picture of a placed diagram; the same one gives the same text."""
    diagram, size = drawn.diagram, f'width="{drawn.width}" height="{drawn.height}"'
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" {size} viewBox="0 0 {drawn.width} {drawn.height}">',
        f"<title>{_escaped(diagram.task)}</title>",
        f"<style>\n{_STYLE}</style>",
        f'<rect class="paper" {size}/>',
        *_wires(drawn),
    ]
    for box, area in zip(diagram.boxes, drawn.boxes, strict=True):
        middle = area.x + area.w // 2
        kind = "box basic" if box.basic else "box"
        parts.append(f'<rect class="{kind}" x="{area.x}" y="{area.y}" width="{area.w}" height="{area.h}" rx="3"/>')
        parts.append(_text("title", middle, area.y + 15, box.title))
        parts.append(_text("line", middle, area.y + area.h - 5, str(box.line)))
        for number, text in enumerate(box.text):
            parts.append(_text("", area.x + 8, area.y + FIRST_PIN - 3 + LINE * number, text))
    for flag, area in zip(diagram.flags, drawn.flags, strict=True):
        right, low, middle = area.x + area.w, area.y + area.h, area.y + area.h // 2
        tip = right - FLAG_TIP
        shape = f"{area.x},{area.y} {tip},{area.y} {right},{middle} {tip},{low} {area.x},{low}"
        parts.append(f'<polygon class="flag" points="{shape}"/>')
        parts.append(_text("", area.x + 5, middle + 4, flag.name))
    for pin, spot in zip(diagram.pins, drawn.pins, strict=True):
        parts += _pin(drawn, pin, spot)
    return "\n".join([*parts, "</svg>", ""])


def _escaped(text: str) -> str:
    return escape(printable(text), quote=False)


def _text(kind: str, x: int, y: int, text: str) -> str:
    attribute = f' class="{kind}"' if kind else ""
    return f'<text{attribute} x="{x}" y="{y}">{_escaped(text)}</text>'


def _pin(drawn: Placed, pin: Pin, spot: Spot) -> list[str]:
    x, y = spot
    given = pin.var or pin.value
    if pin.out:
        name = drawn.diagram.nets[pin.net].name if pin.net is not None else given
        return [_text("symbol end", x - 5, y + 4, pin.symbol), _text("name", x + 3, y - 4, name)]
    parts = [_text("symbol", x + 5, y + 4, pin.symbol)]
    if pin.negated:
        parts.append(f'<circle class="bubble" cx="{x - 4}" cy="{y}" r="4"/>')
    if given:
        parts.append(_text("end", x - (12 if pin.negated else 4), y + 4, given))
    return parts


def _wires(drawn: Placed) -> list[str]:
    """Return the wires, feedback first, so that what a net shares is drawn through; then a dot where a net forks."""
    parts = []
    nets = drawn.diagram.nets
    wires = sorted(zip(drawn.diagram.wires, drawn.wires, strict=True), key=lambda item: not item[0].feedback)
    for wire, points in wires:
        kind = f"wire{' boolean' if nets[wire.net].boolean else ''}{' feedback' if wire.feedback else ''}"
        way = " ".join(f"{x},{y}" for x, y in points)
        parts.append(f'<polyline class="{kind}" points="{way}"/>')
    for number, (x, y) in drawn.forks:
        kind = "dot boolean" if nets[number].boolean else "dot"
        parts.append(f'<circle class="{kind}" cx="{x}" cy="{y}" r="2.6"/>')
    return parts
