"""Save what is sound of a recording whose writer was killed, whose disk was full, or whose files were cut or damaged.

The recording itself is never changed: what can be saved goes into a new folder, with index, summary and
metadata.yaml, and what was lost is reported. A sound recording is left alone. Exit code 0: the recording is sound, or a
repaired one stands next to it; 1: it is still not sound, for a reason that repair cannot fix; 2: nothing of it can
be used.
"""

from __future__ import annotations

import argparse
import json
from datetime import datetime, timedelta, timezone
from pathlib import Path

from automax_ros.cli.options.values import add_output_argument
from automax_ros.cli.output.screen import ProgressBar
from automax_ros.core.text import count_of, printable
from automax_ros.core.ticks import NS_PER_S
from automax_ros.recordings.repair.repairing import FileReport, RepairReport, repair

_STEPS = 1000
_EARLIEST_WALL_NS = 10**9 * NS_PER_S
"""Earliest wall-clock stamp (September 2001); earlier stamps are simulated time, which begins at 0."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``automax bag repair``."""
    parser.add_argument("bag", type=Path, metavar="BAG", help="a recording: its folder, or its .mcap file")
    add_output_argument(parser, "NEW", "folder of the repaired recording (default: BAG_repaired)")
    parser.add_argument("--json", action="store_true", help="print what was found as JSON")


def run(arguments: argparse.Namespace) -> int:
    """Repair the recording and print what was lost."""
    with ProgressBar("repairing", _STEPS) as bar:
        report = repair(arguments.bag, arguments.output, lambda share: bar.show(round(share * _STEPS)))
    print(json.dumps(_data(report), indent=2) if arguments.json else _text(report))
    return 0 if report.left is None else 1


def _text(report: RepairReport) -> str:
    bag = printable(str(report.bag))
    lines = []
    if report.sound:
        lines.append(f"{bag}: nothing to repair: {_contents(report)}")
    else:
        lines += [line for file in report.files for line in _file_lines(file)]
        lines += [f"{bag}: {printable(text)}" for text in report.problems]
        lines.append(f"kept: {_contents(report)}")
    if report.left is not None:
        lines.append(f"still not sound, and repair cannot fix it: {printable(str(report.left))}")
    if report.output is not None:
        lines.append(f"{'copied' if report.sound else 'repaired'}: {printable(str(report.output))}")
    return "\n".join(lines)


def _contents(report: RepairReport) -> str:
    messages = sum(file.contents.messages for file in report.files)
    scans = sum(file.contents.scans for file in report.files)
    wall = _wall_time(report)
    return (
        f"{count_of(messages, 'message')}, {count_of(scans, 'scan')}, to {_rack_time(report):.6f} s of rack time"
        f"{f' ({wall})' if wall else ''}"
    )


def _file_lines(file: FileReport) -> list[str]:
    name = printable(file.name)
    if file.sound:
        return [f"{name}: sound, {count_of(file.contents.messages, 'message')}"]
    lines = [f"{name}: {printable(text)}" for text in file.damage]
    lines.append(
        f"{name}: {file.lost_bytes} of {count_of(file.size, 'byte')} belong to no complete record, "
        f"{count_of(file.lost_chunks, 'chunk')} cut or damaged; "
        f"{count_of(file.dropped_messages, 'message')} dropped as half-present, malformed or without definition, "
        f"{file.dropped_scans} of them {'a scan' if file.dropped_scans == 1 else 'scans'}"
    )
    if not file.usable:
        lines.append(f"{name}: nothing in it can be used, it is left out")
    return lines


def _rack_time(report: RepairReport) -> float:
    return max(0, report.last_stamp - report.run_start) / NS_PER_S


def _wall_time(report: RepairReport) -> str:
    """Return the time of day of the last message in UTC; empty in simulated time."""
    if not _EARLIEST_WALL_NS <= report.last_stamp < 10 * _EARLIEST_WALL_NS:
        return ""
    moment = datetime(1970, 1, 1, tzinfo=timezone.utc) + timedelta(microseconds=report.last_stamp // 1000)
    return f"{moment:%Y-%m-%d %H:%M:%S.%f} UTC"


def _data(report: RepairReport) -> dict[str, object]:
    return {
        "bag": str(report.bag),
        "sound": report.sound and report.left is None,
        "left": None if report.left is None else {"code": report.left.code, "message": report.left.message},
        "output": str(report.output) if report.output is not None else None,
        "messages": sum(file.contents.messages for file in report.files),
        "scans": sum(file.contents.scans for file in report.files),
        "rack_time_s": _rack_time(report),
        "wall_time": _wall_time(report) or None,
        "problems": report.problems,
        "files": [
            {
                "name": file.name,
                "bytes": file.size,
                "sound": file.sound,
                "damage": file.damage,
                "messages": file.contents.messages,
                "scans": file.contents.scans,
                "lost_bytes": file.lost_bytes,
                "lost_chunks": file.lost_chunks,
                "dropped_messages": file.dropped_messages,
                "dropped_scans": file.dropped_scans,
            }
            for file in report.files
        ],
    }
