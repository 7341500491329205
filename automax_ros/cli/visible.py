"""The streams through which `automax` prints: control characters in printed text do not reach the terminal.

File names, a rack's answers, the user's arguments and the output of other programs are printed unchecked; these streams
make their control characters visible (``core.text.visible``). Control sequences of this program itself, for colours or
to rewrite a line, go through ``write_control``.
"""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, TextIO, cast

from automax_ros.core.text import visible

if TYPE_CHECKING:
    from collections.abc import Iterable


class VisibleStream:
    """A text stream that makes control characters visible in text written to it."""

    def __init__(self, stream: TextIO) -> None:
        """Wrap a stream, which keeps all its other attributes."""
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
        """Replace the streams; those that are visible already stay as they are."""
        self._before = sys.stdout, sys.stderr
        sys.stdout, sys.stderr = _make_visible(sys.stdout), _make_visible(sys.stderr)

    def undo(self) -> None:
        """Restore the previous streams."""
        sys.stdout, sys.stderr = self._before


def write_control(stream: TextIO, text: str) -> None:
    """Write a text with this program's control sequences; text from elsewhere in it must have been made visible."""
    if isinstance(stream, VisibleStream):
        stream.write_control(text)
    else:
        stream.write(text)


def _make_visible(stream: TextIO) -> TextIO:
    return stream if isinstance(stream, VisibleStream) else cast(TextIO, VisibleStream(stream))
