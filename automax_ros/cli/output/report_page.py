"""The page of `automax report`: what a rack watches, its alarms, numbers and tasks, then each of its drives."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import isnan

from automax_ros.cli.output.html_page import MOST_ROWS, document, image, plain, rows
from automax_ros.core.text import count_of
from automax_ros.core.types import DataType
from automax_ros.drive.base.nameplate import DriveParameters
from automax_ros.replay.drive_report.drive_report import DriveReport
from automax_ros.replay.drive_report.drive_run import FAULTS, HELD, STATE, DriveRun
from automax_ros.replay.drive_report.drive_totals import J_PER_KWH, CountTotals, PlantTotals, rpm_of
from automax_ros.replay.drive_report.happenings import DriveEvent
from automax_ros.replay.drive_report.numbers import SignalNumbers
from automax_ros.replay.drive_report.rack_report import RackReport

_ENERGIES = {
    "line_j": "from the line",
    "loss_j": "lost as heat",
    "stored_j": "stored in inductances",
    "shaft_j": "to the shaft",
}


def page(report: DriveReport, recording: str, pictures: Mapping[str, bytes]) -> str:
    """Return the page of drives; ``pictures`` are PNG files by drive, ``recording`` says what the page is of."""
    return _page(report, recording, pictures, ())


def _page(
    report: DriveReport, recording: str, pictures: Mapping[str, bytes], before: Sequence[str], *, told: bool = False
) -> str:
    """Return the page of drives; ``told``: a sequence in ``before`` has all that happened to them."""
    title = f"{report.rack}: {', '.join(run.drive.name for run, _ in report.drives)}"
    parts = list(before)
    for run, marks in report.drives:
        parts += _drive(run, len(marks.marks) + marks.unmarked, pictures.get(run.drive.name), told=told)
    return document(title, _of(recording, report.start_s, report.end_s), parts)


def sequence(events: Sequence[DriveEvent], omitted: int) -> list[str]:
    """Return the events as a table, empty without events; ``omitted`` is the number of events not listed."""
    if not events:
        return []
    found = [(f"{item.time_s:.4f}", item.kind, item.text) for item in events]
    kinds = ["" if item.is_end else item.kind for item in events]
    head = ("s", "kind", "what happened")
    return ["<h3>Sequence of operations</h3>", *rows(head, found, numbers=(0,), classes=kinds, omitted=omitted)]


def rack_page(report: RackReport, recording: str, picture: bytes | None, pictures: Mapping[str, bytes]) -> str:
    """Return the page of a rack: ``picture`` is that of what it watches, ``pictures`` are those of its drives.

    What happened stands in its sequence alone, unless that is too long to have all of it.
    """
    shown, drives = report.traces, report.drives.drives
    parts = [image(shown.rack, picture)] if picture is not None else []
    if report.held:
        verb = "is a current of a loop, which is" if len(report.held) == 1 else "are currents of loops, which are"
        text = f"{', '.join(report.held)} {verb} shown and counted only while the loop runs: in standby it is kept."
        parts.append(f'<p class="note">{plain(text)}</p>')
    parts += [*_alarms(report), *_numbers(report.numbers), *_tasks(report)]
    parts += sequence(report.happened.events, report.happened.omitted)
    if not drives:
        return document(shown.rack, _of(recording, shown.start_s, shown.end_s), parts)
    own = ["<section><h2>The line</h2>", *parts, "</section>"]
    told = not report.happened.omitted and len(report.happened.events) <= MOST_ROWS
    return _page(report.drives, recording, pictures, own, told=told)


def _alarms(report: RackReport) -> list[str]:
    if not report.alarms:
        return []
    found = [
        (
            item.label,
            item.text if item.text != item.label else "",
            str(item.times),
            f"{item.on_s:.3f}",
            "-" if item.first_s is None else f"{item.first_s:.4f}",
            "on" if item.is_on else "off",
        )
        for item in report.alarms
    ]
    head = ("alarm", "meaning", "times", "time on, s", "first, s", "at the end")
    classes = ["alarm" if item.times else "" for item in report.alarms]
    return ["<h3>Alarms</h3>", *rows(head, found, numbers=(2, 3, 4), classes=classes)]


def _numbers(numbers: Sequence[SignalNumbers]) -> list[str]:
    found = []
    for item in numbers:
        each = item.numbers
        is_logic = item.kind is DataType.BOOLEAN
        least, greatest, last = (
            _state(value) if is_logic else _number(value) for value in (each.least, each.greatest, each.last)
        )
        mean = f"{_number(100 * each.mean)} % TRUE" if is_logic and each.values else _number(each.mean)
        found.append((item.label, item.text, item.unit, least, greatest, mean, last))
    if not found:
        return []
    head = ("signal", "meaning", "unit", "min", "max", "mean", "last")
    parts = ["<h3>Numbers</h3>", *rows(head, found, numbers=(3, 4, 5, 6))]
    begun = [item.label for item in numbers if item.numbers.is_empty_first]
    if begun:
        text = f"Without the 0 of memory that was there until a task first wrote it: {', '.join(begun)}."
        parts.append(f'<p class="note">{plain(text)}</p>')
    return parts


def _number(value: float) -> str:
    """Return a number to four digits, and to the units digit."""
    if isnan(value):
        return "-"
    return f"{value:.0f}" if 1e3 <= abs(value) < 1e9 else f"{value:.4g}"


def _state(value: float) -> str:
    return "-" if isnan(value) else "TRUE" if value else "FALSE"


def _tasks(report: RackReport) -> list[str]:
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
    return ["<h3>Tasks</h3>", *rows(("task", "where", "period, ms", "scans", "errors"), found, numbers=(2, 3, 4))]


def _of(recording: str, start_s: float, end_s: float) -> str:
    return f"Recording {recording}: {start_s:.3f} to {end_s:.3f} s of the run."


def _drive(run: DriveRun, errors: int, picture: bytes | None, *, told: bool) -> list[str]:
    drive = run.drive
    loop = f", current minor loop in task {drive.task}" if drive.task else ""
    parts = [f"<section><h2>{plain(drive.name)}</h2>", f"<p>{plain(drive.where + loop)}</p>"]
    if picture is not None:
        parts.append(image(drive.name, picture))
    else:
        parts.append('<p class="note">The recording holds no course of this drive.</p>')
    parts += _notes_on_picture(run)
    parts += ["<h3>Totals</h3>", *rows(("", ""), totals(run, errors), numbers=()), *_numbers(run.numbers)]
    parts += _faults(run)
    if told and run.happened.events:
        parts.append('<p class="note">What happened to it stands in the sequence of the line.</p>')
    else:
        parts += sequence(run.happened.events, run.happened.omitted)
    return [*parts, *_notes(run), "</section>"]


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
    known = str(run.fault_count) if run.fault_count or not _is_without_faults(run) else "not recorded"
    found.append(("faults", f"{known}, {errors} in the task's error log" if run.drive.task else known))
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
    whole = f"over {counts.time_s:.3f} s, always in run"
    if counts.run_s < counts.time_s:
        whole = f"over {counts.run_s:.3f} s in run; {counts.rms:.1f} % over all {counts.time_s:.3f} s, 0 in standby"
    found = [
        ("rms current by I_FDBK", f"{counts.rms_in_run:.1f} % of rated {whole}"),
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


def _is_without_faults(run: DriveRun) -> bool:
    """Whether the recording tells of no fault of the drive, for no common carries one."""
    return not any(keyword in run.drive.signals for keyword in FAULTS)


def _faults(run: DriveRun) -> list[str]:
    head = "<h3>Faults</h3>"
    if _is_without_faults(run):
        where = "no common carries a fault output of its loop"
        if not run.drive.task:
            where = "it has no DC_DRIVE_CML with outputs; a UDC has the faults of its drives as bits of registers"
        return [head, f"<p>Not recorded: {where}.</p>"]
    unknown = [keyword for keyword in FAULTS if keyword not in run.drive.signals]
    text = f"Not recorded, since no common carries them: {', '.join(unknown)}."
    parts = [f'<p class="note">{plain(text)}</p>'] if unknown else []
    if not run.faults:
        return [head, f"<p>{'None of those that are recorded.' if unknown else 'None.'}</p>", *parts]
    found = [
        (f"{item.begin_s:.4f}", "still on" if item.end_s is None else f"{item.end_s:.4f}", item.text, item.keyword,
         item.variable)
        for item in run.faults
    ]  # fmt: skip
    columns = ("from, s", "to, s", "fault", "output", "variable")
    omitted = run.fault_count - len(run.faults)
    return [head, *rows(columns, found, numbers=(0, 1), omitted=omitted), *parts]


def _notes_on_picture(run: DriveRun) -> list[str]:
    """Return what is to be known to read the picture and the numbers."""
    notes = []
    held = [keyword for keyword in HELD if keyword in run.drive.signals]
    if STATE in run.drive.signals:
        shown = f"; currents ({', '.join(held)}) are shown and counted only while it runs" if held else ""
        notes.append(f"In standby the outputs of the loop keep their last values (52.2.1){shown}.")
    if any(line.variable.label.endswith(" conducts") for line in run.lines):
        notes.append(
            "A bridge conducts where there is current in it at the instant of a sample. Where its row looks filled it "
            "changes from sample to sample, for the current is interrupted between its pulses."
        )
    return [f'<p class="note">{plain(text)}</p>' for text in notes]


def _notes(run: DriveRun) -> list[str]:
    notes = []
    if run.drive.unseen:
        notes.append(f"Not recorded, since their variables are locals: {', '.join(run.drive.unseen)}.")
    if run.plant.messages and not run.plant.metered:
        notes.append("Energies were not metered.")
    if not run.plant.messages:
        notes.append("The recording has no messages of the plant.")
    return [f'<p class="note">{plain(text)}</p>' for text in notes]
