"""Check tasks (.BLK, .BAS) and rack files (.yaml, .yml) and print everything that is wrong with them.

A task given by itself is checked as if the rack defined its commons as it declares them. A rack file is checked with
every task it names, against the commons and the ticks it defines.
"""

from __future__ import annotations

import argparse
import dataclasses
import json
import re
import sys
from dataclasses import dataclass
from pathlib import Path

from automax_ros.blocks.declare.declaration import Platform
from automax_ros.cli.options.task import (
    TaskTarget,
    add_target_arguments,
    check_task_file,
    is_rack_file,
    name_warning,
    target_of,
)
from automax_ros.cli.output.screen import print_diagnostics
from automax_ros.core.diagnostics import Diagnostic, SourceText, Span, as_json, has_errors, in_order
from automax_ros.core.problems import Severity
from automax_ros.core.text import count_of, printable
from automax_ros.core.user_error import UsageError

_OF_OLD_PLANTS = ("AMX0003", "AMX0006", "AMX0021", "AMX2016", "AMX4008")
"""The problems that `automax convert` corrects."""
_LINE_NUMBER = re.compile(r"\s*([0-9]{1,6})")


@dataclass(frozen=True)
class _Findings:
    """The findings in one text.

    ``unconfirmed`` are the places of forms that no source confirms, ``size`` lists what a rack consists of. A text that
    is not ``usable`` counts as unreadable, although it has diagnostics to show.
    """

    source: SourceText
    diagnostics: list[Diagnostic]
    unconfirmed: list[tuple[Span, str]]
    size: str = ""
    usable: bool = True


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``automax check``."""
    parser.add_argument(
        "files", nargs="+", type=Path, metavar="FILE", help="a task (.BLK, .BAS) or a rack file (.yaml, .yml)"
    )
    add_target_arguments(parser)
    parser.add_argument(
        "--allow-outside", action="store_true", help="let a rack file name task sources outside its own folder"
    )
    parser.add_argument("--json", action="store_true", help="print one list of problems for programs to read")


def run(arguments: argparse.Namespace) -> int:
    """Check all files, also those after one that cannot be read."""
    target = target_of(arguments)
    given = arguments.tick_ms is not None or arguments.target != Platform.AUTOMAX.value
    if given and all(map(is_rack_file, arguments.files)):
        raise UsageError("--target and --tick-ms are for tasks given by themselves", "a rack file has `tick_ms:`")
    findings: list[_Findings] = []
    unusable = 0
    for path in arguments.files:
        try:
            if is_rack_file(path):
                findings += _rack_file(path, allow_outside=arguments.allow_outside)
            else:
                findings += _task_file(path, target)
        except UsageError as error:
            print(f"automax check: error: {error}", file=sys.stderr)
            unusable += 1
    findings = _each_once(findings)
    if arguments.json:
        print(json.dumps([record for item in findings for record in _records(item)], indent=2))
    else:
        _print(findings, len(arguments.files) - unusable)
    diagnostics = [item for one in findings for item in one.diagnostics]
    if unusable or not all(one.usable for one in findings):
        return 2
    return 1 if has_errors(diagnostics) else 0


def _task_file(path: Path, target: TaskTarget) -> list[_Findings]:
    source, result = check_task_file(path, target)
    warning = name_warning(path)
    found = _naming_convert(source, result.diagnostics)
    return [_Findings(source, [*([warning] if warning else []), *found], result.unconfirmed)]


def _naming_convert(source: SourceText, diagnostics: list[Diagnostic]) -> list[Diagnostic]:
    """Return the diagnostics; the first one that is typical of an old plant's source gets `automax convert` as hint."""
    first = next((number for number, item in enumerate(diagnostics) if item.code in _OF_OLD_PLANTS), None)
    if first is None:
        return diagnostics
    item = diagnostics[first]
    command = f"of an old plant? `automax convert {printable(source.name)}` mends the whole file"
    hint = f"{item.hint}; {command}" if item.hint else command
    return [*diagnostics[:first], dataclasses.replace(item, hint=hint), *diagnostics[first + 1 :]]


def _rack_file(path: Path, *, allow_outside: bool) -> list[_Findings]:
    """Return the findings in the rack file, then in each of its tasks."""
    # Imported here, so that checking a task alone does not load the reader of racks.
    from automax_ros.cli.options.rack import is_text, load_rack_file, size_of
    from automax_ros.rackfile.checks.cpu_load import late_loops, loads_of
    from automax_ros.rackfile.checks.tasks import check_tasks, forgotten

    rack = load_rack_file(path, allow_outside=allow_outside)
    tasks = check_tasks(rack.config) if rack.config is not None else []
    whole: list[Diagnostic] = []
    if rack.config is not None:
        whole = [*forgotten(rack.config, tasks), *late_loops(loads_of(rack.config, tasks))]
    return [
        _Findings(
            rack.source,
            [*rack.diagnostics, *whole],
            [],
            size=size_of(rack.config) if rack.config is not None else "",
            usable=is_text(rack),
        ),
        *(
            _Findings(item.source, _naming_convert(item.source, item.result.diagnostics), item.result.unconfirmed)
            for item in tasks
        ),
    ]


def _each_once(findings: list[_Findings]) -> list[_Findings]:
    """Return the findings without duplicates, which a task has if checked alone and in a rack, or twice in a rack."""
    seen: set[tuple[str, Diagnostic | tuple[Span, str]]] = set()

    def new(item: Diagnostic | tuple[Span, str], name: str) -> bool:
        known = (name, item) in seen
        seen.add((name, item))
        return not known

    return [
        dataclasses.replace(
            one,
            diagnostics=[item for item in in_order(one.diagnostics) if new(item, one.source.name)],
            unconfirmed=[item for item in one.unconfirmed if new(item, one.source.name)],
        )
        for one in findings
    ]


def _print(findings: list[_Findings], files: int) -> None:
    for item in findings:
        print_diagnostics(item.diagnostics, item.source, sys.stdout)
    if sys.stdout.isatty():
        severities = [item.severity for one in findings for item in one.diagnostics]
        errors, warnings = severities.count(Severity.ERROR), severities.count(Severity.WARNING)
        counts = [count_of(errors, "error")] * bool(errors) + [count_of(warnings, "warning")] * bool(warnings)
        for one in findings:
            if one.size:
                print(f"{one.source.name}: {one.size}")
        print(", ".join(counts) or f"no problems in {count_of(files, 'file')}")


def _records(findings: _Findings) -> list[dict[str, object]]:
    marked = [
        dataclasses.replace(item, unconfirmed=any(_overlap(item.span, span) for span, _ in findings.unconfirmed))
        for item in findings.diagnostics
    ]
    records = [(item.span, as_json(item, findings.source)) for item in marked]
    lines = findings.source.lines if findings.unconfirmed else []
    records += [(span, _note(span, text, lines, findings.source)) for span, text in findings.unconfirmed]
    return [record for _, record in sorted(records, key=lambda pair: pair[0])]


def _overlap(one: Span, other: Span) -> bool:
    return one.line == other.line and one.column < other.end_column and other.column < one.end_column


def _note(span: Span, text: str, lines: list[str], source: SourceText) -> dict[str, object]:
    """Return the object that marks a form confirmed by no source: it is not a problem and has no code."""
    return {
        "file": source.name,
        **dataclasses.asdict(span),
        "statement": _statement(span.line, lines),
        "severity": "note",
        "code": None,
        "message": f"no source confirms {text}",
        "unconfirmed": True,
    }


def _statement(line: int, lines: list[str]) -> int | None:
    """Return the BASIC line number of a physical line; a line after an ``&`` has that of the line it continues."""
    while line > 1 and lines[line - 2].rstrip().endswith("&"):
        line -= 1
    number = _LINE_NUMBER.match(lines[line - 1])
    return int(number[1]) if number else None
