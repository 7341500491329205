"""A progress bar for work that lasts: only on a terminal, and only after two seconds."""

from __future__ import annotations

import shutil
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from types import TracebackType

from automax_ros.cli.status_line import erasing, fitting
from automax_ros.cli.terminal import rewrites_lines
from automax_ros.cli.visible import write_control
from automax_ros.core.text import visible

_PATIENCE_S = 2.0
_PERIOD_S = 0.1
_WIDTH = 30
_SHARES = 1000


class ProgressBar(AbstractContextManager["ProgressBar"]):
    """Shows on standard error how much of ``total`` is done; nothing where that is not a terminal or ``total`` is 0."""

    def __init__(self, title: str, total: int, *, wanted: bool = True) -> None:
        self._title = title
        self._total = total
        self._wanted = wanted and total > 0 and rewrites_lines(sys.stderr)
        self._start = time.monotonic()
        self._next = self._start + _PATIENCE_S
        self._drawn = 0

    def show(self, done: int) -> None:
        """Tell how much is done by now."""
        if not self._wanted:
            return
        now = time.monotonic()
        if now >= self._next:
            self._next = now + _PERIOD_S
            self._draw(min(1.0, done / self._total), now - self._start)

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Take the bar away."""
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
    """Return what takes the share that is done, 0 to 1, and shows it as a progress bar."""
    with ProgressBar(title, _SHARES) as bar:
        yield lambda share: bar.show(int(share * _SHARES))
