"""The answers of a rack as lines of text, for `automax ctl`."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

from automax_ros.cli.operate.watch import value_line
from automax_ros.core.text import count_of
from automax_ros.core.types import type_of_name
from automax_ros.core.values import source_text, value_of

if TYPE_CHECKING:
    from automax_ros.cli.operate.actions import ServiceCall

ALREADY = "was already"
"""Beginning of the text for a value that was set before."""


def fields_of(item: Any) -> dict[str, Any]:
    """Return the fields of a message of plain values."""
    found = {name: getattr(item, name) for name in item.get_fields_and_field_types() if name not in ("ok", "reason")}
    return {
        name: value if isinstance(value, str) or not _is_list(value) else list(value) for name, value in found.items()
    }


def _is_list(value: object) -> bool:
    return isinstance(value, Iterable)


def value_lines(data: Any) -> Iterable[str]:
    """Return values with their names."""
    return map(value_line, data)


def task_lines(data: Any) -> Iterable[str]:
    """Return the table of tasks."""
    yield f"{'task':8} {'module':14} {'status':14} {'prio':>4} {'ms':>8} {'scans':>10} {'skipped':>8} {'errors':>7}"
    for item in data:
        period = f"{item['period_ms']:g}" if item["period_ms"] else "-"
        yield (
            f"{item['task']:8} {item['module']:14} {item['status']:14} {item['priority']:4} {period:>8} "
            f"{item['scans']:10} {item['skipped']:8} {item['errors']:7}"
        )


def error_lines(data: Any) -> Iterable[str]:
    """Return entries of error logs."""
    for item in data:
        place = f"scan {item['scan']}, line {item['line']}"
        yield f"{item['task']:8} {item['place']:6} {place}: {item['code']} {item['text']}"
    if not data:
        yield "no errors are logged"


def step_lines(data: Any) -> Iterable[str]:
    """Return the result of a step."""
    yield f"step: {data['why']} at {data['time_s']:.9g} s, {count_of(data['scans'], 'scan')}"


def status_lines(data: Any) -> Iterable[str]:
    """Return the status of a rack, the faults of its drives, and the displays of its Processors."""
    power = "" if data["powered"] else ", the power is off"
    ended = f", {data['ended']} ended" if data["ended"] else ""
    runs = f"{data['running']} run{ended}" if ended else f"{data['running']} of {count_of(data['tasks'], 'task')} run"
    yield f"rack {data['rack']}: {data['time_s']:.3f} s, {runs}{power}"
    if data["halted"]:
        yield "halted: rack time is frozen"
    if data["stopped"]:
        code = f" (code {data['stopped_code']})" if data["stopped_code"] else ""
        yield f"stopped at {data['stopped_at_s']:.3f} s{code}: {data['stopped_reason']}"
    yield from data["drive_faults"]
    for module, code, meaning in zip(
        data["display_modules"], data["display_codes"], data["display_meanings"], strict=False
    ):
        yield f"display of {module}: {code or 'blank'}, {meaning}"
    if data["forced"]:
        yield f"forced: {data['forced']}"
    if data["absent"]:
        yield f"did not answer, and is missing above: {', '.join(data['absent'])}"


def message_text(_: ServiceCall, answer: Any) -> str:
    """Return the text for an operation that was carried out."""
    message = getattr(answer, "message", "")
    return f"done, {message}" if message else "done"


def value_text(call: ServiceCall, answer: Any) -> str:
    """Return the text for a value that was written, or that the variable had already."""
    if answer.before and answer.before == answer.now and answer.now == _request_value(call):
        return f"{ALREADY} {call.fields['value'].strip()}"
    return "done"


def reload_text(_: ServiceCall, answer: Any) -> str:
    """Return the text for a reload, with what was lost."""
    return f"done; {answer.lost}: --keep-state keeps what was tuned" if answer.lost else "done"


def _request_value(call: ServiceCall) -> str:
    """Return the value of a request as a program writes it, "" where it is not a value."""
    name, text = "".join(call.fields["name"].split()).partition("(")[0], call.fields["value"]
    value = value_of(text.strip(), type_of_name(name.partition("[")[0].upper()))
    return "" if value is None else source_text(value)
