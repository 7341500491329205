"""A progress bar for work that lasts: only on a terminal, and only after two seconds."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from types import TracebackType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.progress import Progress, TaskID

_PATIENCE_S = 2.0
_SHARES = 1000


class ProgressBar(AbstractContextManager["ProgressBar"]):
    """Shows on standard error how much of ``total`` is done; nothing where that is no terminal or ``total`` is 0."""

    def __init__(self, title: str, total: int, *, wanted: bool = True) -> None:
        self._title = title
        self._total = total
        self._wanted = wanted and total > 0 and sys.stderr.isatty()
        self._start = time.monotonic()
        self._bar: Progress | None = None
        self._line: TaskID | None = None

    def show(self, done: int) -> None:
        """Tell how much is done by now."""
        if not self._wanted or time.monotonic() - self._start < _PATIENCE_S:
            return
        if self._bar is None:
            self._bar = self._opened()
            self._line = self._bar.add_task(self._title, total=self._total)
        if self._line is not None:
            self._bar.update(self._line, completed=done)

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Take the bar away."""
        if self._bar is not None:
            self._bar.stop()

    def _opened(self) -> Progress:
        from rich.console import Console
        from rich.progress import Progress

        bar = Progress(console=Console(stderr=True), transient=True)
        bar.start()
        return bar


@contextmanager
def share_shown(title: str) -> Iterator[Callable[[float], None]]:
    """Return what takes the share that is done, 0 to 1, and shows it as a progress bar."""
    with ProgressBar(title, _SHARES) as bar:
        yield lambda share: bar.show(int(share * _SHARES))
