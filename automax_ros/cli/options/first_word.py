"""A subcommand with a form of its own for one first word, next to arguments that may be anything else."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from typing import Any


def add_form(
    parser: argparse.ArgumentParser, word: str, title: str, text: str, add: Callable[[argparse.ArgumentParser], None]
) -> argparse.ArgumentParser:
    """Add a form whose arguments ``add`` declares, for a first argument that is ``word``; return its parser.

    Call it before the subcommand's own arguments are added. Help, completion and reference find the form as they find
    a subcommand within one; it does not take part in the parsing of other arguments.
    """
    forms = parser.add_subparsers(title="other forms", metavar=word)
    form = forms.add_parser(word, help=title, description=text, formatter_class=argparse.RawDescriptionHelpFormatter)
    forms.nargs = forms.default = argparse.SUPPRESS  # it takes no argument, so that all go to those of the parser
    add(form)
    own = parser.parse_known_args

    def parse_known_args(args: Sequence[str] | None = None, namespace: Any = None) -> tuple[Any, list[str]]:
        if args and args[0] == word:
            return form.parse_known_args(args[1:], namespace)
        return own(args, namespace)

    parser.parse_known_args = parse_known_args  # type: ignore[method-assign, assignment]
    return form
