"""Translation of a task's scans to C, from the Python that the compiler generates.

The integers of Python have any size; C's have 64 bits, or 128. So the ranges of all values are followed through the
scan, from the range of each variable, and through as many scans as it takes until they no longer grow: where an integer
cannot be proved to fit, the task is not native. Doubles need no proof, except where they are converted to integers.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import cache
from importlib.resources import files

from automax_ros.compile.base.build import collections_paused
from automax_ros.compile.base.emitter import variable_name
from automax_ros.compile.base.layout import Layout, Role, StateField
from automax_ros.compile.base.native_source import NativeSource, NotNative, TaskFunction
from automax_ros.compile.compiler import CompiledTask
from automax_ros.compile.native.translate.calls import called
from automax_ros.compile.native.translate.environment import Environment
from automax_ros.compile.native.translate.frame import Array, Frame, Unit
from automax_ros.compile.native.translate.members import members
from automax_ros.compile.native.translate.ranges import INFINITE, NumberKind, Range, exactly, of_type
from automax_ros.compile.native.translate.scan_body import ScanBody, scan_of, state_names
from automax_ros.compile.native.translate.typed import whole_text
from automax_ros.core.types import DataType, type_of_name
from automax_ros.language.tree.tree import Scope

_RETURN = re.compile("return ([^;]*);")
MOST_ROUNDS = 60
"""Most translations of a scan, each for a wider range of states, before the integers of a task count as unbounded; a
state takes a few."""
_VARIABLES = (Role.LOCAL, Role.TUNABLE)


def translate(compiled: CompiledTask) -> NativeSource:
    """Return the C of a task's scans.

    Raises:
        NotNative: the task is a BASIC task or a drive's, or has a statement that C cannot execute to the same bits.
    """
    return translated(compiled, scans_of(compiled))


def scans_of(compiled: CompiledTask) -> TaskFunction:
    """Return the form of a task's scans that is translated.

    Raises:
        NotNative: tasks of this kind cannot be native.
    """
    if compiled.program.is_basic:
        raise NotNative("a BASIC task")
    if compiled.program.cml is not None:
        raise NotNative("the current minor loop of a drive", compiled.program.cml.line)
    texts = [field.name for field in compiled.layout.fields if field.type is DataType.STRING]
    if texts:
        raise NotNative(f"the string {texts[0]}")
    return compiled.form("scans_forced")


def translated(compiled: CompiledTask, form: TaskFunction) -> NativeSource:
    """Return the C of scans in the form that ``scans_of`` returns.

    Raises:
        NotNative: they have a statement that C cannot execute to the same bits.
    """
    with collections_paused():
        translation = _Translation(compiled, form)
        known = translation.settled()
        ranges = [known[name] for name in translation.names]
        limits = tuple((0, 0) if item.kind is NumberKind.REAL else (int(item.low), int(item.high)) for item in ranges)
        return NativeSource(compiled.program.name, translation.text(), limits)


def fixed_parts() -> tuple[str, ...]:
    """Return the texts that are part of the C of each task."""
    return tuple(map(_part, ("abi.h", "operations.h", "host_calls.h", "columns.h")))


class _Translation:
    def __init__(self, compiled: CompiledTask, form: TaskFunction) -> None:
        self._compiled, self._layout = compiled, compiled.layout
        tuples, self._statements = scan_of(form.function)
        types = {view: type_of_name(name) for name, view in form.views.items()}
        self.names = state_names(form.function)
        fields = dict(zip(self.names, self._layout.fields, strict=True))
        scalars = {name: field for name, field in fields.items() if not field.is_array}
        self._frame = Frame(
            Unit(),
            form.known,
            called,
            members=members(types),
            fields={name: f"s->{name}" for name in scalars},
            field_kinds={name: kind for name in scalars if (kind := of_type(scalars[name].type).kind) is not None},
            arrays={name: Array(f"s->{name}", field.size) for name, field in fields.items() if field.is_array},
            tuples=tuples,
            declared={
                **{name: Range(NumberKind.INT, 0, field.below - 1) for name, field in fields.items() if field.below},
                **{
                    variable_name(name): of_type(symbol.type)
                    for name, symbol in compiled.program.symbols.items()
                    if symbol.scope is Scope.LOCAL or symbol.latched
                },
            },
            is_scan=True,
        )
        self._latched = [of_type(type_of_name(name)) for name in compiled.latched]

    def settled(self) -> Environment:
        """Translate until no scan widens the ranges of the state; return these ranges."""
        body = ScanBody(self._frame, self._latched, self._compiled.written)
        fields = dict(zip(self.names, self._layout.fields, strict=True))
        known = Environment({name: _at_first(field) for name, field in fields.items()})
        for _ in range(MOST_ROUNDS):
            self._frame.begin_again()
            after = body.execute(self._statements, known) or known
            grown = [name for name in fields if not known[name].holds(after[name])]
            if not grown and not self._frame.has_grown:
                return known
            wider = {name: self._grow(name, fields[name], known[name].widened(after[name])) for name in grown}
            known = Environment({**dict(known.items()), **wider})
        raise NotNative("a state that has no bounds")

    def _leaving(self) -> list[str]:
        """Return the lines; where fields are in locals during the scan, each return stores them back."""
        wide = self._frame.wide_fields
        if not wide:
            return self._frame.lines
        back = " ".join(f"s->{name} = (int64_t){place};" for name, place in wide.items())
        return [_RETURN.sub(rf"{{ {back} return \1; }}", line) for line in self._frame.lines]

    def _grow(self, name: str, field: StateField, known: Range) -> Range:
        """Return the range of a field as found so far; the integers of blocks have bounds."""
        if field.role in _VARIABLES or known.kind is None:
            raise NotNative(f"{field.name} may be left with a value beyond its type")
        return self._frame.pinned(name, known)

    def text(self) -> str:
        frame = self._frame
        declared = [f"    {kind} {place};" for place, kind in frame.locals.items()]
        *before, after = fixed_parts()
        return "\n".join(
            [
                *before,
                f"/* The state of {self._compiled.program.name}, as its layout has it. */",
                *_structure(self.names, self._layout),
                "",
                f"#define AUTOMAX_LATCHED {len(self._latched)}",
                f"#define AUTOMAX_WRITTEN {len(self._compiled.written)}",
                _limits("latched_low", [item.low for item in self._latched]),
                _limits("latched_high", [item.high for item in self._latched]),
                "",
                *frame.unit.parts,
                "",
                "/* One scan, from SCAN_LOOP to END: k is its place in the columns. */",
                "static int scan(state *restrict s, const automax_slot *const *latched, automax_slot *const *out,",
                "                int64_t k, const int64_t *forced, automax_host *host) {",
                "    int ended_by = AUTOMAX_DONE;",
                "    int *const ended = &ended_by;",
                *declared,
                *(f"    {place} = s->{name};" for name, place in frame.wide_fields.items()),
                *self._leaving(),
                "}",
                "",
                after,
            ]
        )


def _at_first(field: StateField) -> Range:
    """Return the range of a field before the first scan: for a variable, and for a REAL, the whole range of the type.

    A state from outside may have any REAL.
    """
    if field.role in _VARIABLES or field.type is DataType.REAL:
        return of_type(field.type)
    assert not isinstance(field.initial, str)
    if field.below:
        return Range(NumberKind.INT, 0, field.below - 1)
    return exactly(field.initial)


@cache
def _part(name: str) -> str:
    return files("automax_ros.compile.native").joinpath(name).read_text(encoding="utf-8")


def _structure(names: Sequence[str], layout: Layout) -> list[str]:
    lines = ["typedef struct {"]
    for name, field in zip(names, layout.fields, strict=True):
        kind = "double" if field.type is DataType.REAL else "int64_t"
        lines.append(f"    {kind} {name}{f'[{field.size}]' if field.is_array else ''}; /* {field.name} */")
    if not names:
        lines.append("    int64_t nothing;")
    return [*lines, "} state;"]


def _limits(name: str, bounds: Sequence[float]) -> str:
    texts = [whole_text(int(bound)) if abs(bound) != INFINITE else "0" for bound in bounds]
    return f"static const int64_t {name}[] = {{{', '.join([*texts, '0'])}}};"
