"""A command prompt with line editing, history and completion; Ctrl-C discards the line."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from types import FrameType

_DELIMITERS = " \t\n=:"
"""Characters that end a word for completion; the type characters of names do not."""


@dataclass
class PromptInterrupt:
    """Ctrl-C: at the prompt it discards the line, during an operation it is recorded."""

    pending: bool = False
    _prompting: bool = False

    def taken(self) -> bool:
        """Return whether Ctrl-C has come since the last call."""
        pending, self.pending = self.pending, False
        return pending

    @contextmanager
    def watching(self) -> Iterator[None]:
        """Handle SIGINT while the block lasts."""

        def note(_: int, __: FrameType | None) -> None:
            if self._prompting:
                raise KeyboardInterrupt
            self.pending = True

        before = signal.signal(signal.SIGINT, note)
        try:
            yield
        finally:
            signal.signal(signal.SIGINT, before)

    @contextmanager
    def prompting(self) -> Iterator[None]:
        """Make SIGINT raise KeyboardInterrupt while the block lasts."""
        self._prompting, self.pending = True, False
        try:
            yield
        finally:
            self._prompting = False


def typed_lines(prompt: str, interrupt: PromptInterrupt) -> Iterator[str]:
    """Yield the typed lines until Ctrl-D; Ctrl-C discards the present one."""
    while True:
        try:
            with interrupt.prompting():
                line = input(prompt)
        except EOFError:
            print(flush=True)
            return
        except KeyboardInterrupt:
            print(flush=True)
            continue
        yield line


def edit_lines(completions: Callable[[str], Sequence[str]]) -> None:
    """Give the prompt editing, history and completion of the line so far, where Python has readline."""
    try:
        import readline
    except ImportError:
        return

    def complete(text: str, state: int) -> str | None:
        found = completions(text)
        return found[state] if state < len(found) else None

    readline.set_completer(complete)
    readline.set_completer_delims(_DELIMITERS)
    readline.parse_and_bind("tab: complete")
