"""Show what a recording holds: rack, tasks and scans, variables, topics, files, and whether it is sound.

All of it is counted, so the recording is read from its beginning to its end. Exit code 1: it is not sound.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections import Counter
from collections.abc import Mapping, Sequence
from datetime import datetime, timezone
from pathlib import Path
from typing import Any

from automax_ros.cli.output.screen import share_shown
from automax_ros.core.kinds import WriterKind
from automax_ros.core.text import count_of, printable, table
from automax_ros.core.ticks import NS_PER_S
from automax_ros.core.types import DataType
from automax_ros.messages.types.messages import Operation
from automax_ros.recordings.info.info import BagInfo, TaskFacts, bag_info, task_facts

_MOST_ROWS = 100
"""Most rows of a table that are printed; ``--json`` has all of them."""
_MOST_CELL = 60


def lines_of(content: Mapping[str, Any]) -> list[str]:
    """Return the lines that describe a recording."""
    errors = [
        [task["name"], f"line {item['line']}", item["code"], count_of(item["count"], "time")]
        for task in content["tasks"]
        for item in task["errors_by_line"]
    ]
    stored = [[item["name"], _size(item["size"]), f"sha256 {item['sha256']}"] for item in content["attachments"]]
    return [
        *_head(content),
        *_section("tasks", [_TASK_HEAD, *map(_task_row, content["tasks"])] if content["tasks"] else []),
        *_section("errors logged", errors),
        *_section("operations", [_operation_row(item) for item in content["operations"]]),
        *_section("variables", _variable_rows(content["variables"])),
        *_section("writers", _writers(content["writers"])),
        *_section("topics", [_TOPIC_HEAD, *map(_topic, content["topics"])] if content["topics"] else []),
        *_section("files", [_FILE_HEAD, *map(_file, content["files"])]),
        *_section("stored inside", stored),
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


def _task_row(task: Mapping[str, Any]) -> list[str]:
    period = f"{_seconds(task['period_s'] * 1e3)} ms" if task["period_s"] is not None else None
    cells = [task["name"], task["slot"], task["processor"], task["target"], task["ticks"], period, task["scans"]]
    cells += [task["first_scan"], task["last_scan"], task["missing_scans"], task["errors"]]
    if task["restarts"]:
        cells.append(count_of(task["restarts"], "restart"))
    return ["-" if cell is None else str(cell) for cell in cells]


def _operation_row(item: Mapping[str, Any]) -> list[str]:
    done = "" if item["ok"] else "refused"
    why = ": ".join(text for text in (done, item["reason"]) if text)
    return [f"{_seconds(item['at'])} s", item["what"], item["task"] or "-", item["detail"], why]


def _variable_rows(variables: Mapping[str, Any]) -> list[list[str]]:
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


_GAPS = "  a replay continues from the next image of memory and the next state of each task"


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


_WALL_CLOCK_NS = 10**9 * NS_PER_S
"""Earliest wall-clock stamp (September 2001); simulated runs begin at 0."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``automax bag info``."""
    parser.add_argument("bag", type=Path, metavar="BAG", help="a recording: its folder, or its .mcap file")
    parser.add_argument("--json", action="store_true", help="print everything as JSON")
    parser.add_argument(
        "--check",
        action="store_true",
        help="decode every message too, and look whether the write log has gaps or goes back",
    )


def run(arguments: argparse.Namespace) -> int:
    """Read the recording and print its contents."""
    with share_shown("reading") as progress:
        info = bag_info(arguments.bag, check=arguments.check, progress=progress)
    content = as_data(info, task_facts(info), checked=arguments.check)
    if arguments.json:
        json.dump(content, sys.stdout, indent=2)
        print()
    else:
        print("\n".join(lines_of(content)))
    return 1 if info.problems else 0


def as_data(info: BagInfo, facts: dict[str, TaskFacts], *, checked: bool) -> dict[str, Any]:
    """Return the data that ``--json`` prints. Times are in seconds; what the recording does not contain is null."""
    table = info.table
    return {
        "bag": str(info.path),
        "sound": not info.problems,
        "checked": checked,
        "gaps": info.gap_texts,
        "problems": [
            {"code": item.code, "place": item.place, "message": item.message, "hint": item.hint}
            for item in info.problems
        ],
        "rack": table.rack if table else None,
        "run_id": f"{table.run_id:016x}" if table else None,
        "clock": None if table is None else "wall" if table.stamp >= _WALL_CLOCK_NS else "simulated",
        "run_s": [(stamp - table.stamp) / NS_PER_S for stamp in (info.first_stamp, info.last_stamp)] if table else None,
        "stamps_ns": [info.first_stamp, info.last_stamp] if info.messages else [None, None],
        "start": _time_of_day(info.first_stamp),
        "end": _time_of_day(info.last_stamp),
        "duration_s": info.duration_ns / NS_PER_S,
        "messages": info.messages,
        "scans": info.scans,
        "size": info.size,
        "bytes_per_scan": info.size / info.scans if info.scans else None,
        "compression": info.compression,
        "tasks": [_task(info, name, facts.get(name)) for name in dict.fromkeys([*facts, *info.tasks])],
        "variables": _variables(info),
        "writers": [
            {"id": item.id, "name": item.name, "kind": _writer_word(item.kind), "slot": item.slot}
            for item in (table.writers if table else ())
        ],
        "topics": [
            {
                "name": name,
                "type": topic.type_name,
                "messages": topic.messages,
                "rate_hz": topic.messages * NS_PER_S / info.duration_ns if info.duration_ns else None,
            }
            for name, topic in info.topics.items()
        ],
        "files": [vars(file) for file in info.files],
        "operations": [_operation(info, item) for item in info.operations],
        "attachments": [vars(item) for item in info.attachments],
        "custom_data": info.custom_data,
    }


def _task(info: BagInfo, name: str, facts: TaskFacts | None) -> dict[str, Any]:
    seen = info.tasks.get(name)
    return {
        "name": name,
        "slot": facts.slot if facts else None,
        "processor": facts.processor if facts else None,
        "priority": facts.priority if facts else None,
        "target": facts.target if facts else None,
        "ticks": facts.ticks if facts else None,
        "period_s": facts.period_ns / NS_PER_S if facts and facts.period_ns is not None else None,
        "scans": seen.scans if seen else 0,
        "first_scan": seen.first if seen else None,
        "last_scan": seen.last if seen else None,
        "missing_scans": seen.missing if seen else 0,
        "restarts": seen.restarts if seen else 0,
        "errors": sum(seen.errors.values()) if seen else 0,
        "errors_by_line": [
            {"line": line, "code": f"AMX{code:04d}", "count": count}
            for (line, code), count in sorted(seen.errors.items())
        ]
        if seen
        else [],
    }


def _operation(info: BagInfo, item: Operation) -> dict[str, Any]:
    start = info.table.stamp if info.table else 0
    fields = {"at": (item.stamp - start) / NS_PER_S, "what": item.what, "task": item.task, "ok": item.ok}
    return {**fields, "reason": item.reason, "detail": item.detail}


def _variables(info: BagInfo) -> dict[str, Any]:
    variables = info.table.variables if info.table else ()
    simple = Counter(_type_word(item.type) for item in variables if not item.dimensions)
    arrays = Counter(_type_word(item.type) for item in variables if item.dimensions)
    return {
        "count": len(variables),
        "simple": dict(simple),
        "arrays": dict(arrays),
        "names": [item.name for item in variables],
    }


def _type_word(number: int) -> str:
    try:
        return DataType.numbered(number).word.lower()
    except ValueError:
        return f"kind {number}"


def _writer_word(number: int) -> str:
    try:
        return WriterKind(number).name.lower()
    except ValueError:
        return f"kind {number}"


def _time_of_day(stamp: int) -> str | None:
    if not _WALL_CLOCK_NS <= stamp < 2**31 * NS_PER_S:
        return None
    return datetime.fromtimestamp(stamp // NS_PER_S, timezone.utc).strftime("%Y-%m-%d %H:%M:%S UTC")
