"""The list of variables given with ``--watch``."""

from __future__ import annotations

import argparse
import re

_COMMA = re.compile(r",(?![^(\[]*[)\]])")
"""A comma that does not stand between subscripts."""


def add_watch_argument(parser: argparse.ArgumentParser, default: str) -> None:
    """Add ``--watch``; ``default`` says what is watched without it."""
    parser.add_argument(
        "--watch",
        action="append",
        metavar="A%,B@",
        help=f"variables for the output, such as REF%%,RUN@,TABLE%%(3) (default: {default})",
    )


def watch_list(values: list[str] | None) -> list[str] | None:
    """Return the names in all ``--watch`` options, in their order; None if there is none."""
    if values is None:
        return None
    return [name.strip() for value in values for name in _COMMA.split(value) if name.strip()]
