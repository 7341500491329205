"""Describe the control blocks: one line per block; with NAME all about one, ending with a template to paste."""

from __future__ import annotations

import argparse
import sys

from automax_ros.blocks.catalogue import CATALOGUE
from automax_ros.blocks.declare.declaration import Block
from automax_ros.blocks.describe import description, summary, template, templates
from automax_ros.core.text import did_you_mean, quoted
from automax_ros.core.user_error import UsageError


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``automax blocks``."""
    parser.add_argument("name", nargs="?", metavar="NAME", help="a block, such as PROP_INT")
    parser.add_argument(
        "--template", action="store_true", help="print only the CALL to paste, of NAME or of all blocks"
    )


def run(arguments: argparse.Namespace) -> int:
    """Print the description or the template of one block or of all."""
    if arguments.name is None:
        every = CATALOGUE.values()
        sys.stdout.write(templates(every) if arguments.template else summary(every))
    else:
        block = _block(arguments.name)
        sys.stdout.write(template(block) if arguments.template else description(block))
    return 0


def _block(name: str) -> Block:
    block = CATALOGUE.get(name.strip().upper())
    if block is None:
        hint = did_you_mean(name, CATALOGUE) or "`automax blocks` lists them all"
        raise UsageError(f"no block {quoted(name)}", hint)
    return block
