"""Look at recordings, and repair those whose writer was killed or whose files were cut or damaged."""

from __future__ import annotations

import argparse
import importlib
from types import ModuleType

ACTIONS = {
    "info": "tell what a recording holds",
    "repair": "save what is sound of a damaged recording",
}
"""The actions with their lines of help; the module ``bag_ACTION`` of this folder implements each."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``automax bag`` and of its actions."""
    actions = parser.add_subparsers(title="actions", metavar="ACTION", dest="action", required=True)
    for name, text in ACTIONS.items():
        module = _module(name)
        own = actions.add_parser(
            name, help=text, description=module.__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
        )
        module.add_arguments(own)


def run(arguments: argparse.Namespace) -> int:
    """Carry out the action."""
    code: int = _module(arguments.action).run(arguments)
    return code


def _module(action: str) -> ModuleType:
    return importlib.import_module(f"automax_ros.cli.recordings.bag_{action}")
