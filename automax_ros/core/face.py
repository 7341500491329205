"""The public face of a room: names that can be imported from the room itself, each from its file when it is asked for.

So `from automax_ros.rack import Rack` works, and whoever needs one file of a room does not wait for all of them.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from importlib import import_module
from typing import Any


def face(room: str, *files: str) -> Callable[[str], Any]:
    """Return ``__getattr__`` of a room: its ``__all__`` names are looked for in these files of it, in their order."""

    def attribute(name: str) -> Any:
        module = sys.modules[room]
        if name in module.__all__:
            for file in files:
                found = vars(import_module(f"{room}.{file}"))
                if name in found:
                    setattr(module, name, found[name])
                    return found[name]
        raise AttributeError(f"module {room!r} has no attribute {name!r}")

    return attribute
