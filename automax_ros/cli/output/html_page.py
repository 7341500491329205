"""Pages of HTML that need nothing from elsewhere: tables, pictures inside; what a recording says is never markup."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Sequence
from html import escape

from automax_ros.core.text import printable

MOST_ROWS = 500
"""Most rows of a table of the page (decision); the number of further rows is printed below it."""
_STYLE = """
body { font-family: sans-serif; margin: 2em auto; padding: 0 1.5em; max-width: 75em; color: #222; }
img { max-width: 100%; }
table { border-collapse: collapse; margin: 0.5em 0 1.5em; }
th, td { border: 1px solid #ccc; padding: 0.2em 0.7em; text-align: left; vertical-align: top; }
th { background: #f0f0f0; }
td.number { text-align: right; font-variant-numeric: tabular-nums; }
tr.fault td, tr.error td, tr.alarm td { color: #a01020; }
.note { color: #555; }
"""
_POLICY = "default-src 'none'; img-src data:; style-src 'unsafe-inline'"
"""Nothing is loaded and no script runs, whatever a recording has in its names."""


def document(title: str, subtitle: str, parts: Sequence[str]) -> str:
    """Return a page of a title, a line below it, and parts that are HTML already."""
    head = [
        "<!DOCTYPE html>",
        '<html lang="en"><head><meta charset="utf-8">',
        f'<meta http-equiv="Content-Security-Policy" content="{_POLICY}">',
        f"<title>{plain(title)}</title><style>{_STYLE}</style></head><body>",
        f"<h1>{plain(title)}</h1>",
        f"<p>{plain(subtitle)}</p>",
    ]
    return "\n".join([*head, *parts, "</body></html>\n"])


def image(name: str, picture: bytes) -> str:
    """Return a PNG picture as an HTML element."""
    encoded = base64.b64encode(picture).decode("ascii")
    return f'<img alt="{plain(name)} over time" src="data:image/png;base64,{encoded}">'


def rows(
    head: Sequence[str],
    found: Sequence[Sequence[str]],
    *,
    numbers: Iterable[int],
    classes: Sequence[str] = (),
    omitted: int = 0,
    most: int = MOST_ROWS,
) -> list[str]:
    """Return a table of at most ``most`` rows; ``numbers`` are columns of numbers, ``classes`` CSS classes of rows."""
    right = set(numbers)
    lines = ["<table>"]
    if any(head):
        lines.append("<tr>" + "".join(f"<th>{plain(item)}</th>" for item in head) + "</tr>")
    for index, row in enumerate(found[:most]):
        kind = f' class="{plain(classes[index])}"' if classes and classes[index] else ""
        cells = "".join(
            f'<td class="number">{plain(cell)}</td>' if column in right else f"<td>{plain(cell)}</td>"
            for column, cell in enumerate(row)
        )
        lines.append(f"<tr{kind}>{cells}</tr>")
    lines.append("</table>")
    more = max(0, len(found) - most) + omitted
    if more:
        lines.append(f'<p class="note">And {more} more.</p>')
    return lines


def plain(text: str) -> str:
    """Return a text escaped for HTML."""
    return escape(printable(text), quote=True)
