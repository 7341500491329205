"""Draw the block diagram of a task (.BLK) as SVG: its blocks, what joins them, and the commons at its edges.

A wire leads from what wrote a variable last to what reads it; a dashed one carries the value of the last scan. Tasks
that jump or loop have no diagram. docs/diagram.md says how to read one.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from automax_ros.cli.options.task import add_target_arguments, check_task_file, target_of
from automax_ros.cli.options.values import add_output_argument
from automax_ros.cli.output.files import require_different_files, require_writable, write_text
from automax_ros.cli.output.screen import print_diagnostics
from automax_ros.diagram.model import diagram_of
from automax_ros.diagram.placed import placed
from automax_ros.diagram.svg import svg_of


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``automax diagram``."""
    parser.add_argument("file", type=Path, metavar="FILE", help="a task (.BLK)")
    add_output_argument(parser, "OUT", "the picture to write, as SVG (default: standard output)")
    add_target_arguments(parser)


def run(arguments: argparse.Namespace) -> int:
    """Write the drawing, or print the errors of the task or why it has none."""
    output: Path | None = arguments.output
    require_different_files({"FILE": arguments.file}, {"--output": output})
    if output is not None:
        require_writable(output)
    source, result = check_task_file(arguments.file, target_of(arguments))
    if result.program is None:
        print_diagnostics(result.diagnostics, source, sys.stderr)
        return 1
    diagram = diagram_of(result.program, source)
    if diagram.why:
        print(f"{arguments.file}: not drawn: {diagram.why}", file=sys.stderr)
        return 1
    text = svg_of(placed(diagram))
    if output is None:
        sys.stdout.write(text)
    else:
        write_text(output, text)
    return 0
