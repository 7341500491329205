"""Report a run from a recording: one HTML page that is whole by itself, and a picture.

Of every drive of the rack, or of the one whose current minor loop is in a task: speed, current reference and feedback,
DELTA, bridge, faults and errors with their times, rms current and energies, and what happened in which order. Of a rack
without a drive the commons that its file watches, its tasks and what happened. Without --output and --png both are
written next to the recording: BAG_report.html and BAG_report.png.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import replace
from pathlib import Path

from automax_ros.cli.options.values import add_window_arguments, window_of
from automax_ros.cli.output.figure import Layout, figure_of, image_of, save_picture
from automax_ros.cli.output.files import require_different_files, require_writable, write_text
from automax_ros.cli.output.screen import print_diagnostics, share_shown
from automax_ros.cli.output.signals import ended_by_signals
from automax_ros.cli.recordings.report_page import page, rack_page
from automax_ros.core.user_error import UsageError
from automax_ros.recordings.tables.export import require_another_file
from automax_ros.recordings.tables.traces import MAX_LINES, Traces
from automax_ros.replay.drive_report.drive_report import DriveReport, drive_report
from automax_ros.replay.drive_report.rack_report import rack_report
from automax_ros.replay.scans.stored_rack import SourceRefused

_WIDTH_PX = 1400


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``automax report``."""
    parser.add_argument("bag", type=Path, metavar="BAG", help="a recording: its folder, or its .mcap file")
    parser.add_argument("--output", "-o", type=Path, metavar="FILE.html", help="the page")
    parser.add_argument("--png", type=Path, metavar="FILE.png", help="the picture of all drives")
    parser.add_argument("--task", type=str.upper, metavar="NAME", help="the drive whose DC_DRIVE_CML is in this task")
    parser.add_argument(
        "--speed-ref",
        action="append",
        type=str.upper,
        default=[],
        metavar="[DRIVE=]NAME",
        help="the common with a drive's speed reference: rpm where that is its unit, else 4095 counts at full speed "
        "(default: that of its plant's joint)",
    )
    add_window_arguments(parser)


def run(arguments: argparse.Namespace) -> int:
    """Write the page and the picture."""
    bag: Path = arguments.bag
    output, png = _places(arguments)
    for path in filter(None, (output, png)):
        require_writable(path)
        require_another_file(bag, path)
    require_different_files({}, {"--output": output, "--png": png})
    try:
        with ended_by_signals(), share_shown("report") as progress:
            report = drive_report(bag, arguments.task, window_of(arguments), progress, _references(arguments.speed_ref))
            whole = None if report.drives else rack_report(bag, window_of(arguments), progress)
    except SourceRefused as error:
        for source, diagnostics in error.findings:
            print_diagnostics(diagnostics, source, sys.stderr)
        raise UsageError(f"{bag}: the rack file stored inside has errors") from error
    name = bag.resolve().name
    shown = _together(report) if whole is None else whole.traces
    picture = None
    if shown.lines and (png is not None or len(report.drives) < 2):
        picture = image_of(figure_of(shown, Layout(f"{report.rack[:80]}: {name[:80]}", _WIDTH_PX)))
    if output is not None:
        text = page(report, name, _pictures(report, picture)) if whole is None else rack_page(whole, name, picture)
        write_text(output, text)
    if png is not None:
        if picture is None:
            raise UsageError("the recording holds no course to draw", "--output alone writes the page")
        save_picture(picture, png)
    if arguments.output is None and arguments.png is None and sys.stderr.isatty():
        print(f"{output}, {png}", file=sys.stderr)
    return 0


def _references(texts: list[str]) -> dict[str, str]:
    """Return the commons that ``--speed-ref`` names, by drive; "" is the only drive."""
    found: dict[str, str] = {}
    for text in texts:
        drive, _, name = text.rpartition("=")
        if drive.strip() in found:
            raise UsageError(f"--speed-ref {text}: the drive has one already")
        found[drive.strip()] = name.strip()
    return found


def _places(arguments: argparse.Namespace) -> tuple[Path | None, Path | None]:
    """Return the files of page and picture, None for one that is not requested."""
    output: Path | None = arguments.output
    png: Path | None = arguments.png
    if output is None and png is None:
        bag = arguments.bag.resolve()
        stem = bag.stem if bag.is_file() else bag.name
        return bag.with_name(f"{stem}_report.html"), bag.with_name(f"{stem}_report.png")
    if png is not None and png.suffix.lower() != ".png":
        raise UsageError(f"--png {png}: the picture is a PNG file", "name it FILE.png")
    return output, png


def _pictures(report: DriveReport, together: bytes | None) -> dict[str, bytes]:
    """Return the picture of each drive with recorded signals, as a PNG file; a single drive's is ``together``."""
    found: dict[str, bytes] = {}
    if len(report.drives) == 1:
        return {} if together is None else {report.drives[0][0].drive.name: together}
    for run, marks in report.drives:
        traces = report.traces(run, marks)
        if traces.lines:
            found[run.drive.name] = image_of(figure_of(traces, Layout(run.drive.name, _WIDTH_PX)))
    return found


def _together(report: DriveReport) -> Traces:
    all_traces = [report.traces(run, marks) for run, marks in report.drives]
    if len(all_traces) == 1:
        return all_traces[0]
    lines = []
    for (run, _), traces in zip(report.drives, all_traces, strict=True):
        for line in traces.lines:
            seen = line.variable
            unit = f"{run.drive.name}: {seen.unit}"
            lines.append(replace(line, variable=replace(seen, label=f"{run.drive.name} {seen.label}", unit=unit)))
    errors = {mark for traces in all_traces for mark in traces.errors}
    return replace(
        all_traces[0],
        lines=tuple(lines[:MAX_LINES]),
        errors=tuple(sorted(errors, key=lambda mark: (mark.time_s, mark.task, mark.line))),
        unmarked=sum(traces.unmarked for traces in all_traces),
    )
