"""A line that says how far a command is: rewritten on a terminal, plain lines elsewhere."""

from __future__ import annotations

import shutil
import sys
import time
from collections.abc import Sequence

from automax_ros.cli.terminal import rewrites_lines
from automax_ros.cli.visible import write_control
from automax_ros.core.text import visible
from automax_ros.core.ticks import NS_PER_S

_TERMINAL_PERIOD_NS = NS_PER_S // 5
_PLAIN_PERIOD_NS = 5 * NS_PER_S


class StatusLine:
    """Shows parts of a line on standard output when it is time to; ``began_ns`` is when it was made (monotonic)."""

    def __init__(self) -> None:
        """Begin; nothing is printed before the first line is due."""
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
        """Show a line; on a narrow terminal the last parts are left out."""
        if self._terminal:
            columns = shutil.get_terminal_size().columns
            line = fitting(parts, columns - 1)
            write_control(sys.stdout, erasing(self._drawn, columns) + visible(line))
            self._drawn = len(line)
        else:
            sys.stdout.write("  ".join(parts) + "\n")
        sys.stdout.flush()

    def message(self, text: str) -> None:
        """Print a line of its own."""
        self.clear()
        print(text, flush=True)

    def clear(self) -> None:
        """Take the line away."""
        if self._drawn:
            write_control(sys.stdout, erasing(self._drawn, shutil.get_terminal_size().columns))
            self._drawn = 0


def erasing(drawn: int, columns: int) -> str:
    """Return what erases a line of ``drawn`` characters, which a terminal made narrower has wrapped into several."""
    rows_above = max(0, drawn - 1) // max(1, columns)
    return f"\r\x1b[{rows_above}A\x1b[J" if rows_above else "\r\x1b[K"


def fitting(parts: Sequence[str], width: int) -> str:
    """Return as many parts as a line holds: none is cut, for half a number is a wrong one."""
    line = parts[0][: max(0, width)]
    for part in parts[1:]:
        if len(line) + 2 + len(part) > width:
            break
        line += f"  {part}"
    return line
