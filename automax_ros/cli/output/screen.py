"""Terminal output: diagnostics in colour, a status line, and a progress bar for work that takes over two seconds."""

from __future__ import annotations

import os
import shutil
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from types import TracebackType
from typing import TextIO

from automax_ros.cli.visible import write_control
from automax_ros.core.diagnostics import Diagnostic, SourceText, in_order, render
from automax_ros.core.problems import Severity
from automax_ros.core.text import count_of, printable, visible
from automax_ros.core.ticks import NS_PER_S

_COLOURS = {Severity.ERROR: "1;31", Severity.WARNING: "1;33"}
_HINT = "  hint:"


_TERMINAL_PERIOD_NS = NS_PER_S // 5
_PLAIN_PERIOD_NS = 5 * NS_PER_S
_PATIENCE_S = 2.0
_PERIOD_S = 0.1
_WIDTH = 30
_SHARES = 1000


def wants_colour(stream: TextIO) -> bool:
    """Whether a stream is a terminal that shows colours, and NO_COLOR is not set."""
    return stream.isatty() and not os.environ.get("NO_COLOR") and os.environ.get("TERM") != "dumb"


def rewrites_lines(stream: TextIO) -> bool:
    """Whether a stream is a terminal that can rewrite its last line."""
    return stream.isatty() and os.environ.get("TERM", "dumb") != "dumb"


def print_diagnostics(diagnostics: Iterable[Diagnostic], source: SourceText, stream: TextIO) -> None:
    """Print diagnostics of one text in the order of their places, in colour if the stream supports it."""
    colour = wants_colour(stream)
    for item in in_order(diagnostics):
        text = visible(render(item, source))
        write_control(stream, (_paint(item, text) if colour else text) + "\n")


def print_warning_count(findings: Iterable[tuple[SourceText, Sequence[Diagnostic]]], of: str, path: Path) -> None:
    """Print on standard error how many warnings there are, and that `automax check` of ``path`` shows them.

    A command that is used repeatedly does not print them each time; ``of`` names what they concern.
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


def _paint(item: Diagnostic, text: str) -> str:
    head = f"{item.severity.value}[{item.code}]"
    text = text.replace(head, painted(head, _COLOURS[item.severity]), 1)
    if item.hint:
        before, _, after = text.rpartition(_HINT)
        text = before + painted(_HINT, "36") + after
    return text


class StatusLine:
    """A status line on standard output, shown at intervals; ``began_ns`` is when it was created (monotonic clock)."""

    def __init__(self) -> None:
        """Create the status line; nothing is printed before the first one is due."""
        self._terminal = rewrites_lines(sys.stdout)
        self._period_ns = _TERMINAL_PERIOD_NS if self._terminal else _PLAIN_PERIOD_NS
        self.began_ns = self._last_ns = time.monotonic_ns()
        self._drawn = 0

    def due(self) -> int:
        """Return the ns since the last line if it is time for the next one, which the caller shows then, else 0."""
        now = time.monotonic_ns()
        passed = now - self._last_ns
        if passed < self._period_ns:
            return 0
        self._last_ns = now
        return passed

    def show(self, parts: Sequence[str]) -> None:
        """Show the line; on a narrow terminal the last parts are omitted."""
        if self._terminal:
            columns = shutil.get_terminal_size().columns
            line = fitting(parts, columns - 1)
            write_control(sys.stdout, erasing(self._drawn, columns) + visible(line))
            self._drawn = len(line)
        else:
            sys.stdout.write("  ".join(parts) + "\n")
        sys.stdout.flush()

    def message(self, text: str) -> None:
        """Print a separate line."""
        self.clear()
        print(text, flush=True)

    def clear(self) -> None:
        """Erase the line."""
        if self._drawn:
            write_control(sys.stdout, erasing(self._drawn, shutil.get_terminal_size().columns))
            self._drawn = 0


def erasing(drawn: int, columns: int) -> str:
    """Return the sequence that erases a line of ``drawn`` characters, even one that a narrower terminal has wrapped."""
    rows_above = max(0, drawn - 1) // max(1, columns)
    return f"\r\x1b[{rows_above}A\x1b[J" if rows_above else "\r\x1b[K"


def fitting(parts: Sequence[str], width: int) -> str:
    """Return as many parts as fit on a line; no part is cut, for half a number is a wrong one."""
    line = parts[0][: max(0, width)]
    for part in parts[1:]:
        if len(line) + 2 + len(part) > width:
            break
        line += f"  {part}"
    return line


class ProgressBar(AbstractContextManager["ProgressBar"]):
    """Shows on standard error how much of ``total`` is done; nothing if that is not a terminal or ``total`` is 0."""

    def __init__(self, title: str, total: int, *, wanted: bool = True) -> None:
        self._title = title
        self._total = total
        self._wanted = wanted and total > 0 and rewrites_lines(sys.stderr)
        self._start = time.monotonic()
        self._next = self._start + _PATIENCE_S
        self._drawn = 0

    def show(self, done: int) -> None:
        """Show how much is done by now."""
        if not self._wanted:
            return
        now = time.monotonic()
        if now >= self._next:
            self._next = now + _PERIOD_S
            self._draw(min(1.0, done / self._total), now - self._start)

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._drawn:
            write_control(sys.stderr, erasing(self._drawn, shutil.get_terminal_size().columns))
            sys.stderr.flush()

    def _draw(self, share: float, seconds: float) -> None:
        filled = int(share * _WIDTH)
        parts = [f"{self._title} {share:4.0%}", f"[{'#' * filled}{'.' * (_WIDTH - filled)}]"]
        if share > 0:
            parts.append(f"{seconds / share - seconds:.0f} s left")
        columns = shutil.get_terminal_size().columns
        line = fitting(parts, columns - 1)
        write_control(sys.stderr, erasing(self._drawn, columns) + visible(line))
        sys.stderr.flush()
        self._drawn = len(line)


@contextmanager
def share_shown(title: str) -> Iterator[Callable[[float], None]]:
    """Yield a function that shows the share that is done, 0 to 1, as a progress bar."""
    with ProgressBar(title, _SHARES) as bar:
        yield lambda share: bar.show(int(share * _SHARES))
