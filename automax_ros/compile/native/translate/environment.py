"""The known range of each name that has a value, at one place of a function."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from automax_ros.compile.native.translate.ranges import Range

_MOST_CHANGES = 128
"""Changes after which a new base is made: a copy costs all changes, a base costs all names of a task."""


class Environment:
    """Ranges by name. A copy shares unchanged ranges: a branch sets few names of the whole task.

    Names may be set only in an environment that the caller has created, new or by ``copy``.
    """

    __slots__ = ("_base", "_changes")

    def __init__(self, base: Mapping[str, Range], changes: dict[str, Range | None] | None = None) -> None:
        self._base = base
        self._changes: dict[str, Range | None] = {} if changes is None else changes

    def get(self, name: str) -> Range | None:
        """Return the range of a name, None where it has no value."""
        changes = self._changes
        return changes[name] if name in changes else self._base.get(name)

    def __getitem__(self, name: str) -> Range:
        found = self.get(name)
        if found is None:
            raise KeyError(name)
        return found

    def __setitem__(self, name: str, known: Range) -> None:
        self._changes[name] = known

    def __contains__(self, name: str) -> bool:
        return self.get(name) is not None

    def copy(self) -> Environment:
        """Return a copy that can be changed."""
        if len(self._changes) > _MOST_CHANGES:
            return Environment(dict(self.items()))
        return Environment(self._base, self._changes.copy())

    def setting(self, name: str, known: Range) -> Environment:
        """Return a copy in which one name has this range."""
        made = self.copy()
        made[name] = known
        return made

    def without(self, names: set[str]) -> Environment:
        """Return a copy in which some names have no value."""
        made = self.copy()
        changes = made._changes
        for name in names:
            if name in made._base:
                changes[name] = None
            else:
                changes.pop(name, None)
        return made

    def items(self) -> Iterator[tuple[str, Range]]:
        """Yield each name that has a value, with its range."""
        changes = self._changes
        for name, known in self._base.items():
            if name not in changes:
                yield name, known
        for name, changed in changes.items():
            if changed is not None:
                yield name, changed

    def differing(self, other: Environment) -> Iterator[tuple[str, Range | None, Range | None]]:
        """Yield each name whose range differs between the two, and both ranges; None where it has no value."""
        if self._base is not other._base:
            yield from self._differing_throughout(other)
            return
        base, first, second = self._base, self._changes, other._changes
        for name, there in second.items():
            here = first[name] if name in first else base.get(name)
            if here is not there:
                yield name, here, there
        for name, here in first.items():
            if name not in second and here is not base.get(name):
                yield name, here, base.get(name)

    def _differing_throughout(self, other: Environment) -> Iterator[tuple[str, Range | None, Range | None]]:
        for name, here in self.items():
            there = other.get(name)
            if here is not there:
                yield name, here, there
        for name, there in other.items():
            if name not in self:
                yield name, None, there

    def joined(self, other: Environment) -> Environment:
        """Return the known ranges where two paths meet: a name that has no value on one of them has none."""
        changes = self._changes.copy()
        for name, here, there in self.differing(other):
            changes[name] = None if here is None or there is None else here.joined(there)
        return Environment(self._base, changes)


def joined(first: Environment | None, second: Environment | None) -> Environment | None:
    """Return the known ranges where two paths meet; None: no path."""
    if first is None or second is None:
        return second if first is None else first
    return first.joined(second)
