"""Show what a recording holds: rack, tasks and scans, variables, topics, files, and whether it is sound.

All of it is counted, so the recording is read from its beginning to its end. Exit code 1: it is not sound.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections import Counter
from datetime import datetime, timezone
from pathlib import Path
from typing import Any

from automax_ros.cli.output.screen import share_shown
from automax_ros.cli.recordings.bag_info_text import lines_of
from automax_ros.core.kinds import WriterKind
from automax_ros.core.ticks import NS_PER_S
from automax_ros.core.types import DataType
from automax_ros.messages.types.messages import Operation
from automax_ros.recordings.info.info import BagInfo, TaskFacts, bag_info, task_facts

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
    told = {"at": (item.stamp - start) / NS_PER_S, "what": item.what, "task": item.task, "ok": item.ok}
    return {**told, "reason": item.reason, "detail": item.detail}


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
