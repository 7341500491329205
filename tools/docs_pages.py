"""Writes the pages of the reference that are generated from the code when the documentation site is built."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path

from automax_ros.cli.racks.schema import SCHEMAS
from automax_ros.cli.shell.arguments import Option, Subcommand, commands
from automax_ros.core.problems import PROBLEMS

ROOT = Path(__file__).resolve().parent.parent
PROBLEM_PAGES = ROOT / "automax_ros" / "core" / "pages"
BANDS = {"0": "Syntax", "2": "Types", "4": "Meaning", "6": "Files, racks and recordings", "7": "Run time"}
"""Meaning of the first digit of a problem's code (core/problems)."""
FIELD = re.compile(r"(?P<type>[\w/]+(?:<=\d+)?(?:\[[^\]]*\])?)\s+(?P<name>\w+)\s*(?P<value>=\s*.*|\S.*)?$")
"""A field of a message: its type, its name, the value of a constant or of a default."""


def pages() -> dict[str, str]:
    """Return every generated file by its place in the site: pages, and the schemas for editors."""
    return {
        "reference/commands.md": command_page(),
        "reference/messages.md": message_page(),
        "reference/problems.md": problem_page(),
        **{f"reference/problems_{band}.md": problem_band(band) for band in BANDS},
        **{f"schema/{kind}.schema.json": f"{json.dumps(make(), indent=2)}\n" for kind, make in SCHEMAS.items()},
    }


def command_page() -> str:
    """Return the page of the command line, from argparse."""
    found = commands()
    rows = [f"| [`automax {item.words[0]}`](#automax-{item.words[0]}) | {cell(item.title)} |" for item in found]
    head = (
        "# Commands\n\nExit codes: 0 fine, 1 the thing checked or run has errors, or the things compared differ, "
        "2 wrong usage or unreadable file.\n"
    )
    return "\n".join([head, "| command | what it does |", "| --- | --- |", *rows, "", *map(command_text, found)])


def command_text(command: Subcommand) -> str:
    """Return a subcommand's part of the page, with its own subcommands."""
    name = f"automax {' '.join(command.words)}"
    parts = [f"{'#' * (len(command.words) + 1)} {name}\n", f"```text\n{command.usage}\n```\n"]
    text = command.text if command.text else f"{command.title[:1].upper()}{command.title[1:]}."
    parts.append(f"{prose(text)}\n")
    arguments = [option for option in (*command.positionals, *command.options) if option.text]
    if arguments:
        rows = [f"| {argument(option)} | {cell(option.text)} |" for option in arguments]
        parts += ["| argument | what it is |", "| --- | --- |", *rows, ""]
    return "\n".join([*parts, *map(command_text, command.inner)])


def argument(option: Option) -> str:
    """Return an argument as a cell of a table: its names, and its values."""
    values = f" {','.join(option.values)}" if option.values else f" {option.metavar}" if option.metavar else ""
    names = ", ".join(f"`{name}{cell(values) if option.takes_value else ''}`" for name in option.names)
    return names or f"`{option.metavar}`"


def prose(text: str) -> str:
    """Return a help text as Markdown: indented lines, and those with columns, unchanged."""
    parts = re.split(r"\n\s*\n", text.strip("\n"))
    return "\n\n".join(f"```text\n{part}\n```" if re.search(r"^ |\S {2,}\S", part, re.M) else part for part in parts)


def cell(text: str) -> str:
    """Return a text for a cell of a table."""
    return " ".join(text.split()).replace("|", "&#124;").replace("<", "&lt;")


def message_page() -> str:
    """Return the page of the messages and services, from the comments of their definitions."""
    head = "# Messages and services\n\nThe package `automax_msgs`, as [ros.md](../ros.md) uses it.\n"
    parts = [head]
    for kind, word in (("msg", "Messages"), ("srv", "Services")):
        files = sorted((ROOT / "msg_defs" / kind).glob(f"*.{kind}"))
        parts += [f"## {word}\n", *(definition(path) for path in files)]
    return "\n".join(parts)


def definition(path: Path) -> str:
    """Return a message's or service's part of the page."""
    parts = [f"### {path.stem}\n"]
    for index, half in enumerate(re.split(r"^---$", path.read_text(encoding="utf-8"), flags=re.M)):
        text, fields = intro_and_fields(half)
        parts += [f"{text}\n"] if text else []
        parts += ["The answer:\n"] if index else []
        rows = [f"| `{name}` | `{cell(kind)}` | {cell(comment)} |" for kind, name, comment in fields]
        parts += ["| field | type | meaning |", "| --- | --- | --- |", *rows, ""] if rows else ["Nothing.\n"]
    return "\n".join(parts)


def intro_and_fields(text: str) -> tuple[str, list[tuple[str, str, str]]]:
    """Return the first comment of a definition, and type, name and preceding comments of each field."""
    intro, comments, fields = "", [], []  # type: tuple[str, list[str], list[tuple[str, str, str]]]
    for line in text.splitlines():
        if line.startswith("#"):
            comments.append(line.lstrip("# "))
        elif not line.strip():
            if comments and not fields and not intro:
                intro = " ".join(comments)
                comments = []
        else:
            fields.append(field(line, comments))
            comments = []
    return intro or ("" if fields else " ".join(comments)), fields


def field(line: str, comments: list[str]) -> tuple[str, str, str]:
    """Return type, name and meaning of a field.

    Raises:
        ValueError: the line is not a field.
    """
    plain, _, after = line.partition("#")
    match = FIELD.match(plain.strip())
    if match is None:
        raise ValueError(f"{line!r} is not a field")
    value = (match["value"] or "").lstrip("= ").strip()
    said = " ".join([*comments, after.strip()]).strip()
    return match["type"], match["name"], f"{value}: {said}" if value and said else value or said


def problem_page() -> str:
    """Return the list of all problems."""
    parts = ["# Problem codes\n\n`automax explain AMX4001` prints what stands here.\n"]
    for band, title in BANDS.items():
        rows = [f"| {link(code)} | {cell(PROBLEMS[code].title)} |" for code in codes(band)]
        parts += [f"## {title}\n", "| code | what is wrong |", "| --- | --- |", *rows, ""]
    return "\n".join(parts)


def codes(band: str) -> Iterator[str]:
    """Yield the codes of a band."""
    yield from (code for code in PROBLEMS if code[3] == band)


def link(code: str) -> str:
    """Return a link to a problem's page in the site."""
    return f"[{code}](problems_{code[3]}.md#{code.lower()})"


def problem_band(band: str) -> str:
    """Return the pages of the problems of a band as one, each under an anchor of its code."""
    parts = [f"# {BANDS[band]}: AMX{band}000 to AMX{band}999\n"]
    for code in codes(band):
        title, _, text = (PROBLEM_PAGES / f"{code}.md").read_text(encoding="utf-8").partition("\n")
        inner = re.sub(r"^## (.*)$", r"**\1**", text, flags=re.M)
        parts.append(f"## {title.removeprefix('# ')} {{ #{code.lower()} }}\n{inner}")
    return "\n".join(parts)
