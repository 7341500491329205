"""What the person sees: colours where they are welcome, diagnostics."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TextIO

from automax_ros.cli.visible import write_control
from automax_ros.core.diagnostics import Diagnostic, SourceText, in_order, render
from automax_ros.core.problems import Severity
from automax_ros.core.text import count_of, printable, visible

_COLOURS = {Severity.ERROR: "1;31", Severity.WARNING: "1;33"}
_HINT = "  hint:"


def wants_colour(stream: TextIO) -> bool:
    """Whether a stream is a terminal that shows colours, and the person has not set NO_COLOR."""
    return stream.isatty() and not os.environ.get("NO_COLOR") and os.environ.get("TERM") != "dumb"


def rewrites_lines(stream: TextIO) -> bool:
    """Whether a stream is a terminal that can write its last line again."""
    return stream.isatty() and os.environ.get("TERM", "dumb") != "dumb"


def print_diagnostics(diagnostics: Iterable[Diagnostic], source: SourceText, stream: TextIO) -> None:
    """Print diagnostics of one text in the order of their places, in colour if the stream wants it."""
    colour = wants_colour(stream)
    for item in in_order(diagnostics):
        text = visible(render(item, source))
        write_control(stream, (_painted(item, text) if colour else text) + "\n")


def tell_warnings(findings: Iterable[tuple[SourceText, Sequence[Diagnostic]]], of: str, path: Path) -> None:
    """Say on standard error how many warnings there are, and that `automax check` of ``path`` shows them.

    A command that is used again and again does not print them each time; ``of`` says whose they are.
    """
    number = sum(item.severity is Severity.WARNING for _, diagnostics in findings for item in diagnostics)
    if number:
        shown = "it" if number == 1 else "them"
        print(
            f"{count_of(number, 'warning')} of {of}: automax check {printable(str(path))} shows {shown}",
            file=sys.stderr,
        )


def painted(text: str, colour: str) -> str:
    """Return a text in a colour, which is the number of a terminal's SGR sequence such as ``1;31``."""
    return f"\x1b[{colour}m{text}\x1b[0m"


def _painted(item: Diagnostic, text: str) -> str:
    head = f"{item.severity.value}[{item.code}]"
    text = text.replace(head, painted(head, _COLOURS[item.severity]), 1)
    if item.hint:
        before, _, after = text.rpartition(_HINT)
        text = before + painted(_HINT, "36") + after
    return text
