"""Every option that --help shows does something: the subcommand's own code reads it."""

import argparse
import ast
from pathlib import Path

import pytest

from automax_ros import cli
from automax_ros.cli.main import SUBCOMMANDS, module_of

FOLDER = Path(cli.__file__).parent
PREFIXED = {"record_"}
"""Options that are read by a name put together from this and a word."""


def options_of(name: str) -> set[str]:
    parser = argparse.ArgumentParser()
    module_of(name).add_arguments(parser)
    found: set[str] = set()
    parsers = [parser]
    while parsers:
        for action in parsers.pop()._actions:
            if isinstance(action, argparse._SubParsersAction):
                parsers += action.choices.values()
            elif not isinstance(action, argparse._HelpAction):
                found.add(action.dest)
    return found


def files_of(name: str) -> list[Path]:
    """The files of a subcommand: its own, and those of the command line that they import."""
    found, waiting = set(), [Path(str(module_of(name).__file__)), *FOLDER.rglob(f"{name}_*.py")]
    while waiting:
        path = waiting.pop()
        if path in found or not path.exists():
            continue
        found.add(path)
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ImportFrom) and str(node.module).startswith("automax_ros.cli"):
                base = FOLDER.joinpath(*str(node.module).split(".")[2:])
                waiting += [base.with_suffix(".py"), *(base / f"{alias.name}.py" for alias in node.names)]
    return sorted(found)


def read_in(path: Path) -> set[str]:
    """The attributes that a file reads, also by ``getattr``, and the names that it puts together from words."""
    nodes = list(ast.walk(ast.parse(path.read_text(encoding="utf-8"))))
    names = {node.attr for node in nodes if isinstance(node, ast.Attribute)}
    asked = [node.args[1] for node in nodes if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "getattr"]
    names |= {node.value for node in asked if isinstance(node, ast.Constant)}
    words = {node.value for node in nodes if isinstance(node, ast.Constant) and isinstance(node.value, str)}
    return names | {prefix + word for prefix in PREFIXED for word in words}


@pytest.mark.parametrize("name", SUBCOMMANDS)
def test_every_option_is_read(name):
    read = set().union(*map(read_in, files_of(name)))
    assert options_of(name) - read == set()
