"""Estimate how much of each module's time its tasks take, by the manual's tables of execution times (section 53).

Of every task the least and the most time of a scan over all ways through it, and the share of its period; of every
module the sum, and of a UDC the fewest TICKS that its tasks fit in. Exit code 1: a UDC's tasks fit in no TICKS, or a
task has errors.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path

from automax_ros.cli.options.rack import add_outside_argument, load_rack_file
from automax_ros.cli.output.screen import print_diagnostics
from automax_ros.core.diagnostics import has_errors
from automax_ros.core.text import count_of, table
from automax_ros.core.ticks import NS_PER_MS, NS_PER_US
from automax_ros.rackfile.checks.cpu_load import ModuleLoad, TaskLoad, faults, loads_of
from automax_ros.rackfile.checks.tasks import check_tasks


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``automax load``."""
    parser.add_argument("config", type=Path, metavar="CONFIG", help="the rack's YAML file, or its folder")
    add_outside_argument(parser)
    parser.add_argument("--json", action="store_true", help="print one list of modules for programs to read")


def run(arguments: argparse.Namespace) -> int:
    """Print the loads; errors are printed on standard error."""
    rack = load_rack_file(arguments.config, allow_outside=arguments.allow_outside)
    if rack.config is None:
        print_diagnostics(rack.diagnostics, rack.source, sys.stderr)
        return 1
    checked = check_tasks(rack.config)
    wrong = False
    for item in checked:
        if has_errors(item.result.diagnostics):
            print_diagnostics(item.result.diagnostics, item.source, sys.stderr)
            wrong = True
    loads = loads_of(rack.config, checked)
    found = faults(rack.config, loads)
    if arguments.json:
        print(json.dumps([_record(load) for load in loads], indent=2))
    else:
        print("\n".join(_text(loads)))
    print_diagnostics(found, rack.source, sys.stderr)
    return 1 if wrong or has_errors(found) else 0


def _record(load: ModuleLoad) -> dict[str, object]:
    ticks = {} if load.least_ticks is None else {"least_ticks": load.least_ticks}
    return {
        "module": load.module.name,
        "model": load.word,
        "tick_ms": load.module.tick_ns / NS_PER_MS,
        "load_percent": round(load.percent, 2),
        **ticks,
        "tasks": [_task_record(task) for task in load.tasks],
    }


def _task_record(task: TaskLoad) -> dict[str, object]:
    return {
        "task": task.task,
        "scan_us": {"least": task.times.least_ns / NS_PER_US, "most": task.times.most_ns / NS_PER_US},
        "period_us": None if task.period_ns is None else task.period_ns / NS_PER_US,
        "load_percent": None if task.percent is None else round(task.percent, 2),
        "estimated": task.times.estimated,
        **({"accesses_57c406": {str(slot): count for slot, count in task.accesses.items()}} if task.accesses else {}),
    }


def _text(loads: Sequence[ModuleLoad]) -> list[str]:
    lines: list[str] = []
    for load in loads:
        ticks = "" if load.least_ticks is None else f", at least {load.least_ticks} TICKS"
        head = f"{load.module.name} ({load.word}, tick {load.module.tick_ns / NS_PER_MS:g} ms)"
        lines += [*([""] if lines else []), f"{head}: {load.percent:.2f} %{ticks}"]
        if load.tasks:
            header = ("  task", "least us", "most us", "period us", "load %", "")
            lines += table([header, *map(_row, load.tasks)], right=range(1, 5))
    for task in (task for load in loads for task in load.tasks):
        for slot, count in task.accesses.items():
            what = f"{task.task} latches {count_of(count, 'register')} of the 57C406 in slot {slot} each scan"
            lines += ["", f"{what}: {task.delay_percent(slot):.2f} % of the time of its microprocessor (52.7)"]
    if any(task.times.estimated for load in loads for task in load.tasks):
        lines += ["", "estimated: BASIC statements or a drive's loop are in the sum, whose times no manual prints"]
    return lines


def _row(task: TaskLoad) -> tuple[str, ...]:
    period = "-" if task.period_ns is None else f"{task.period_ns / NS_PER_US:.0f}"
    percent = "-" if task.percent is None else f"{task.percent:.2f}"
    times = (f"{task.times.least_ns / NS_PER_US:.2f}", f"{task.times.most_ns / NS_PER_US:.2f}")
    return (f"  {task.task}", *times, period, percent, "estimated" if task.times.estimated else "")
