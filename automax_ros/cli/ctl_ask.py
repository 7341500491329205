"""One request of `automax ctl`, and an action that consists of such."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class Ask:
    """One request: the service, its type as ``package/Type``, the request's fields, and what it is about.

    ``worded`` puts the rack's words into the person's, who knows files of this computer.
    """

    service: str
    type_name: str
    fields: Mapping[str, Any] = field(default_factory=dict)
    of: str = ""
    worded: Callable[[str], str] = str


@dataclass(frozen=True)
class Action:
    """An action: its line of help, its arguments, its requests, and for a reading what an answer holds.

    ``read`` returns data for JSON, ``lines`` how a person reads them. One that ``repeats`` asks again and again.
    ``by_operator``: it needs a rack with an operator's services.
    """

    help: str
    asks: Callable[[argparse.Namespace], list[Ask]]
    add_arguments: Callable[[argparse.ArgumentParser], None] = lambda _: None
    read: Callable[[Any], Any] | None = None
    lines: Callable[[Any], Iterable[str]] = lambda _: ()
    repeats: bool = False
    by_operator: bool = True
