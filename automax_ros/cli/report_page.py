"""The page of ``automax report``: HTML that is whole by itself, without scripts, fonts or pictures from elsewhere."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Mapping, Sequence
from html import escape

from automax_ros.core.text import count_of, printable
from automax_ros.drive.nameplate import DriveParameters
from automax_ros.replay.drive_report import DriveReport
from automax_ros.replay.drive_run import DriveRun
from automax_ros.replay.drive_totals import J_PER_KWH, CountTotals, PlantTotals, rpm_of

MOST_ROWS = 500
"""Longest table of the page (decision); it says how many rows there are more."""
_ENERGIES = {
    "line_j": "from the line",
    "loss_j": "lost as heat",
    "stored_j": "stored in inductances",
    "shaft_j": "to the shaft",
}
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
"""Nothing is loaded, no script runs, whatever a recording has put into a name."""


def page(report: DriveReport, recording: str, pictures: Mapping[str, bytes]) -> str:
    """Return the page; ``pictures`` are PNG files by the name of their drive, ``recording`` is what is read."""
    title = f"{report.rack}: {_words(run.drive.name for run, _ in report.drives)}"
    parts = [
        "<!DOCTYPE html>",
        '<html lang="en"><head><meta charset="utf-8">',
        f'<meta http-equiv="Content-Security-Policy" content="{_POLICY}">',
        f"<title>{_text(title)}</title><style>{_STYLE}</style></head><body>",
        f"<h1>{_text(title)}</h1>",
        f"<p>Recording {_text(recording)}, {report.start_s:.3f} to {report.end_s:.3f} s of the run.</p>",
    ]
    for run, marks in report.drives:
        parts += _drive(run, len(marks.marks) + marks.unmarked, pictures.get(run.drive.name))
    parts.append("</body></html>\n")
    return "\n".join(parts)


def _drive(run: DriveRun, errors: int, picture: bytes | None) -> list[str]:
    drive = run.drive
    loop = f", current minor loop in task {drive.task}" if drive.task else ""
    parts = [f"<section><h2>{_text(drive.name)}</h2>", f"<p>{_text(drive.where + loop)}</p>"]
    if picture is not None:
        encoded = base64.b64encode(picture).decode("ascii")
        parts.append(f'<img alt="{_text(drive.name)} over time" src="data:image/png;base64,{encoded}">')
    else:
        parts.append('<p class="note">The recording holds no course of this drive.</p>')
    parts += ["<h3>Totals</h3>", *_rows(("", ""), totals(run, errors), numbers=())]
    parts += [*_faults(run), *_events(run), *_notes(run), "</section>"]
    return parts


def totals(run: DriveRun, errors: int) -> list[tuple[str, str]]:
    """Return what the run of a drive adds up to, in words."""
    rows: list[tuple[str, str]] = []
    if run.drive.parameters is not None:
        rows.append(("motor", _motor(run.drive.parameters)))
    if run.drive.lim_bar is not None:
        rows.append(("LIM_BAR", f"{run.drive.lim_bar:g} % of rated current"))
    if "DC_CML_STATE" in run.drive.signals:
        rows.append(("in run", f"{run.counts.run_s:.3f} s, {count_of(run.starts, 'start')}"))
    if "BRIDGE_POL" in run.drive.signals:
        rows.append(("bridge", count_of(run.changes, "change") + " while it ran"))
    rows.append(("faults", f"{run.fault_count}, {errors} in the task's error log"))
    if run.plant.messages:
        rows += _of_plant(run.plant, run.drive.parameters)
    if run.counts.time_s > 0:
        rows += _of_counts(run.counts)
    return rows


def _motor(parameters: DriveParameters) -> str:
    rpm = rpm_of(parameters.values["base_speed_rad_s"].value)
    return f"{parameters.amps:.4g} A, {rpm:.4g} rpm, line {parameters.line_v:g} V {parameters.line_hz:g} Hz"


def _of_plant(plant: PlantTotals, parameters: DriveParameters | None) -> list[tuple[str, str]]:
    def amps(value: float) -> str:
        return f"{value:.1f} A" + (
            f", {100 * value / parameters.amps:.1f} % of rated" if parameters is not None else ""
        )

    rows = [
        ("rms current", f"{amps(plant.rms_a)}, over {plant.time_s:.3f} s"),
        ("greatest current", f"{amps(plant.greatest_a)}, mean of a sample"),
        ("greatest speed", f"{plant.greatest_rpm:.1f} rpm"),
    ]
    if plant.metered:
        rows += [(f"energy {text}", _energy(plant.energy_j(name))) for name, text in _ENERGIES.items()]
    return rows


def _of_counts(counts: CountTotals) -> list[tuple[str, str]]:
    run = f"{counts.rms_in_run:.1f} % in run" if counts.run_s < counts.time_s else "always in run"
    rows = [
        ("rms current by I_FDBK", f"{counts.rms:.1f} % of rated over {counts.time_s:.3f} s, {run}"),
        ("greatest I_FDBK", f"{counts.greatest:.1f} % of rated"),
    ]
    if counts.greatest_speed:
        rows.append(("greatest SPEED_FDBK", f"{counts.greatest_speed:.1f} % of full speed"))
    if counts.parameters is not None:
        rows.append(("armature heat by I_FDBK", f"{_energy(counts.heat_j)}, estimated: I^2 R of the mean current"))
        if counts.greatest_speed:
            rows.append(
                ("to the shaft by counts", f"{_energy(counts.shaft_j)}, estimated: torque constant x I x speed")
            )
    return rows


def _energy(joule: float) -> str:
    return f"{joule / 1000:.3f} kJ ({joule / J_PER_KWH * 1000:.3f} Wh)"


def _faults(run: DriveRun) -> list[str]:
    if not run.faults:
        return ["<h3>Faults</h3>", "<p>None.</p>"]
    rows = [
        (f"{item.begin_s:.4f}", "still on" if item.end_s is None else f"{item.end_s:.4f}", item.text, item.keyword,
         item.variable)
        for item in run.faults
    ]  # fmt: skip
    head = ("from, s", "to, s", "fault", "output", "variable")
    return ["<h3>Faults</h3>", *_rows(head, rows, numbers=(0, 1), untold=run.fault_count - len(run.faults))]


def _events(run: DriveRun) -> list[str]:
    if not run.events:
        return []
    rows = [(f"{item.time_s:.4f}", item.kind, item.text) for item in run.events]
    kinds = [item.kind for item in run.events]
    untold = run.untold
    return [
        "<h3>Sequence of operations</h3>",
        *_rows(("s", "", "what happened"), rows, numbers=(0,), classes=kinds, untold=untold),
    ]


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
    return [f'<p class="note">{_text(text)}</p>' for text in notes]


def _rows(
    head: Sequence[str],
    rows: Sequence[Sequence[str]],
    *,
    numbers: Iterable[int],
    classes: Sequence[str] = (),
    untold: int = 0,
) -> list[str]:
    """Return a table; ``numbers`` are the columns with numbers, ``classes`` the kinds of its rows."""
    right = set(numbers)
    lines = ["<table>"]
    if any(head):
        lines.append("<tr>" + "".join(f"<th>{_text(item)}</th>" for item in head) + "</tr>")
    for index, row in enumerate(rows[:MOST_ROWS]):
        kind = f' class="{_text(classes[index])}"' if classes else ""
        cells = "".join(
            f'<td class="number">{_text(cell)}</td>' if column in right else f"<td>{_text(cell)}</td>"
            for column, cell in enumerate(row)
        )
        lines.append(f"<tr{kind}>{cells}</tr>")
    lines.append("</table>")
    more = max(0, len(rows) - MOST_ROWS) + untold
    if more:
        lines.append(f'<p class="note">And {more} more.</p>')
    return lines


def _words(names: Iterable[str]) -> str:
    return ", ".join(names)


def _text(text: str) -> str:
    return escape(printable(text), quote=True)
