"""Translation of the calls of ``io`` to functions of the host, which is passed to the scan."""

from __future__ import annotations

import ast
from collections.abc import Mapping

from automax_ros.compile.base.native_source import NotNative
from automax_ros.compile.native.translate.environment import Environment
from automax_ros.compile.native.translate.frame import Frame, Member
from automax_ros.compile.native.translate.ranges import ANY_BOOL, Kind, Range, of_type
from automax_ros.compile.native.translate.typed import Typed, bare
from automax_ros.core.numbers import INT32_MAX
from automax_ros.core.types import DataType

NOTHING = Typed("", ANY_BOOL)
TYPE_NUMBERS = {
    DataType.BOOLEAN: ("read_bool", "AUTOMAX_BOOLEAN"),
    DataType.INTEGER: ("read_whole", "AUTOMAX_INTEGER"),
    DataType.DOUBLE: ("read_whole", "AUTOMAX_INTEGER"),
    DataType.REAL: ("read_real", "AUTOMAX_REAL"),
}
"""For each type of a common the function that reads it, and its kind in ``abi.h``."""
_WRITES = {Kind.BOOL: "write_whole", Kind.INT: "write_whole", Kind.REAL: "write_real"}


def members(types: Mapping[int, DataType]) -> dict[str, Member]:
    """Return the translation of each call; ``types`` are those of the commons, by view."""

    def read_now(frame: Frame, node: ast.Call, known: Environment) -> list[Typed]:
        view, kind = _common(types, node)
        element = bare(frame.value(node.args[1], known).text) if len(node.args) > 1 else "0"
        function, number = TYPE_NUMBERS[kind]
        low, high = _bounds(kind)
        return [Typed(f"{function}(host, {view}, {element}, {number}{low}{high}, {frame.ended()})", of_type(kind))]

    def write_now(frame: Frame, node: ast.Call, known: Environment) -> list[Typed]:
        view, kind = _common(types, node)
        item = frame.value(node.args[1], known)
        if item.mixed:
            raise NotNative("a write of what is an integer or a REAL, as it happens")
        item = frame.held(item, of_type(kind))
        element = bare(frame.value(node.args[2], known).text) if len(node.args) > 2 else "0"
        arguments = f"{view}, {element}, {TYPE_NUMBERS[kind][1]}, {bare(item.text)}"
        assert item.range.kind is not None
        return [Typed(f"{_WRITES[item.range.kind]}(host, {arguments}, {frame.ended()})", ANY_BOOL)]

    return {**_MEMBERS, "read_now": read_now, "write_now": write_now}


def _common(types: Mapping[int, DataType], node: ast.Call) -> tuple[int, DataType]:
    view = node.args[0]
    assert isinstance(view, ast.Constant)
    assert isinstance(view.value, int)
    kind = types[view.value]
    if kind not in TYPE_NUMBERS:
        raise NotNative("a string")
    return view.value, kind


def _bounds(kind: DataType) -> tuple[str, str]:
    """Return the arguments for the bounds of a value that is read: a recording may contain any value."""
    if kind not in (DataType.INTEGER, DataType.DOUBLE):
        return "", ""
    low, high = of_type(kind).low, of_type(kind).high
    return f", {low}LL", f", {high}"


def _log(frame: Frame, node: ast.Call, known: Environment) -> list[Typed]:
    line, code = (bare(frame.value(argument, known).text) for argument in node.args)
    return [Typed(f"log_error(host, {line}, {code}, {frame.ended()})", ANY_BOOL)]


def _plain(function: str) -> Member:
    return lambda frame, _, __: [Typed(f"{function}(host, {frame.ended()})", ANY_BOOL)]


def _refuse_member(what: str) -> Member:
    def refuse(_: Frame, __: ast.Call, ___: Environment) -> list[Typed]:
        raise NotNative(what)

    return refuse


def _io_read(frame: Frame, node: ast.Call, known: Environment) -> list[Typed]:
    slot, place = (bare(frame.value(argument, known).whole.text) for argument in node.args)
    word, problem = of_type(DataType.INTEGER), Range(Kind.INT, 0, INT32_MAX)
    name = frame.temporary(problem)
    return [
        Typed(f"io_read(host, {slot}, {place}, &{name}, {frame.ended()})", word),
        Typed(name, problem),
    ]


def _io_write(frame: Frame, node: ast.Call, known: Environment) -> list[Typed]:
    slot, place, value = (frame.value(argument, known) for argument in node.args)
    if not value.range.is_whole:
        raise NotNative("a REAL written to a register")
    arguments = ", ".join(bare(item.whole.text) for item in (slot, place, value))
    return [Typed(f"io_write(host, {arguments}, {frame.ended()})", Range(Kind.INT, 0, INT32_MAX))]


_MEMBERS: dict[str, Member] = {
    "latch": lambda _, __, ___: [],
    "log": _log,
    "errors_logged": _plain("errors_logged"),
    "clear_errors": _plain("clear_errors"),
    "io_read": _io_read,
    "io_write": _io_write,
    "print_line": _refuse_member("PRINT"),
    "set_event": _refuse_member("SET of an event"),
    "minor_loop": _refuse_member("the current minor loop of a drive"),
}
