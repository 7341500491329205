"""The state of a part as plain data that JSON keeps bit for bit: saved now, restored later.

A state fits only a part created from the same data: constants (impedances, ratings, load functions) are not in it.
"""

from __future__ import annotations

from typing import Any, ClassVar

from automax_ros.drive.base.errors import ParameterError

SavedState = dict[str, Any]
"""Numbers, texts, None, and lists and dicts of them, by name."""


class Stateful:
    """A part whose state is attributes: numbers, and flat lists or tuples of numbers or of tuples of numbers."""

    _kept: ClassVar[tuple[str, ...]] = ()

    def state(self) -> SavedState:
        """Return all that the part's future depends on, apart from the data that it was created from."""
        return {name: _plain(getattr(self, name)) for name in self._kept}

    def restore(self, state: SavedState) -> None:
        """Restore a state; the part then continues as after ``state()``, bit for bit.

        Raises:
            ParameterError: it is not the state of such a part.
        """
        check_names(type(self).__name__, state, self._kept)
        for name in self._kept:
            value = state[name]
            if isinstance(value, list):
                value = [tuple(item) if isinstance(item, list) else item for item in value]
                if isinstance(getattr(self, name), tuple):
                    value = tuple(value)
            setattr(self, name, value)


def check_names(part: str, state: SavedState, names: tuple[str, ...]) -> None:
    """Check that a state has exactly the required names; raises ParameterError if a name is missing or not expected."""
    if set(state) != set(names):
        raise ParameterError(f"this is not the state of a {part}: it needs {', '.join(names) or 'nothing'}")


def _plain(value: Any) -> Any:
    return [_plain(item) for item in value] if isinstance(value, list | tuple) else value
