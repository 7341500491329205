"""The text of ``automax bag info``: tables of the data that ``--json`` prints."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from automax_ros.core.text import count_of, printable, table

_MOST_ROWS = 100
"""Most rows of a table that are printed; ``--json`` has all of them."""
_MOST_CELL = 60


def lines_of(content: Mapping[str, Any]) -> list[str]:
    """Return the lines that describe a recording."""
    return [
        *_head(content),
        *_section("tasks", [_TASK_HEAD, *map(_task, content["tasks"])] if content["tasks"] else []),
        *_section("errors logged", [row for task in content["tasks"] for row in _errors(task)]),
        *_section("operations", [_operation(item) for item in content["operations"]]),
        *_section("variables", _variables(content["variables"])),
        *_section("writers", _writers(content["writers"])),
        *_section("topics", [_TOPIC_HEAD, *map(_topic, content["topics"])] if content["topics"] else []),
        *_section("files", [_FILE_HEAD, *map(_file, content["files"])]),
        *_section("stored inside", [_stored(item) for item in content["attachments"]]),
        *_section("recorded with", [[key, value] for key, value in content["custom_data"].items()]),
        *_verdict(content),
    ]


def _head(content: Mapping[str, Any]) -> list[str]:
    rack = f"rack {_cut(content['rack'])}, run {content['run_id']}" if content["rack"] is not None else "no rack"
    size = _size(content["size"])
    if content["compression"]:
        size += f", chunks compressed {content['compression']:.1f} : 1"
    if content["bytes_per_scan"]:
        size += f", {content['bytes_per_scan']:.0f} bytes per scan"
    return [
        f"{printable(content['bag'])}: {rack}",
        f"  {_when(content)}",
        f"  {count_of(content['messages'], 'message')}, {count_of(content['scans'], 'scan')}, {size}",
    ]


def _when(content: Mapping[str, Any]) -> str:
    duration = f"{_seconds(content['duration_s'])} s"
    if content["start"] and content["end"]:
        duration += f", {content['start']} to {content['end']}"
    if content["run_s"] is None:
        return duration
    first, last = content["run_s"]
    clock = "rack time from 0 (simulated)" if content["clock"] == "simulated" else "rack time on the wall clock"
    return f"{duration}; from {_seconds(first)} to {_seconds(last)} s of the run, {clock}"


_TASK_HEAD = ["task", "slot", "processor", "target", "TICKS", "period", "scans", "first", "last", "missing", "errors"]


def _task(task: Mapping[str, Any]) -> list[str]:
    period = f"{_seconds(task['period_s'] * 1e3)} ms" if task["period_s"] is not None else None
    cells = [task["name"], task["slot"], task["processor"], task["target"], task["ticks"], period, task["scans"]]
    cells += [task["first_scan"], task["last_scan"], task["missing_scans"], task["errors"]]
    if task["restarts"]:
        cells.append(count_of(task["restarts"], "restart"))
    return ["-" if cell is None else str(cell) for cell in cells]


def _errors(task: Mapping[str, Any]) -> list[list[str]]:
    return [
        [task["name"], f"line {item['line']}", item["code"], count_of(item["count"], "time")]
        for item in task["errors_by_line"]
    ]


def _operation(item: Mapping[str, Any]) -> list[str]:
    done = "" if item["ok"] else "refused"
    why = ": ".join(text for text in (done, item["reason"]) if text)
    return [f"{_seconds(item['at'])} s", item["what"], item["task"] or "-", item["detail"], why]


def _variables(variables: Mapping[str, Any]) -> list[list[str]]:
    if not variables["count"]:
        return []
    parts = [count_of(count, word) for word, count in variables["simple"].items()]
    parts += [f"{count_of(count, 'array')} of {word}s" for word, count in variables["arrays"].items()]
    return [[f"{variables['count']}:", ", ".join(parts)]]


def _writers(writers: Sequence[Mapping[str, Any]]) -> list[list[str]]:
    kinds: dict[str, list[str]] = {}
    for item in writers[:_MOST_ROWS]:
        kinds.setdefault(item["kind"], []).append(_cut(item["name"]))
    return [[kind, ", ".join(names)] for kind, names in kinds.items()]


_TOPIC_HEAD = ["name", "type", "messages", "a second"]


def _topic(topic: Mapping[str, Any]) -> list[str]:
    rate = topic["rate_hz"]
    return [topic["name"], topic["type"], str(topic["messages"]), "-" if rate is None else f"{rate:.2f}"]


_FILE_HEAD = ["name", "size", "chunks", "stored", "unpacked"]


def _file(file: Mapping[str, Any]) -> list[str]:
    sizes = [_size(file[key]) for key in ("stored_bytes", "unpacked_bytes")]
    return [file["name"], _size(file["size"]), str(file["chunks"]), *sizes]


def _stored(item: Mapping[str, Any]) -> list[str]:
    return [item["name"], _size(item["size"]), f"sha256 {item['sha256']}"]


def _verdict(content: Mapping[str, Any]) -> list[str]:
    if content["sound"]:
        how = "every message decoded" if content["checked"] else "all checksums are right"
        gaps = [printable(gap) for gap in content["gaps"]]
        if gaps:
            return ["", f"sound, with gaps: {how}", *(f"  {gap}" for gap in gaps[:_MOST_ROWS]), _GAPS]
        return ["", f"sound: {how}{', no gap in the write log' if content['checked'] else ''}"]
    lines = ["", "not sound; what is counted above is readable:"]
    hints: dict[str, None] = {}
    for problem in content["problems"]:
        lines.append(f"  {problem['place']}: error[{problem['code']}]: {problem['message']}")
        hints[problem["hint"]] = None
    return [*lines, *(f"  hint: {hint}" for hint in hints if hint)]


_GAPS = "  a replay goes on from the next image of memory and the next state of each task"


def _section(title: str, rows: Sequence[Sequence[str]]) -> list[str]:
    """Return a table under a title, its columns aligned; nothing without rows."""
    if not rows:
        return []
    shown = [[_cut(cell, _MOST_CELL + 40) for cell in row] for row in rows[: _MOST_ROWS + 1]]
    lines = ["", title, *(f"  {line}" for line in table(shown))]
    if len(rows) > len(shown):
        lines.append(f"  and {len(rows) - len(shown)} more, see --json")
    return lines


def _cut(text: str, most: int = _MOST_CELL) -> str:
    text = printable(text)
    return text if len(text) <= most else f"{text[: most - 3]}..."


def _seconds(value: float) -> str:
    return f"{value:.6f}".rstrip("0").rstrip(".")


def _size(count: int) -> str:
    value, units = float(count), ["bytes", "KiB", "MiB", "GiB", "TiB"]
    while value >= 1024 and len(units) > 1:
        value /= 1024
        units.pop(0)
    return f"{count} bytes" if units[0] == "bytes" else f"{value:.1f} {units[0]}"
