"""A line on standard output that tells how far a command is: rewritten on a terminal, plain lines elsewhere."""

from __future__ import annotations

import shutil
import sys
import time
from collections.abc import Sequence

from automax_ros.cli.terminal import rewrites_lines
from automax_ros.core.ticks import NS_PER_S

_TERMINAL_PERIOD_NS = NS_PER_S // 5
_PLAIN_PERIOD_NS = 5 * NS_PER_S


class StatusLine:
    """Shows parts of a line when it is time to."""

    def __init__(self) -> None:
        """Begin; nothing is printed before the first line is due."""
        self._terminal = rewrites_lines(sys.stdout)
        self._period_ns = _TERMINAL_PERIOD_NS if self._terminal else _PLAIN_PERIOD_NS
        self._last = time.monotonic_ns()
        self._drawn = False

    def due(self) -> int:
        """Return the ns since the last line if it is time for the next one, else 0."""
        passed = time.monotonic_ns() - self._last
        return passed if passed >= self._period_ns else 0

    def show(self, parts: Sequence[str]) -> None:
        """Show a line; on a narrow terminal the last parts are left out."""
        self._last = time.monotonic_ns()
        if self._terminal:
            sys.stdout.write(f"\r\x1b[K{fitting(parts, shutil.get_terminal_size().columns - 1)}")
            self._drawn = True
        else:
            sys.stdout.write("  ".join(parts) + "\n")
        sys.stdout.flush()

    def message(self, text: str) -> None:
        """Print a line of its own."""
        if self._drawn:
            sys.stdout.write("\r\x1b[K")
            self._drawn = False
        print(text, flush=True)


def fitting(parts: Sequence[str], width: int) -> str:
    """Return as many parts as a line holds: none is cut, for half a number is a wrong one."""
    line = parts[0][:width]
    for part in parts[1:]:
        if len(line) + 2 + len(part) > width:
            break
        line += f"  {part}"
    return line
