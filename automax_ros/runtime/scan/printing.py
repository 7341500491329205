"""The lines that PRINT makes from its items."""

from __future__ import annotations

from automax_ros.compile.base.functions import text_of
from automax_ros.core.types import Value

PRINT_ZONE = 14
"""Columns of a zone of PRINT; a comma advances to the next one (decision)."""


def format_print(values: tuple[Value, ...], separators: str) -> str:
    """Return a line of PRINT: a comma advances to the next zone of 14 columns, a semicolon joins (decision)."""
    line = ""
    for value, separator in zip(values, separators, strict=True):
        line += text_of(value)
        if separator == ",":
            line = line.ljust((len(line) // PRINT_ZONE + 1) * PRINT_ZONE)
    return line
