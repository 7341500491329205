"""One request of `automax ctl`, and an action that consists of such."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import Any


@dataclass(frozen=True)
class ServiceCall:
    """One request: the service, its type as ``package/Type``, the request's fields, and what it is about.

    ``reword`` puts the rack's words into the person's, who knows files of this computer.
    """

    service: str
    type_name: str
    fields: Mapping[str, Any] = field(default_factory=dict)
    of: str = ""
    reword: Callable[[str], str] = str


class Means(Enum):
    """How the requests of an action are sent: each once, again and again, or as a press of buttons."""

    ONCE = "once"
    WATCH = "watch"
    PRESS = "press"


def _done(_: ServiceCall, __: Any) -> str:
    return "done"


@dataclass(frozen=True)
class Action:
    """An action: its line of help, its arguments, its requests, and for a reading what an answer holds.

    ``read`` returns data for JSON, ``lines`` how a person reads them, ``told`` what a person is told of an operation
    that was carried out. ``by_operator``: it needs a rack with an operator's services; ``acts``: it
    changes something, though its answer is read. ``more`` returns what stands
    below its help.
    """

    help: str
    asks: Callable[[argparse.Namespace], list[ServiceCall]]
    add_arguments: Callable[[argparse.ArgumentParser], None] = lambda _: None
    read: Callable[[Any], Any] | None = None
    lines: Callable[[Any], Iterable[str]] = lambda _: ()
    told: Callable[[ServiceCall, Any], str] = _done
    means: Means = Means.ONCE
    by_operator: bool = True
    acts: bool = False
    more: Callable[[], str] = str

    @property
    def reads(self) -> bool:
        """Whether it changes nothing in the rack."""
        return self.read is not None and not self.acts
