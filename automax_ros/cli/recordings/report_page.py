"""The pages of ``automax report``: for drives, and for a rack without a drive."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Mapping, Sequence
from html import escape

from automax_ros.core.text import count_of, printable
from automax_ros.drive.base.nameplate import DriveParameters
from automax_ros.replay.drive_report.drive_report import DriveReport
from automax_ros.replay.drive_report.drive_run import DriveRun
from automax_ros.replay.drive_report.drive_totals import J_PER_KWH, CountTotals, PlantTotals, rpm_of
from automax_ros.replay.drive_report.happenings import Event
from automax_ros.replay.drive_report.rack_report import RackReport

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


def sequence(events: Sequence[Event], untold: int) -> list[str]:
    """Return the events as a table, empty without events; ``untold`` is the number of events not listed."""
    if not events:
        return []
    found = [(f"{item.time_s:.4f}", item.kind, item.text) for item in events]
    kinds = [item.kind for item in events]
    head = ("s", "", "what happened")
    return ["<h3>Sequence of operations</h3>", *rows(head, found, numbers=(0,), classes=kinds, untold=untold)]


def rows(
    head: Sequence[str],
    found: Sequence[Sequence[str]],
    *,
    numbers: Iterable[int],
    classes: Sequence[str] = (),
    untold: int = 0,
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
    more = max(0, len(found) - MOST_ROWS) + untold
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
    parts += sequence(report.happened.events, report.happened.untold)
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
    parts += [*_faults(run), *sequence(run.events, run.untold), *_notes(run), "</section>"]
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
    return ["<h3>Faults</h3>", *rows(head, found, numbers=(0, 1), untold=run.fault_count - len(run.faults))]


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
