"""Report a run from a recording: one self-contained HTML page, and a picture.

Of every rack the signals that its file watches or --watch names, over time and as numbers, the alarms that its file
names, its tasks, and what happened in which order. Of every drive, or of the one whose current minor loop is in a task:
speed, current reference and feedback, DELTA, bridge, faults and errors with their times, rms current and energies.
Without --output and --png both are written next to the recording: BAG_report.html and BAG_report.png.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import replace
from datetime import datetime, timezone
from pathlib import Path

from automax_ros.cli.options.values import (
    add_output_argument,
    add_watch_argument,
    add_window_arguments,
    watch_list,
    window_of,
)
from automax_ros.cli.output.figure import FigureLayout, figure_of, image_of, save_picture
from automax_ros.cli.output.files import require_different_files, require_writable, write_text
from automax_ros.cli.output.report_page import page, rack_page
from automax_ros.cli.output.screen import print_diagnostics, share_shown
from automax_ros.cli.output.signals import ended_by_signals
from automax_ros.core.ticks import NS_PER_S
from automax_ros.core.user_error import UsageError
from automax_ros.recordings.read.reader import BagReader
from automax_ros.recordings.read.run_facts import run_facts
from automax_ros.recordings.tables.export import require_another_file
from automax_ros.recordings.tables.traces import MAX_LINES, Traces
from automax_ros.replay.drive_report.drive_report import DriveReport, drive_report
from automax_ros.replay.drive_report.rack_report import RackReport, rack_report
from automax_ros.replay.scans.stored_rack import SourceRefused

_WIDTH_PX = 1400
_PAGES = (".html", ".htm")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``automax report``."""
    parser.add_argument("bag", type=Path, metavar="BAG", help="a recording: its folder, or its .mcap file")
    add_output_argument(parser, "FILE.html", "the page")
    parser.add_argument(
        "--png",
        type=Path,
        metavar="FILE.png",
        help="the picture of all drives; of the line with --watch, where there is a web, or no drive",
    )
    add_watch_argument(parser, "what the rack file watches")
    parser.add_argument(
        "--task", type=str.upper, metavar="NAME", help="one drive alone: that whose DC_DRIVE_CML is in this task"
    )
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
    if output is not None and output.suffix.lower() not in ("", *_PAGES):
        raise UsageError(f"--output {output}: the page is an HTML file", "name it FILE.html; --png writes the picture")
    watch = watch_list(arguments.watch)
    if watch == []:
        raise UsageError("--watch names no variable", "`automax bag info BAG` lists them")
    if watch is not None and arguments.task is not None:
        raise UsageError("--task asks for one drive alone, --watch for signals of the rack", "leave one of them out")
    try:
        with ended_by_signals(), share_shown("report") as progress:
            window, references = window_of(arguments), _references(arguments.speed_ref)
            if arguments.task is None:
                rack = rack_report(bag, window, progress, watch, references)
                line, drives = (rack if rack.has_line else None), rack.drives
            else:
                line, drives = None, drive_report(bag, arguments.task, window, progress, references)
    except SourceRefused as error:
        for source, diagnostics in error.findings:
            print_diagnostics(diagnostics, source, sys.stderr)
        raise UsageError(f"{bag}: the rack file stored inside has errors") from error
    of_line = watch is not None or not drives.drives or (line is not None and line.has_webs)
    _write(line, drives, bag, output, png, of_line=of_line)
    if arguments.output is None and arguments.png is None and sys.stderr.isatty():
        print(f"{output}, {png}", file=sys.stderr)
    return 0


def _write(
    line: RackReport | None, drives: DriveReport, bag: Path, output: Path | None, png: Path | None, *, of_line: bool
) -> None:
    """Write page and picture of the rack, if there is a report on it, and of its drives.

    ``of_line``: the picture is that of the rack, not that of all drives.
    """
    name = bag.resolve().name
    of_rack = of_drives = None
    if line is not None and (output is not None or of_line):
        of_rack = _picture(line.traces, name)
    if drives.drives and ((png is not None and not of_line) or (output is not None and len(drives.drives) < 2)):
        of_drives = _picture(_together(drives), name)
    if output is not None:
        pictures = _pictures(drives, of_drives)
        made = name + _origin(bag)
        text = page(drives, made, pictures) if line is None else rack_page(line, made, of_rack, pictures)
        write_text(output, text)
    if png is not None:
        picture = of_rack if of_line else of_drives
        if picture is None:
            raise UsageError("the recording holds no course to draw", "--output alone writes the page")
        save_picture(picture, png)


def _picture(shown: Traces, name: str) -> bytes | None:
    if not shown.lines:
        return None
    return image_of(figure_of(shown, FigureLayout(f"{shown.rack[:80]}: {name[:80]}", _WIDTH_PX)))


def _origin(bag: Path) -> str:
    """Return when the run began, if it was on the wall clock, and which version recorded it, as far as it is known."""
    reader = BagReader(bag)
    version, stamp = reader.custom_data.get("version"), run_facts(reader).table.stamp
    words = []
    if stamp > 0:
        began = datetime.fromtimestamp(stamp // NS_PER_S, timezone.utc)
        words.append(f"run begun at {began:%Y-%m-%d %H:%M:%S} UTC")
    else:
        words.append("simulated time")
    if version:
        words.append(f"automax_ros {version[:40]}")
    return f" ({', '.join(words)})"


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
            found[run.drive.name] = image_of(figure_of(traces, FigureLayout(run.drive.name, _WIDTH_PX)))
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
