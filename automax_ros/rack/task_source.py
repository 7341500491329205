"""Reads the source text of a task, which may be as old as the rack."""

from __future__ import annotations

import codecs
from pathlib import Path

from automax_ros.core.diagnostics import SourceText
from automax_ros.rack.files import read_bytes


def read_task_source(path: Path) -> SourceText:
    """Return a task's source, named by its path.

    A text that is not UTF-8 is read with one character per byte (Latin-1): editors of the rack's time wrote such bytes
    into remarks, and every column stays where it is (decision).

    Raises:
        FileFault: the file cannot be read or is too large.
    """
    data = read_bytes(path).removeprefix(codecs.BOM_UTF8)
    try:
        return SourceText(str(path), data.decode())
    except UnicodeDecodeError:
        return SourceText(str(path), data.decode("latin-1"))
