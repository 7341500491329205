"""Requests of `automax ctl`, and the actions that consist of them."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import Any


@dataclass(frozen=True)
class ServiceCall:
    """One request: the service, its type as ``package/Type``, the request's fields, and what it concerns.

    ``reword`` adapts texts of the rack for the user, such as names of files on this computer.
    """

    service: str
    type_name: str
    fields: Mapping[str, Any] = field(default_factory=dict)
    of: str = ""
    reword: Callable[[str], str] = str


class Mode(Enum):
    """How the requests of an action are sent: each once, repeatedly, or as a press of buttons."""

    ONCE = "once"
    WATCH = "watch"
    PRESS = "press"


def _done_text(_: ServiceCall, __: Any) -> str:
    return "done"


@dataclass(frozen=True)
class Action:
    """An action: its line of help, its arguments, its requests, and the presentation of answers.

    ``read`` returns the data of an answer for JSON, ``lines`` the lines of text for these data, ``done_text`` the text
    for an operation that was carried out. ``by_operator``: it needs a rack with the operator's services; ``acts``: it
    changes something, although its answer is read. ``more`` returns the text below its help.
    """

    help: str
    calls: Callable[[argparse.Namespace], list[ServiceCall]]
    add_arguments: Callable[[argparse.ArgumentParser], None] = lambda _: None
    read: Callable[[Any], Any] | None = None
    lines: Callable[[Any], Iterable[str]] = lambda _: ()
    done_text: Callable[[ServiceCall, Any], str] = _done_text
    mode: Mode = Mode.ONCE
    by_operator: bool = True
    acts: bool = False
    more: Callable[[], str] = str

    @property
    def reads(self) -> bool:
        """Whether the action changes nothing in the rack."""
        return self.read is not None and not self.acts
