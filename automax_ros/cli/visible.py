"""The one place through which `automax` prints: no control character of what it prints reaches the terminal.

File names, a rack's answers, a person's arguments and what other programs said are printed as they come; here their
control characters are made visible (``core.text.visible``). What this program itself tells the terminal, a colour or
to write a line again, goes through ``write_control``.
"""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, TextIO, cast

from automax_ros.core.text import visible

if TYPE_CHECKING:
    from collections.abc import Iterable


class VisibleStream:
    """A text stream that passes on what is written with its control characters made visible."""

    def __init__(self, stream: TextIO) -> None:
        """Stand in front of a stream: all else about it is the stream's own."""
        self._stream = stream

    def write(self, text: str) -> int:
        """Write a text; return its length."""
        self._stream.write(visible(text))
        return len(text)

    def writelines(self, lines: Iterable[str]) -> None:
        """Write texts one after the other."""
        for line in lines:
            self.write(line)

    def write_control(self, text: str) -> None:
        """Write a text as it is."""
        self._stream.write(text)

    def __getattr__(self, name: str) -> object:
        return getattr(self._stream, name)


class VisibleOutput:
    """Standard output and standard error of this process, made visible until ``undo``."""

    def __init__(self) -> None:
        """Begin; streams that are visible already stay as they are."""
        self._before = sys.stdout, sys.stderr
        sys.stdout, sys.stderr = _seen(sys.stdout), _seen(sys.stderr)

    def undo(self) -> None:
        """Put the streams back that were there before."""
        sys.stdout, sys.stderr = self._before


def write_control(stream: TextIO, text: str) -> None:
    """Write a text of this program's own with its control sequences, and of others' only what is visible already."""
    if isinstance(stream, VisibleStream):
        stream.write_control(text)
    else:
        stream.write(text)


def _seen(stream: TextIO) -> TextIO:
    return stream if isinstance(stream, VisibleStream) else cast(TextIO, VisibleStream(stream))
