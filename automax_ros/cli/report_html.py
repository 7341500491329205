"""The form of the pages that `automax report` writes: HTML that is whole by itself, without scripts or fonts."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Sequence
from html import escape

from automax_ros.core.text import printable
from automax_ros.replay.happenings import Event

MOST_ROWS = 500
"""Longest table of the page (decision); it says how many rows there are more."""
_STYLE = """
body { font-family: sans-serif; margin: 2em auto; max-width: 75em; color: #222; }
img { max-width: 100%; }
table { border-collapse: collapse; margin: 0.5em 0 1.5em; }
th, td { border: 1px solid #ccc; padding: 0.2em 0.7em; text-align: left; vertical-align: top; }
th { background: #f0f0f0; }
td.number { text-align: right; font-variant-numeric: tabular-nums; }
tr.fault td { color: #a01020; }
tr.error td { color: #a01020; }
.note { color: #555; }
"""
_POLICY = "default-src 'none'; img-src data:; style-src 'unsafe-inline'"
"""Nothing is loaded, no script runs, whatever a recording has put into a name."""


def document(title: str, subtitle: str, parts: Sequence[str]) -> str:
    """Return a page: its title, a line beneath, and parts that are HTML already."""
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
    """Return a PNG file as a part of the page."""
    encoded = base64.b64encode(picture).decode("ascii")
    return f'<img alt="{plain(name)} over time" src="data:image/png;base64,{encoded}">'


def sequence(events: Sequence[Event], untold: int) -> list[str]:
    """Return what happened as a table, nothing where nothing did."""
    if not events:
        return []
    found = [(f"{item.time_s:.4f}", item.kind, item.text) for item in events]
    kinds = [item.kind for item in events]
    head = ("s", "", "what happened")
    return ["<h3>Sequence of operations</h3>", *rows(head, found, numbers=(0,), classes=kinds, untold=untold)]


def rows(
    head: Sequence[str],
    found: Sequence[Sequence[str]],
    *,
    numbers: Iterable[int],
    classes: Sequence[str] = (),
    untold: int = 0,
) -> list[str]:
    """Return a table; ``numbers`` are the columns with numbers, ``classes`` the kinds of its rows."""
    right = set(numbers)
    lines = ["<table>"]
    if any(head):
        lines.append("<tr>" + "".join(f"<th>{plain(item)}</th>" for item in head) + "</tr>")
    for index, row in enumerate(found[:MOST_ROWS]):
        kind = f' class="{plain(classes[index])}"' if classes else ""
        cells = "".join(
            f'<td class="number">{plain(cell)}</td>' if column in right else f"<td>{plain(cell)}</td>"
            for column, cell in enumerate(row)
        )
        lines.append(f"<tr{kind}>{cells}</tr>")
    lines.append("</table>")
    more = max(0, len(found) - MOST_ROWS) + untold
    if more:
        lines.append(f'<p class="note">And {more} more.</p>')
    return lines


def plain(text: str) -> str:
    """Return a text as HTML that shows it, whatever is in it."""
    return escape(printable(text), quote=True)
