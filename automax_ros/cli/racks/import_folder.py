"""`automax import FOLDER`: the databases of a Programming Executive 3.x or 4.x; the command itself is in import_.py."""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

from automax_ros.cli.options.values import each_once, naming
from automax_ros.cli.output.files import write_whole
from automax_ros.cli.output.screen import painted, print_diagnostics, wants_colour
from automax_ros.cli.racks.new import require_free
from automax_ros.cli.visible import write_control
from automax_ros.core.diagnostics import SourceText, has_errors
from automax_ros.core.problems import Severity
from automax_ros.core.text import count_of, quoted
from automax_ros.core.user_error import UsageError
from automax_ros.rackfile.modules.registry import SUPPORTED, module_number
from automax_ros.rackfile.old_plants.executive.dbase import CODE_PAGES
from automax_ros.rackfile.old_plants.executive.fields import FieldChoice, field_choice
from automax_ros.rackfile.old_plants.executive.findings import Findings
from automax_ros.rackfile.old_plants.executive.folders import chosen_rack, racks_in
from automax_ros.rackfile.old_plants.executive.headers import headers_of
from automax_ros.rackfile.old_plants.executive.importing import Choices, ImportedRack, import_rack
from automax_ros.rackfile.old_plants.executive.parts import number_known
from automax_ros.rackfile.reading.executive import NEWEST, version_text

_PART = re.compile(r"([0-9]{1,5})=(.{1,20})")
_DRIVE = re.compile(r"(.{1,20})=([ABab])")
_VERSION = re.compile(r"([34])\.([0-9])")
_FIRST = 30
"""The first Executive with databases, in tenths."""
_COLOURS = {Severity.ERROR: "1;31", Severity.WARNING: "1;33"}


def add_folder_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the options that only folders have."""
    group = parser.add_argument_group("of a folder")
    group.add_argument("--headers", action="store_true", help="only show the tables' fields and counts of values")
    group.add_argument("--rack", metavar="NAME", help="the rack of a folder with several: WIND1 or MILL/WIND1")
    group.add_argument(
        "--part",
        action="append",
        default=[],
        metavar="CODE=NUMBER",
        dest="parts",
        help="the module of a part code, such as 17=57C435; may be given again",
    )
    group.add_argument(
        "--field",
        action="append",
        default=[],
        metavar="KEY=FIELD",
        dest="fields",
        help="the field of $SWVAR with what is wanted, such as register=REG_NUM; of another table CARD.note2=LOW_TICK",
    )
    group.add_argument("--codepage", choices=CODE_PAGES, help="code page of texts (default: the file's, else cp437)")
    group.add_argument("--executive", metavar="V", help="version of the Executive, such as 3.8 (default: 4.2)")
    group.add_argument(
        "--drive",
        action="append",
        default=[],
        metavar="TASK=A|B",
        dest="drives",
        help="the drive of a UDC's task; may be given again",
    )


def refuse_folder_options(arguments: argparse.Namespace) -> None:
    """Refuse options of folders where a configuration task is given.

    Raises:
        UsageError: one is given.
    """
    reads = {"--headers": arguments.headers, "--rack": arguments.rack, "--codepage": arguments.codepage}
    for option, value in {**reads, **_choices(arguments)}.items():
        if value:
            raise UsageError(f"{option} is for the folder of a disk, and {arguments.file} is not a folder")


def _choices(arguments: argparse.Namespace) -> dict[str, object]:
    """Return the options that say what the tables do not, with what is given."""
    return {
        "--part": arguments.parts,
        "--field": arguments.fields,
        "--executive": arguments.executive,
        "--drive": arguments.drives,
    }


def import_folder(arguments: argparse.Namespace, modules: Mapping[int, str]) -> int:
    """Write the rack file and its tasks; 1 where something is lost, or the rack file has errors."""
    findings = Findings()
    if arguments.headers:
        return _show_headers(arguments, findings)
    choices = Choices(
        parts=each_once("--part", map(_part, arguments.parts)),
        modules=modules,
        fields=_fields(arguments.fields),
        code_page=arguments.codepage,
        executive=_executive(arguments.executive),
        drives=each_once("--drive", map(_drive, arguments.drives)),
    )
    place = chosen_rack(arguments.file, arguments.rack)
    if arguments.output is not None:
        _require_outside(arguments.output, place.rack.path)
        require_free(arguments.output, force=arguments.force)
    made = import_rack(place, choices, findings)
    _print(findings)
    if made.known:
        parts = " ".join(f"--part {code}={model}" for code, model in made.known.items())
        print(f"part codes: {parts}", file=sys.stderr)
    if arguments.output is None:
        sys.stdout.write(made.text)
        if made.sources:
            text = count_of(len(made.sources), "task")
            print(f"--output DIR/rack.yaml writes the rack file, with its {text}", file=sys.stderr)
    else:
        _write(arguments.output, made, force=arguments.force)
    source = SourceText(str(arguments.output or "the rack file"), made.text)
    print_diagnostics(made.diagnostics, source, sys.stderr)
    wrong = findings.has_errors or has_errors(made.diagnostics)
    if arguments.output is not None:
        print(f"next: automax check {arguments.output}")
    return 1 if wrong else 0


def _show_headers(arguments: argparse.Namespace, findings: Findings) -> int:
    writes = {"--output": arguments.output, "--force": arguments.force, "--module": arguments.modules}
    for option, value in {**writes, **_choices(arguments)}.items():
        if value:
            raise UsageError(f"--headers goes without {option}", "it only shows the tables' fields: import afterwards")
    places = racks_in(arguments.file)
    if arguments.rack is not None or not places:
        places = [chosen_rack(arguments.file, arguments.rack)]
    for line in headers_of(places, arguments.codepage, findings):
        print(line)
    _print(findings)
    return 1 if findings.has_errors else 0


def _print(findings: Findings) -> None:
    colour = wants_colour(sys.stderr)
    for item in findings.items:
        text = str(item)
        if colour:
            head = f"{item.severity.value}[{item.code}]"
            text = text.replace(head, painted(head, _COLOURS[item.severity]), 1)
        write_control(sys.stderr, text + "\n")
    if findings.left_out:
        print(f"{count_of(findings.left_out, 'finding')} more: only the first are shown", file=sys.stderr)


def _write(output: Path, made: ImportedRack, *, force: bool) -> None:
    """Write the tasks, then the rack file that names them."""
    places = {output.parent / name: data for name, data in made.sources.items()}
    for path in places:
        if not force and (path.exists() or path.is_symlink()):
            raise UsageError(f"{path} exists already", "--force writes over it; or name a new folder")
    try:
        output.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UsageError(f"{output.parent} cannot be made: {error.strerror or error}") from error
    for path, data in places.items():
        write_whole(path, data, over=force)
    write_whole(output, made.text.encode(), over=force)
    counts = ", ".join((count_of(made.tasks, "task"), count_of(made.commons, "common")))
    print(f"wrote {output}: {counts}; the tasks lie next to it")


def _require_outside(output: Path, folder: Path) -> None:
    if output.resolve().is_relative_to(folder.resolve()):
        message = f"{output} lies in the old rack's own folder, whose sources stay as they are"
        raise UsageError(message, "name a new folder: --output plant/rack.yaml")


def _part(text: str) -> tuple[int, str]:
    match = _PART.fullmatch(text)
    if match is None:
        raise UsageError(f"--part {quoted(text)} is not a part code and a module", "for example --part 17=57C435")
    number = module_number(match[2])
    if not number_known(number):
        raise UsageError(f"--part {quoted(text)}: there is no such module", f"there are {', '.join(SUPPORTED)}")
    return int(match[1]), number


def _fields(texts: Sequence[str]) -> list[FieldChoice]:
    """Return the fields that the user names: each of one thing, and each thing once."""
    with naming("--field"):
        choices = [field_choice(text) for text in texts]
    each_once("--field", ((f"{item.table}.{item.field}", item) for item in choices))
    return list(each_once("--field", ((f"{item.table}.{item.key}", item) for item in choices)).values())


def _drive(text: str) -> tuple[str, str]:
    match = _DRIVE.fullmatch(text)
    if match is None:
        raise UsageError(f"--drive {quoted(text)} is not a task and A or B", "for example --drive WIND_A=A")
    return match[1].upper(), match[2].upper()


def _executive(text: str | None) -> int | None:
    if text is None:
        return None
    match = _VERSION.fullmatch(text)
    version = int(match[1]) * 10 + int(match[2]) if match is not None else 0
    if not _FIRST <= version <= NEWEST:
        allowed = f"it is {version_text(_FIRST)} to {version_text(NEWEST)}"
        raise UsageError(f"--executive {quoted(text)} is not a version with databases", allowed)
    return version
