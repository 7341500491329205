"""Every subcommand with its arguments, as data: for the reference pages and for shell completion."""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from automax_ros.cli.main import SUBCOMMANDS, module_of, parsers


@dataclass(frozen=True)
class Option:
    """An option with all its names; ``values`` are its choices, () where it has none."""

    names: tuple[str, ...]
    takes_value: bool
    values: tuple[str, ...]
    metavar: str
    text: str


@dataclass(frozen=True)
class Subcommand:
    """A subcommand: its words after ``automax``, its purpose, its arguments; ``inner`` are its own subcommands."""

    words: tuple[str, ...]
    title: str
    text: str
    usage: str
    positionals: tuple[Option, ...]
    options: tuple[Option, ...]
    inner: tuple[Subcommand, ...]

    def all(self) -> Iterator[Subcommand]:
        """Yield the command and the subcommands in it."""
        yield self
        for command in self.inner:
            yield from command.all()


def commands() -> tuple[Subcommand, ...]:
    """Return every subcommand, in the order of the help."""
    found = parsers({name: module_of(name) for name in SUBCOMMANDS})[1]
    return tuple(_command(found[name], (name,), title) for name, title in SUBCOMMANDS.items())


def _command(parser: argparse.ArgumentParser, words: tuple[str, ...], title: str) -> Subcommand:
    inner: list[Subcommand] = []
    options: list[Option] = []
    positionals: list[Option] = []
    for action in parser._actions:
        if action.help == argparse.SUPPRESS:  # for our own processes
            continue
        if isinstance(action, argparse._SubParsersAction):
            inner += _inner(action, words)
        elif action.option_strings:
            options.append(_option(action))
        else:
            positionals.append(_option(action))
    text = parser.description or ""
    usage = " ".join(parser.format_usage().removeprefix("usage:").split())
    return Subcommand(words, title, text, usage, tuple(positionals), tuple(options), tuple(inner))


def _inner(action: argparse._SubParsersAction[argparse.ArgumentParser], words: Sequence[str]) -> Iterator[Subcommand]:
    titles = {choice.dest: choice.help or "" for choice in action._choices_actions}
    for name, parser in action.choices.items():
        yield _command(parser, (*words, name), titles.get(name, ""))


def _option(action: argparse.Action) -> Option:
    text = str(action.help) % {**vars(action), "prog": "automax"} if action.help else ""
    metavar = action.metavar if isinstance(action.metavar, str) else " ".join(action.metavar or ())
    takes_value = action.nargs != 0
    return Option(
        tuple(action.option_strings),
        takes_value,
        tuple(map(str, action.choices or ())),
        metavar or ("" if not takes_value else action.dest.upper()),
        text,
    )
