"""Attributes of classes for the compiler of ``tools/build_compiled.py``, which Python does not need."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, TypeVar

__all__ = ["mypyc_attr"]

if TYPE_CHECKING:
    from mypy_extensions import mypyc_attr
else:
    _Class = TypeVar("_Class", bound=type)

    def mypyc_attr(**_: bool) -> Callable[[_Class], _Class]:
        """Return a decorator that leaves a class as it is: mypyc has read the arguments already.

        ``allow_interpreted_subclasses=True`` on a class that a plain one inherits from: without it the methods that
        the plain one overrides would not be called. ``native_class=False`` on one that inherits from a plain class.
        """
        return lambda kind: kind
