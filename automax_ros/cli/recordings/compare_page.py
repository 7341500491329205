"""A comparison of two recordings as one HTML page that needs nothing else, and loads nothing."""

from __future__ import annotations

from automax_ros.cli.output.html_page import document, image, plain, rows
from automax_ros.comparison.comparison import Comparison, summary
from automax_ros.comparison.report import (
    DIFFERENCES,
    RESPONSES,
    difference_rows,
    remarks,
    response_rows,
    run_rows,
)


def page(found: Comparison, picture: bytes | None) -> str:
    """Return the page; ``picture`` is a PNG file, None where nothing is drawn."""
    names = [side.bag.resolve().name for side in (found.before, found.after)]
    parts = rows(("", "recording", "rack", "part of the axis of time"), run_rows(found), numbers=())
    parts += [f'<p class="note">{plain(text)}</p>' for text in remarks(found)]
    if picture is not None:
        parts.append(image(f"{names[0]} and {names[1]}", picture))
    differing = difference_rows(found)
    if differing:
        parts += ["<h3>Differences</h3>", *rows(DIFFERENCES, differing, numbers=range(2, len(DIFFERENCES)))]
    responses = response_rows(found)
    if responses:
        parts += ["<h3>Responses</h3>", *rows(RESPONSES, responses, numbers=range(3, len(RESPONSES)))]
    subtitle = f"{summary(found)}, from {found.start_s:.6g} to {found.end_s:.6g} s."
    return document(f"{names[0]} and {names[1]}", subtitle, parts)
