"""Write common memory of a recording to a CSV table: one row for each instant at which a watched variable changed."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from automax_ros.bags.errors import BagError
from automax_ros.bags.export import export_csv
from automax_ros.cli.terminal import count_of
from automax_ros.cli.watch import add_watch_argument, watch_list


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``automax export``."""
    parser.add_argument("bag", type=Path, metavar="BAG", help="a recording: its folder, or its .mcap file")
    parser.add_argument("--output", type=Path, required=True, metavar="OUT.csv", help="the table to write")
    add_watch_argument(parser, "every simple common that is no string")


def run(arguments: argparse.Namespace) -> int:
    """Export the recording."""
    try:
        rows = export_csv(arguments.bag, arguments.output, watch_list(arguments.watch))
    except BagError as error:
        print(error, file=sys.stderr)
        return 2
    if sys.stderr.isatty():
        print(f"{arguments.output}: {count_of(rows, 'row')}", file=sys.stderr)
    return 0
