"""Make task sources of an old plant acceptable, and show what changes; files are written only when told.

CR LF and CR, Ctrl-Z and what follows it, control characters, tabs, lower case, REAL constants of blocks without a
decimal point, lengths of strings above 255, UTF-16; an include file (.INC) next to a task is written into it in place
of its INCLUDE. Line numbers stay. Exit code 1: `automax check` finds errors in what came out.
"""

from __future__ import annotations

import argparse
import difflib
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path

from automax_ros.cli.options.task import TaskTarget, add_target_arguments, check_text, require_task, target_of
from automax_ros.cli.output.files import write_whole
from automax_ros.core.diagnostics import has_errors
from automax_ros.core.text import count_of, printable
from automax_ros.core.user_error import UsageError
from automax_ros.rackfile.old_plants.includes import include_files, include_reader
from automax_ros.rackfile.old_plants.sources import Converted, convert
from automax_ros.rackfile.reading.files import FileFault, read_bytes

KEPT_SUFFIX = ".orig"
"""Suffix that --write appends to the name of the old file."""
_NOTHING_AFTER = "nothing after this file was written"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``automax convert``."""
    parser.add_argument("files", nargs="+", type=Path, metavar="FILE", help="a task of an old plant")
    where = parser.add_mutually_exclusive_group()
    where.add_argument(
        "--write", action="store_true", help=f"write over the files; the old ones stay as FILE{KEPT_SUFFIX}"
    )
    where.add_argument(
        "--output", "-o", type=Path, metavar="DIR", help="write the converted files into this folder, made if need be"
    )
    add_target_arguments(parser)


def run(arguments: argparse.Namespace) -> int:
    """Convert all files, print the changes, and write the files if requested."""
    target = target_of(arguments)
    places = _places(arguments.files, arguments.output)
    includes = {folder: include_files(folder) for folder in {path.parent for path in arguments.files}}
    converted = [(path, _convert(path, target, includes[path.parent])) for path in arguments.files]
    wrong = 0
    for path, result in converted:
        print("\n".join(_difference(path, result)), end="\n" if result.before != result.after else "")
        print(f"{path}: {', '.join(result.notes) or 'nothing to change'}", file=sys.stderr)
        for reason in result.refused:
            print(f"{path}: {reason}", file=sys.stderr)
        if has_errors(check_text(path, result.after, target).diagnostics):
            print(f"{path}: `automax check` finds errors in what came out", file=sys.stderr)
            wrong += 1
    for path, result in converted:
        if arguments.write and result.changed:
            write_whole(path.with_name(path.name + KEPT_SUFFIX), read_bytes(path), over=False, hint=_NOTHING_AFTER)
            write_whole(path, result.data, over=True, hint=_NOTHING_AFTER)
        elif arguments.output is not None:
            _make(arguments.output)
            write_whole(places[path], result.data, over=False, hint=_NOTHING_AFTER)
    changed = sum(result.changed for _, result in converted)
    if changed and not arguments.write and arguments.output is None:
        hint = "--write or --output DIR"
        print(f"nothing was written; {hint} writes the {count_of(changed, 'converted file')}", file=sys.stderr)
    return 1 if wrong else 0


def _places(files: list[Path], folder: Path | None) -> dict[Path, Path]:
    """Return where each converted file is written."""
    if folder is None:
        return {}
    if folder.exists() and not folder.is_dir():
        raise UsageError(f"{folder} is not a folder", "name another one")
    places: dict[Path, Path] = {}
    for path in files:
        place = folder / path.name
        if place in places.values():
            raise UsageError(f"two files are named {path.name}", "convert them into separate folders")
        if place.exists() or place.is_symlink():
            raise UsageError(f"{place} exists already", "name another folder, or remove the file")
        places[path] = place
    return places


def _convert(path: Path, target: TaskTarget, includes: Mapping[str, Path]) -> Converted:
    require_task(path)
    try:
        data = read_bytes(path)
    except FileFault as fault:
        raise UsageError(f"{path} {fault}") from fault
    return convert(data, lambda text: check_text(path, text, target).diagnostics, include_reader(includes))


def _difference(path: Path, result: Converted) -> Iterator[str]:
    """Yield a unified diff; unprintable characters are shown by their codes."""
    names = (str(path), f"{path} (converted)")
    before, after = (text.split("\n") for text in (result.before, result.after))
    for line in difflib.unified_diff(before, after, *names, lineterm=""):
        yield printable(line)


def _make(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UsageError(f"{folder} cannot be made: {error.strerror or error}") from error
