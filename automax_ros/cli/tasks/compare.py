"""Show, on a plant's own data, where an instruction of a Logix controller differs from the block it replaces."""

from __future__ import annotations

import argparse

from automax_ros.cli.tasks import compare_pulse


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``automax compare``: a word for what is compared, and the arguments of that comparison."""
    comparisons = parser.add_subparsers(title="what to compare", metavar="WHAT", required=True)
    pulse = comparisons.add_parser(
        "pulse",
        help="PULSE_MULT with PMUL",
        description=compare_pulse.__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    compare_pulse.add_arguments(pulse)
    pulse.set_defaults(comparison=compare_pulse.run)


def run(arguments: argparse.Namespace) -> int:
    """Compare; 1 where something differs."""
    code: int = arguments.comparison(arguments)
    return code
