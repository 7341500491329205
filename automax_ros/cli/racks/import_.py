"""Make a rack file (.yaml) from a plant's disks: the folder of an Executive 3.x or 4.x, or a configuration task (.CNF).

FOLDER is a rack's folder, its system's, or the whole library, as copied from the disk: its databases ($CARD.DBF and so
on) are read, and the tasks are converted and written next to the rack file. What is guessed, damaged or left out is
told; --headers shows first what the databases hold, without names of the plant.

RACK.CNF is the configuration task of Executive 2.1 or earlier: IODEF, MEMDEF, NVMEMDEF, RIODEF, NETDEF, GBLDEF,
RNETDEF, ABDEF, MODDEF and TASK are read; other lines are reported with their numbers, and the exit code is 1. No line
of it says which module stands in a slot of I/O points: --module says it, otherwise they become plain common variables
and the rack file proposes modules.
"""

from __future__ import annotations

import argparse
import re
import sys
from pathlib import Path

from automax_ros.cli.options.values import add_output_argument, each_once
from automax_ros.cli.output.files import write_whole
from automax_ros.cli.output.screen import print_diagnostics
from automax_ros.cli.racks.import_folder import add_folder_arguments, import_folder, refuse_folder_options
from automax_ros.cli.racks.new import require_free
from automax_ros.core.diagnostics import SourceText, has_errors
from automax_ros.core.text import count_of, quoted
from automax_ros.core.user_error import UsageError
from automax_ros.language.tree.task_kind import TASK_SUFFIXES
from automax_ros.rackfile.loader import load_stored
from automax_ros.rackfile.model.config import MAX_SLOT
from automax_ros.rackfile.modules.registry import SUPPORTED, module_number
from automax_ros.rackfile.old_plants.configuration_task import read_configuration
from automax_ros.rackfile.old_plants.import_ import rack_file_of
from automax_ros.rackfile.reading.files import FileFault, read_task_source

_MODULE = re.compile(r"([0-9]{1,2})=(.{1,20})")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``automax import``."""
    parser.add_argument("file", type=Path, metavar="FOLDER|RACK.CNF", help="a disk's folder, or a configuration task")
    add_output_argument(parser, "RACK.yaml", "where to write (default: the standard output)")
    parser.add_argument(
        "--module",
        action="append",
        default=[],
        metavar="SLOT=NUMBER",
        dest="modules",
        help="the module in a slot, such as 5=57C419; may be given again",
    )
    parser.add_argument("--force", action="store_true", help="write over a rack file, and tasks, that are there")
    add_folder_arguments(parser)


def run(arguments: argparse.Namespace) -> int:
    """Write the rack file; 1 where lines could not be read, or `automax check` would find errors in it."""
    modules = each_once("--module", map(_module, arguments.modules))
    if arguments.file.is_dir():
        return import_folder(arguments, modules)
    refuse_folder_options(arguments)
    if arguments.output is not None:
        require_free(arguments.output, force=arguments.force)
    source = _source(arguments.file)
    found = read_configuration(source)
    imported = rack_file_of(found, arguments.file.stem, arguments.file.resolve().parent, modules, TASK_SUFFIXES)
    print_diagnostics([*found.diagnostics, *imported.diagnostics], source, sys.stderr)
    if arguments.output is None:
        sys.stdout.write(imported.text)
    else:
        write_whole(arguments.output, imported.text.encode(), over=arguments.force)
        counts = ((len(found.tasks), "task"), (len(found.commons), "common"))
        print(f"wrote {arguments.output}: {', '.join(count_of(number, thing) for number, thing in counts)}")
    name = str(arguments.output or "the rack file")
    made = load_stored(SourceText(name, imported.text), arguments.output or Path("rack.yaml"))
    print_diagnostics(made.diagnostics, made.source, sys.stderr)
    return 1 if has_errors(found.diagnostics) or has_errors(made.diagnostics) else 0


def _module(text: str) -> tuple[int, str]:
    match = _MODULE.fullmatch(text)
    if match is None or int(match[1]) > MAX_SLOT:
        raise UsageError(f"--module {quoted(text)} is not a slot and a module", "for example --module 5=57C419")
    number = module_number(match[2])
    if number not in SUPPORTED:
        raise UsageError(f"--module {quoted(text)}: the emulator has no such module", f"it has {', '.join(SUPPORTED)}")
    return int(match[1]), number


def _source(path: Path) -> SourceText:
    if path.suffix.upper() != ".CNF":
        raise UsageError(f"{path} is not a configuration task, which is a .CNF file, nor the folder of a disk")
    try:
        return read_task_source(path)
    except FileFault as fault:
        raise UsageError(f"{path} {fault}") from fault
