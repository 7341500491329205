"""Put two recordings side by side and tell what differs, when, and how each responds to a step.

Both are placed on one axis of time: from the start of their runs, or with --align from an event that each of them has.
Without names all simple commons and the signals of plants and webs are compared. A value holds until the next one, so
recordings with different scan times are compared exactly. A common with a `scale` is shown in its unit, and numbers of
--align and --reference are in it; whether it differs is decided on the counts that memory held. Exit code: 0 equal
within --tolerance; 1 something differs, or one has a variable that the other lacks; 2 a recording cannot be read, or
the event does not happen.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from automax_ros.cli.options.first_word import add_form
from automax_ros.cli.options.replayed import add_tolerance_argument, tolerance_of, with_repair
from automax_ros.cli.options.values import option_number, seconds, watch_list
from automax_ros.cli.output.files import require_different_files, require_picture_file, require_writable, write_text
from automax_ros.cli.output.screen import share_shown
from automax_ros.cli.output.signals import ended_by_signals
from automax_ros.cli.tasks import compare_pulse
from automax_ros.core.text import quoted
from automax_ros.core.ticks import seconds_ns
from automax_ros.core.user_error import UsageError
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.recordings.tables.export import require_another_file

if TYPE_CHECKING:
    from automax_ros.comparison.comparison import Comparison

_PICTURE = Path("compare.png")
_BAND = "2"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``automax compare``, and the form ``automax compare pulse``."""
    title, text = "PULSE_MULT with PMUL; a recording of this name is ./pulse", compare_pulse.__doc__ or ""
    form = add_form(parser, "pulse", title, text, compare_pulse.add_arguments)
    form.set_defaults(comparison=compare_pulse.run)
    parser.set_defaults(comparison=_run)
    parser.add_argument("before", type=Path, metavar="BEFORE", help="a recording: its folder, or its .mcap file")
    parser.add_argument("after", type=Path, metavar="AFTER", help="the other one")
    parser.add_argument(
        "variables",
        nargs="*",
        metavar="VAR",
        help="what to compare, such as REF%% RUN@ UNWIND.speed_rpm (default: all); commas may part them",
    )
    parser.add_argument(
        "--align",
        metavar="EVENT",
        help="what is at 0 of the axis in each run, such as RUN@ (TRUE), RUN@=FALSE, 'CUR_REF%%>500'",
    )
    parser.add_argument(
        "--align-from", type=seconds, default=0, metavar="S", help="look for it from S seconds of each run on"
    )
    parser.add_argument(
        "--shift", type=signed_seconds, default=0, metavar="S", help="place AFTER S seconds later; below 0 earlier"
    )
    parser.add_argument("--from", dest="start", type=signed_seconds, metavar="S", help="begin at S seconds of the axis")
    parser.add_argument("--to", dest="end", type=signed_seconds, metavar="S", help="end at S seconds of the axis")
    add_tolerance_argument(parser, "; with a scale counts of memory, though its difference is shown in the unit")
    parser.add_argument(
        "--reference",
        action="append",
        default=[],
        metavar="VAR=REF",
        help="what VAR follows, another or a number in its unit: SPD_FB%%=SPD_REF%%, TENSION!=600; may be given again",
    )
    parser.add_argument(
        "--band",
        default=_BAND,
        metavar="PERCENT",
        help=f"a response has settled within this part of its step (default: {_BAND})",
    )
    parser.add_argument(
        "--plot",
        nargs="?",
        type=Path,
        const=_PICTURE,
        metavar="FILE",
        help=f"draw both runs and their difference: FILE.png, .svg or .pdf (default: {_PICTURE})",
    )
    parser.add_argument("--html", type=Path, metavar="FILE", help="write one HTML page with the picture and all tables")
    parser.add_argument("--json", action="store_true", help="print the report for programs to read")


def run(arguments: argparse.Namespace) -> int:
    """Compare; 1 where something differs."""
    code: int = arguments.comparison(arguments)
    return code


def signed_seconds(text: str) -> int:
    """Convert a time, which may be below 0 s, to nanoseconds: the type of an option."""
    plain = text.strip()
    try:
        return -seconds_ns(plain[1:]) if plain.startswith("-") else seconds_ns(plain)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from None


def _run(arguments: argparse.Namespace) -> int:
    from automax_ros.comparison.align import read_event  # NumPy takes a while to load
    from automax_ros.comparison.comparison import ComparisonOptions, compare
    from automax_ros.comparison.report import as_data, report_text

    before, after = arguments.before, arguments.after
    plot, page = arguments.plot, arguments.html
    _require_places(arguments)
    names = watch_list(arguments.variables) or None
    options = ComparisonOptions(
        names,
        _references(arguments.reference),
        None if arguments.align is None else read_event(arguments.align),
        arguments.align_from,
        arguments.shift,
        arguments.start,
        arguments.end,
        tolerance_of(arguments),
        option_number("--band", arguments.band, 0.01, 50.0),
    )
    try:
        with ended_by_signals(), share_shown("compare") as progress:
            found = compare(before, after, options, progress)
    except BagError as error:
        bag = next((bag for bag in (before, after) if Path(error.place).is_relative_to(bag)), before)
        raise with_repair(error, bag) from error
    if arguments.json:
        print(json.dumps(as_data(found), indent=2, allow_nan=False))
    else:
        sys.stdout.write(report_text(found))
    if plot is not None or page is not None:
        with ended_by_signals():
            _draw(found, plot, page, named=names is not None)
    return 0 if found.equal else 1


def _require_places(arguments: argparse.Namespace) -> None:
    """Refuse options that go wrong only after the work.

    Raises:
        UsageError: a file cannot be written, the range ends before it begins, or --align-from lacks --align.
        BagError: a file belongs to a recording.
    """
    plot, page = arguments.plot, arguments.html
    if arguments.align_from and arguments.align is None:
        raise UsageError("--align-from is where --align EVENT begins to look", "give --align, or shift by --shift")
    if arguments.start is not None and arguments.end is not None and arguments.end < arguments.start:
        raise UsageError("--to lies before --from")
    if plot is not None:
        require_picture_file(plot)
    if page is not None:
        require_writable(page)
    for place in filter(None, (plot, page)):
        for bag in (arguments.before, arguments.after):
            require_another_file(bag, place)
    require_different_files({}, {"--plot": plot, "--html": page})


def _references(texts: list[str]) -> dict[str, str]:
    """Return what variables follow, by their names.

    Raises:
        UsageError: a text is not VAR=REF, or a variable has two.
    """
    found: dict[str, str] = {}
    for text in texts:
        name, equals, reference = (part.strip() for part in text.partition("="))
        if not (name and equals and reference):
            raise UsageError(f"--reference {quoted(text)} is not VAR=REF", "such as SPD_FB%=SPD_REF%, or SPD_FB%=1500")
        if name.upper() in (known.upper() for known in found):
            raise UsageError(f"--reference: {name} has two references", "give it one")
        found[name] = reference
    return found


def _draw(found: Comparison, plot: Path | None, page: Path | None, *, named: bool) -> None:
    from automax_ros.cli.output.comparison_figure import comparison_figure, drawn
    from automax_ros.cli.output.figure import image_of, save
    from automax_ros.cli.recordings.compare_page import page as page_of

    shown = drawn(found, named=named)
    figure = comparison_figure(found, shown) if shown else None
    if plot is not None:
        if figure is None:
            print("automax compare: nothing differs, so there is nothing to draw", file=sys.stderr)
        else:
            save(figure, plot)
    if page is not None:
        write_text(page, page_of(found, None if figure is None else image_of(figure)))
