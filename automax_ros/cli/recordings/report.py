"""Report a run from a recording: one self-contained HTML page, and a picture.

Of every drive of the rack, or of the one whose current minor loop is in a task: speed, current reference and feedback,
DELTA, bridge, faults and errors with their times, rms current and energies, and what happened in which order. Of a rack
without a drive the commons that its file watches, its tasks and what happened. Without --output and --png both are
written next to the recording: BAG_report.html and BAG_report.png.
"""

from __future__ import annotations

import argparse
import base64
import sys
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from html import escape
from pathlib import Path

from automax_ros.cli.options.values import add_output_argument, add_window_arguments, window_of
from automax_ros.cli.output.figure import FigureLayout, figure_of, image_of, save_picture
from automax_ros.cli.output.files import require_different_files, require_writable, write_text
from automax_ros.cli.output.screen import print_diagnostics, share_shown
from automax_ros.cli.output.signals import ended_by_signals
from automax_ros.core.text import count_of, printable
from automax_ros.core.user_error import UsageError
from automax_ros.drive.base.nameplate import DriveParameters
from automax_ros.recordings.tables.export import require_another_file
from automax_ros.recordings.tables.traces import MAX_LINES, Traces
from automax_ros.replay.drive_report.drive_report import DriveReport, drive_report
from automax_ros.replay.drive_report.drive_run import DriveRun
from automax_ros.replay.drive_report.drive_totals import J_PER_KWH, CountTotals, PlantTotals, rpm_of
from automax_ros.replay.drive_report.happenings import DriveEvent
from automax_ros.replay.drive_report.rack_report import RackReport, rack_report
from automax_ros.replay.scans.stored_rack import SourceRefused

MOST_ROWS = 500
"""Most rows of a table of the page (decision); the number of further rows is printed below it."""
_STYLE = """
body { font-family: sans-serif; margin: 2em auto; max-width: 75em; color: #222; }
img { max-width: 100%; }
table { border-collapse: collapse; margin: 0.5em 0 1.5em; }
th, td { border: 1px solid #ccc; padding: 0.2em 0.7em; text-align: left; vertical-align: top; }
th { background: #f0f0f0; }
td.number { text-align: right; font-variant-numeric: tabular-nums; }
tr.fault td { color: #a01020; }
tr.error td { color: #a01020; }
.note { color: #555; }
"""
_POLICY = "default-src 'none'; img-src data:; style-src 'unsafe-inline'"
"""Nothing is loaded and no script runs, whatever a recording has in its names."""


_ENERGIES = {
    "line_j": "from the line",
    "loss_j": "lost as heat",
    "stored_j": "stored in inductances",
    "shaft_j": "to the shaft",
}


def document(title: str, subtitle: str, parts: Sequence[str]) -> str:
    """Return a page of a title, a line below it, and parts that are HTML already."""
    head = [
        "<!DOCTYPE html>",
        '<html lang="en"><head><meta charset="utf-8">',
        f'<meta http-equiv="Content-Security-Policy" content="{_POLICY}">',
        f"<title>{plain(title)}</title><style>{_STYLE}</style></head><body>",
        f"<h1>{plain(title)}</h1>",
        f"<p>{plain(subtitle)}</p>",
    ]
    return "\n".join([*head, *parts, "</body></html>\n"])


def image(name: str, picture: bytes) -> str:
    """Return a PNG picture as an HTML element."""
    encoded = base64.b64encode(picture).decode("ascii")
    return f'<img alt="{plain(name)} over time" src="data:image/png;base64,{encoded}">'


def sequence(events: Sequence[DriveEvent], omitted: int) -> list[str]:
    """Return the events as a table, empty without events; ``omitted`` is the number of events not listed."""
    if not events:
        return []
    found = [(f"{item.time_s:.4f}", item.kind, item.text) for item in events]
    kinds = [item.kind for item in events]
    head = ("s", "", "what happened")
    return ["<h3>Sequence of operations</h3>", *rows(head, found, numbers=(0,), classes=kinds, omitted=omitted)]


def rows(
    head: Sequence[str],
    found: Sequence[Sequence[str]],
    *,
    numbers: Iterable[int],
    classes: Sequence[str] = (),
    omitted: int = 0,
) -> list[str]:
    """Return a table; ``numbers`` are the columns with numbers, ``classes`` the CSS classes of its rows."""
    right = set(numbers)
    lines = ["<table>"]
    if any(head):
        lines.append("<tr>" + "".join(f"<th>{plain(item)}</th>" for item in head) + "</tr>")
    for index, row in enumerate(found[:MOST_ROWS]):
        kind = f' class="{plain(classes[index])}"' if classes else ""
        cells = "".join(
            f'<td class="number">{plain(cell)}</td>' if column in right else f"<td>{plain(cell)}</td>"
            for column, cell in enumerate(row)
        )
        lines.append(f"<tr{kind}>{cells}</tr>")
    lines.append("</table>")
    more = max(0, len(found) - MOST_ROWS) + omitted
    if more:
        lines.append(f'<p class="note">And {more} more.</p>')
    return lines


def plain(text: str) -> str:
    """Return a text escaped for HTML."""
    return escape(printable(text), quote=True)


def page(report: DriveReport, recording: str, pictures: Mapping[str, bytes]) -> str:
    """Return the page of drives; ``pictures`` are PNG files by drive, ``recording`` is the recording's name."""
    title = f"{report.rack}: {', '.join(run.drive.name for run, _ in report.drives)}"
    parts: list[str] = []
    for run, marks in report.drives:
        parts += _drive(run, len(marks.marks) + marks.unmarked, pictures.get(run.drive.name))
    return document(title, _of(recording, report.start_s, report.end_s), parts)


def rack_page(report: RackReport, recording: str, picture: bytes | None) -> str:
    """Return the page of a rack without a drive."""
    shown = report.traces
    found = [
        (
            task.name,
            task.where,
            f"{task.period_ns / 1e6:g}" if task.period_ns else "-",
            str(task.scans),
            str(task.errors),
        )
        for task in report.tasks
    ]
    parts = [image(shown.rack, picture)] if picture is not None else []
    parts += ["<h3>Tasks</h3>", *rows(("task", "where", "period, ms", "scans", "errors"), found, numbers=(2, 3, 4))]
    parts += sequence(report.happened.events, report.happened.omitted)
    return document(shown.rack, _of(recording, shown.start_s, shown.end_s), parts)


def _of(recording: str, start_s: float, end_s: float) -> str:
    return f"Recording {recording}, {start_s:.3f} to {end_s:.3f} s of the run."


def _drive(run: DriveRun, errors: int, picture: bytes | None) -> list[str]:
    drive = run.drive
    loop = f", current minor loop in task {drive.task}" if drive.task else ""
    parts = [f"<section><h2>{plain(drive.name)}</h2>", f"<p>{plain(drive.where + loop)}</p>"]
    if picture is not None:
        parts.append(image(drive.name, picture))
    else:
        parts.append('<p class="note">The recording holds no course of this drive.</p>')
    parts += ["<h3>Totals</h3>", *rows(("", ""), totals(run, errors), numbers=())]
    parts += [*_faults(run), *sequence(run.happened.events, run.happened.omitted), *_notes(run), "</section>"]
    return parts


def totals(run: DriveRun, errors: int) -> list[tuple[str, str]]:
    """Return the totals of a drive's run, in words."""
    found: list[tuple[str, str]] = []
    if run.drive.parameters is not None:
        found.append(("motor", _motor(run.drive.parameters)))
    if run.drive.lim_bar is not None:
        found.append(("LIM_BAR", f"{run.drive.lim_bar:g} % of rated current"))
    if "DC_CML_STATE" in run.drive.signals:
        found.append(("in run", f"{run.counts.run_s:.3f} s, {count_of(run.starts, 'start')}"))
    if "BRIDGE_POL" in run.drive.signals:
        found.append(("bridge", count_of(run.changes, "change") + " while it ran"))
    found.append(("faults", f"{run.fault_count}, {errors} in the task's error log"))
    if run.plant.messages:
        found += _of_plant(run.plant, run.drive.parameters)
    if run.counts.time_s > 0:
        found += _of_counts(run.counts)
    return found


def _motor(parameters: DriveParameters) -> str:
    rpm = rpm_of(parameters.values["base_speed_rad_s"].value)
    return f"{parameters.amps:.4g} A, {rpm:.4g} rpm, line {parameters.line_v:g} V {parameters.line_hz:g} Hz"


def _of_plant(plant: PlantTotals, parameters: DriveParameters | None) -> list[tuple[str, str]]:
    def amps(value: float) -> str:
        return f"{value:.1f} A" + (
            f", {100 * value / parameters.amps:.1f} % of rated" if parameters is not None else ""
        )

    found = [
        ("rms current", f"{amps(plant.rms_a)}, over {plant.time_s:.3f} s"),
        ("greatest current", f"{amps(plant.greatest_a)}, mean of a sample"),
        ("greatest speed", f"{plant.greatest_rpm:.1f} rpm"),
    ]
    if plant.metered:
        found += [(f"energy {text}", _energy(plant.energy_j(name))) for name, text in _ENERGIES.items()]
    return found


def _of_counts(counts: CountTotals) -> list[tuple[str, str]]:
    run = f"{counts.rms_in_run:.1f} % in run" if counts.run_s < counts.time_s else "always in run"
    found = [
        ("rms current by I_FDBK", f"{counts.rms:.1f} % of rated over {counts.time_s:.3f} s, {run}"),
        ("greatest I_FDBK", f"{counts.greatest:.1f} % of rated"),
    ]
    if counts.greatest_speed:
        found.append(("greatest SPEED_FDBK", f"{counts.greatest_speed:.1f} % of full speed"))
    if counts.parameters is not None:
        found.append(("armature heat by I_FDBK", f"{_energy(counts.heat_j)}, estimated: I^2 R of the mean current"))
        if counts.greatest_speed:
            found.append(
                ("to the shaft by counts", f"{_energy(counts.shaft_j)}, estimated: torque constant x I x speed")
            )
    return found


def _energy(joule: float) -> str:
    return f"{joule / 1000:.3f} kJ ({joule / J_PER_KWH * 1000:.3f} Wh)"


def _faults(run: DriveRun) -> list[str]:
    if not run.faults:
        return ["<h3>Faults</h3>", "<p>None.</p>"]
    found = [
        (f"{item.begin_s:.4f}", "still on" if item.end_s is None else f"{item.end_s:.4f}", item.text, item.keyword,
         item.variable)
        for item in run.faults
    ]  # fmt: skip
    head = ("from, s", "to, s", "fault", "output", "variable")
    return ["<h3>Faults</h3>", *rows(head, found, numbers=(0, 1), omitted=run.fault_count - len(run.faults))]


def _notes(run: DriveRun) -> list[str]:
    notes = []
    if "DC_CML_STATE" in run.drive.signals:
        notes.append("In standby the outputs of the loop keep their last values (52.2.1).")
    if run.drive.unseen:
        notes.append(f"Not recorded, since their variables are locals: {', '.join(run.drive.unseen)}.")
    if run.plant.messages and not run.plant.metered:
        notes.append("Energies were not metered.")
    if not run.plant.messages:
        notes.append("The recording has no messages of the plant.")
    return [f'<p class="note">{plain(text)}</p>' for text in notes]


_WIDTH_PX = 1400


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``automax report``."""
    parser.add_argument("bag", type=Path, metavar="BAG", help="a recording: its folder, or its .mcap file")
    add_output_argument(parser, "FILE.html", "the page")
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
        picture = image_of(figure_of(shown, FigureLayout(f"{report.rack[:80]}: {name[:80]}", _WIDTH_PX)))
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
