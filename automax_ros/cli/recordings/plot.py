"""Draw variables of a recording over time: analog lanes, logic lanes, errors of tasks.

Variables of one unit share a lane. A common that has a `scale` in the rack file is drawn in its unit, not in counts.
Values hold until they change; however long the recording, no peak is lost.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from automax_ros.cli.options.values import add_output_argument, add_window_arguments, watch_list, window_of
from automax_ros.cli.output.figure import FigureLayout, figure_of, save
from automax_ros.cli.output.files import require_picture_file
from automax_ros.cli.output.screen import share_shown
from automax_ros.cli.output.signals import ended_by_signals
from automax_ros.core.ticks import seconds_text
from automax_ros.core.user_error import UsageError
from automax_ros.recordings.tables.export import require_another_file
from automax_ros.recordings.tables.traces import traces

_SIZES_PX = range(200, 10_001)
_DEFAULT_WIDTH_PX = 1400


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``automax plot``."""
    parser.add_argument("bag", type=Path, metavar="BAG", help="a recording: its folder, or its .mcap file")
    parser.add_argument(
        "variables",
        nargs="+",
        metavar="VAR",
        help="what to draw, such as REF%% RUN@ 'TABLE%%(3)'; commas may part them",
    )
    add_output_argument(parser, "FILE", "the picture: FILE.png, .svg or .pdf", required=True)
    add_window_arguments(parser)
    parser.add_argument("--separate", action="store_true", help="a separate lane for each analog variable")
    parser.add_argument(
        "--size", type=_size, default=(_DEFAULT_WIDTH_PX, 0), metavar="WxH", help="size in pixels, such as 1600x900"
    )


def run(arguments: argparse.Namespace) -> int:
    """Draw the picture."""
    from automax_ros.replay.scans.scales import recorded_scales, traces_in_units  # takes a while to load

    output: Path = arguments.output
    require_picture_file(output)
    window = window_of(arguments)
    names = watch_list(arguments.variables)
    if not names:
        raise UsageError("name a variable", "`automax bag info BAG` lists them")
    width, height = arguments.size
    require_another_file(arguments.bag, output)
    with ended_by_signals(), share_shown("plot") as progress:
        shown = traces_in_units(traces(arguments.bag, names, window, progress), recorded_scales(arguments.bag))
        title = f"{shown.rack[:80]}: {arguments.bag.resolve().name[:80]}"
        if window.start_ns or window.end_ns is not None:
            end = seconds_text(round(shown.end_s * 10**9))
            title += f", {seconds_text(window.start_ns)} to {end} s"
        save(figure_of(shown, FigureLayout(title, width, height, arguments.separate)), output)
    return 0


def _size(text: str) -> tuple[int, int]:
    width, cross, height = text.lower().partition("x")
    if cross and (width + height).isdecimal() and text.isascii() and len(text) < 12:
        size = int(width), int(height)
        if size[0] in _SIZES_PX and size[1] in _SIZES_PX:
            return size
    raise argparse.ArgumentTypeError(
        f"{text[:40]!r} is not a size: WIDTHxHEIGHT in pixels, {_SIZES_PX.start} to {_SIZES_PX.stop - 1} each"
    )
