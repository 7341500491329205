"""Print who writes and who reads each common of a rack: the cross reference.

Of each common: type, place (slot, register or drop, bit; or common memory), what ROS 2 may do with it, its description,
and the BASIC lines of each task that use it, marked * where they write it. Plants and webs that feed it, joints that
command it and modules that show the process in it are writers too. NAME is a common, with or without its type
character, or a pattern such as '*SPD*'. Lines that reach a register by its slot and number (IOREAD%, IOWRITE) have no
name to be found under.

Forces are those of the state that the rack has kept (next to the rack file, or in --state DIR): the rack file has none.
--html writes the same as a page of its own. The exit code is 1 if the rack file or a task has errors.
"""

from __future__ import annotations

import argparse
import json
import re
import sys
from collections.abc import Mapping, Sequence
from fnmatch import fnmatchcase
from pathlib import Path

from automax_ros.cli.options.rack import add_outside_argument, load_rack_file
from automax_ros.cli.output.files import require_different_files, require_writable, write_text
from automax_ros.cli.output.screen import print_diagnostics
from automax_ros.core.diagnostics import SourceText, has_errors
from automax_ros.core.names import last_element_name
from automax_ros.core.text import count_of, near_or_listed, printable, quoted
from automax_ros.core.ticks import NS_PER_MS
from automax_ros.core.types import Value, bare_name
from automax_ros.core.user_error import UsageError
from automax_ros.core.values import value_text
from automax_ros.rack.operator.retention import default_folder, kept_forces
from automax_ros.rackfile.checks.cross_reference import CommonUse, TaskUse, cross_reference
from automax_ros.rackfile.checks.tasks import check_tasks
from automax_ros.rackfile.model.config import RackConfig
from automax_ros.rackfile.model.module import TaskConfig

WRITES = "*"
"""Marks a line that writes, as in the cross reference of the Programming Executive."""
_ONLY_DECLARED = "declares it only"
_HEAD = ("common", "type", "place", "ROS 2", "description", "written by", "read by", "remarks")
_PATTERN = re.compile(r"[*?\[\]!]+")
"""What in a pattern stands for other characters; ! is a type character as well."""
_SHOWN = 8
"""Most commons that a hint names."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``automax xref``."""
    parser.add_argument("config", type=Path, metavar="CONFIG", help="the rack's YAML file, or its folder")
    parser.add_argument("name", nargs="?", metavar="NAME", help="a common, or a pattern: '*SPD*' (default: all)")
    add_outside_argument(parser)
    state = "the folder with the state that the rack has kept (default: .automax next to the rack file)"
    parser.add_argument("--state", type=Path, metavar="DIR", help=state)
    parser.add_argument("--json", action="store_true", help="print one list of commons for programs to read")
    parser.add_argument("--html", type=Path, metavar="FILE", help="write it as a page of its own")


def run(arguments: argparse.Namespace) -> int:
    """Print the cross reference; errors of rack file and tasks are printed on standard error."""
    html: Path | None = arguments.html
    if html is not None:
        require_different_files({"CONFIG": arguments.config}, {"--html": html})
        require_writable(html)
    rack = load_rack_file(arguments.config, allow_outside=arguments.allow_outside)
    if rack.config is None:
        print_diagnostics(rack.diagnostics, rack.source, sys.stderr)
        return 1
    checked = check_tasks(rack.config)
    wrong = [item for item in checked if has_errors(item.result.diagnostics)]
    for item in wrong:
        print_diagnostics(item.result.diagnostics, item.source, sys.stderr)
    programs = [item.result.program for item in checked if item.result.program is not None]
    found = _named(arguments.name, cross_reference(rack.config, programs))
    forced = kept_forces(rack.config, arguments.state or default_folder(rack.config))
    lacks = [_lacking(item.task, item.source) for item in wrong]
    if html is not None:
        write_text(html, _page(rack.config, found, arguments.name, forced, lacks))
    if arguments.json:
        print(json.dumps([_record(item, forced) for item in found], indent=2, ensure_ascii=False))
    elif html is None:
        print("\n".join([*lacks, *(line for item in found for line in _text(item, forced))]))
    if html is not None or arguments.json:
        print("\n".join(lacks), end="\n" if lacks else "", file=sys.stderr)
    return 1 if wrong else 0


def _lacking(task: TaskConfig, source: SourceText) -> str:
    """Return that a task is left out, for all that is printed of the others would be taken for the whole."""
    return f"without task {task.name} ({printable(source.name)}), which has errors: it may write and read more"


def _named(asked: str | None, everything: list[CommonUse]) -> list[CommonUse]:
    """Return the commons that a name or a pattern means, all without one.

    Raises:
        UsageError: it means none.
    """
    if asked is None:
        return everything
    name = "".join(asked.split()).upper()
    for means in (lambda item: item.name == name, lambda item: bare_name(item.name) == name,
                  lambda item: fnmatchcase(item.name, name)):  # fmt: skip
        found = [item for item in everything if means(item)]
        if found:
            return found
    names = [item.name for item in everything]
    if not set(name) & set("*?["):
        raise UsageError(f"the rack has no common variable {quoted(asked)}", near_or_listed(name, names))
    raise UsageError(f"no common variable of the rack fits the pattern {quoted(asked)}", _pattern_hint(name, names))


def _pattern_hint(pattern: str, names: Sequence[str]) -> str:
    """Return the pattern that finds the longest part of one anywhere, with what it finds; else how to see all names."""
    part = max(_PATTERN.split(pattern), key=len)
    found = [name for name in names if part in name] if part else []
    if not found:
        return f"without a name all {count_of(len(names), 'common')} are printed"
    more = f" and {len(found) - _SHOWN} more" if len(found) > _SHOWN else ""
    return f"{quoted(f'*{part}*')} finds {', '.join(found[:_SHOWN])}{more}"


def _outside(item: CommonUse) -> list[tuple[str, str]]:
    """Return the writers that are not tasks: what each is, and what it writes."""
    found = [("rack", "writes it itself")] if item.by_rack else []
    found += [(item.input_of, "input")] if item.input_of else []
    found += [(feed.owner, f"{feed.signal} every {feed.every_ns / NS_PER_MS:g} ms") for feed in item.feeds]
    found += [(f"joint {command.joint}", f"{command.interface} command") for command in item.commands]
    found += [("ROS 2", "ros: in")] if item.from_ros else []
    return found


def _type(item: CommonUse) -> str:
    variable = item.variable
    length = f":{variable.length}" if variable.length else ""
    size = f" {last_element_name(variable).removeprefix(variable.name)}" if variable.is_array else ""
    return f"{variable.type.word}{length}{size}"


def _description(item: CommonUse) -> str:
    variable = item.variable
    unit = f" [{variable.unit}]" if variable.unit else ""
    return printable(f"{variable.description}{unit}".strip())


def _text(item: CommonUse, forced: Mapping[str, Value]) -> list[str]:
    lines = [f"{item.name}  {_type(item)}, {item.place}, ros: {item.variable.direction.name.lower()}"]
    if description := _description(item):
        lines.append(f"    {description}")
    lines += [f"    {what} {WRITES} {how}" for what, how in _outside(item)]
    lines += [f"    {use.task} ({printable(use.file)})  {_marked(use)}" for use in item.tasks]
    return lines + [f"    {remark}" for remark in _remarks(item, forced)]


def _remarks(item: CommonUse, forced: Mapping[str, Value]) -> list[str]:
    """Return what is to be said of a common apart from who uses it."""
    found = [] if item.tasks else ["no task declares it"]
    found += [f"forced to {value_text(forced[item.name])}"] if item.name in forced else []
    return found + (["meant so"] if item.meant_so else [])


def _marked(use: TaskUse) -> str:
    """Return the lines of a task in their order, those that write marked; a line may do both."""
    numbers = sorted({*use.writes, *use.reads})
    if not numbers:
        return _ONLY_DECLARED
    return "  ".join(f"{number}{WRITES if number in use.writes else ''}" for number in numbers)


def _record(item: CommonUse, forced: Mapping[str, Value]) -> dict[str, object]:
    variable, point = item.variable, item.variable.point
    place = None if point is None else {"slot": point.slot, "register": point.register, "bit": point.bit}
    return {
        "name": item.name,
        "type": variable.type.word,
        "dimensions": list(variable.dimensions),
        "length": variable.length or None,
        "line": variable.line,
        "place": place,
        "place_text": item.place,
        "ros": variable.direction.name.lower(),
        "unit": variable.unit,
        "description": variable.description,
        "writers": [_users(use, use.writes) for use in item.writers],
        "readers": [_users(use, use.reads) for use in item.readers],
        "declared": [use.task for use in item.tasks],
        "feeds": [
            {
                "web" if feed.is_of_web else "plant": feed.plant,
                "signal": feed.signal,
                "element": feed.element,
                "every_ms": feed.every_ns / NS_PER_MS,
            }
            for feed in item.feeds
        ],
        "joints": [
            {"plant": command.plant, "joint": command.joint, "interface": command.interface}
            for command in item.commands
        ],
        "input_of": item.input_of or None,
        "by_rack": item.by_rack,
        "forced": forced.get(item.name),
        "meant_so": item.meant_so,
    }


def _users(use: TaskUse, lines: Sequence[int]) -> dict[str, object]:
    return {"task": use.task, "file": use.file, "module": use.module, "lines": list(lines)}


def _page(
    config: RackConfig,
    found: Sequence[CommonUse],
    asked: str | None,
    forced: Mapping[str, Value],
    lacks: Sequence[str],
) -> str:
    from automax_ros.cli.output.html_page import document, plain, rows

    cells = [
        (
            item.name,
            _type(item),
            item.place,
            item.variable.direction.name.lower(),
            _description(item),
            "; ".join([*(f"{what}: {how}" for what, how in _outside(item)), *_told(item.writers, writes=True)]),
            "; ".join(_told(item.readers, writes=False)),
            "; ".join([*_idle(item.tasks), *_remarks(item, forced)]),
        )
        for item in found
    ]
    of = f"commons like {asked}" if asked else "all commons"
    subtitle = f"{count_of(len(found), 'common')} ({of}) of {config.path.name}: who writes, who reads, by BASIC lines"
    notes = [f'<p class="note">{plain(text)}</p>' for text in lacks]
    table = rows(_HEAD, cells, numbers=(), most=len(cells))
    return document(f"{config.name}: cross reference", subtitle, [*notes, *table])


def _idle(uses: Sequence[TaskUse]) -> list[str]:
    return [f"{use.task} {_ONLY_DECLARED}" for use in uses if not use.writes and not use.reads]


def _told(uses: Sequence[TaskUse], *, writes: bool) -> list[str]:
    return [f"{use.task} {', '.join(map(str, use.writes if writes else use.reads))}" for use in uses]
