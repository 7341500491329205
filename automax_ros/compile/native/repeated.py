"""Statements of a scan that come out as they did before, when the scan is translated once more.

A scan is translated until no state is left that was not thought of. From one time to the next little changes: most
statements find their names as they found them before, and come to the same lines and the same ranges.
"""

from __future__ import annotations

import ast
from collections.abc import Callable
from dataclasses import dataclass

from automax_ros.compile import build
from automax_ros.compile.native.environment import Environment
from automax_ros.compile.native.frame import Frame
from automax_ros.compile.native.ranges import Range

CarryOut = Callable[[ast.stmt, Environment], Environment | None]


@dataclass(frozen=True)
class _Came:
    """What a statement found, and what came of it: lines, locals, names that it set, what is known after it."""

    found: tuple[object, ...]
    lines: list[str]
    locals: dict[str, str]
    touched: set[str]
    temporaries: int
    asks_end: bool
    changes: list[tuple[str, Range | None]]


class Repeated:
    """The statements of one function that were translated; those with loops, and some that are named, never repeat."""

    def __init__(self, frame: Frame, never: frozenset[str]) -> None:
        """Take the function, and names whose statements depend on more than their own names."""
        self._frame, self._never = frame, never
        self._names: dict[int, tuple[str, ...] | None] = {}
        self._came: dict[int, _Came] = {}

    def carried_out(self, statement: ast.stmt, known: Environment, carry_out: CarryOut) -> Environment | None:
        """Emit a statement, by ``carry_out`` where it does not come out as before; return what is known after it."""
        names = self._names_of(statement)
        if names is None:
            return carry_out(statement, known)
        frame = self._frame
        ranges = (*map(known.get, names), *map(frame.declared.get, names))
        found = (*ranges, frame.temporaries, frame.asks_end, *frame.extent)
        came = self._came.get(id(statement))
        if came is None or came.found != found:
            return self._carry_out(statement, known, found, carry_out)
        frame.lines += came.lines
        frame.locals.update(came.locals)
        frame.touched |= came.touched
        frame.temporaries, frame.asks_end = came.temporaries, came.asks_end
        return _changed(known, came.changes)

    def _carry_out(
        self, statement: ast.stmt, known: Environment, found: tuple[object, ...], carry_out: CarryOut
    ) -> Environment | None:
        frame = self._frame
        begin, extent = len(frame.lines), frame.extent
        locals_before, frame.locals = frame.locals, {}
        touched_before, frame.touched = frame.touched, set()
        after = carry_out(statement, known)
        made, touched = frame.locals, frame.touched
        frame.locals, frame.touched = locals_before, touched_before | touched
        frame.locals.update(made)
        if after is not None and frame.extent == extent:
            changes = [(name, left) for name, _, left in known.differing(after)]
            lines = frame.lines[begin:]
            self._came[id(statement)] = _Came(found, lines, made, touched, frame.temporaries, frame.asks_end, changes)
        return after

    def _names_of(self, statement: ast.stmt) -> tuple[str, ...] | None:
        """Return the names in a statement, None where they are not all that it depends on."""
        key = id(statement)
        if key not in self._names:
            nodes = list(build.nodes(statement))
            names = {node.id for node in nodes if isinstance(node, ast.Name)}
            is_plain = not names & self._never and not any(isinstance(node, ast.While) for node in nodes)
            self._names[key] = tuple(sorted(names)) if is_plain else None
        return self._names[key]


def _changed(known: Environment, changes: list[tuple[str, Range | None]]) -> Environment:
    if not changes:
        return known
    after = known.without({name for name, left in changes if left is None})
    for name, left in changes:
        if left is not None:
            after[name] = left
    return after
