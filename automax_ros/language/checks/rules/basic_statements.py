"""Checks of events, times, channels and ports (J-3675 6.6 to 6.8).

A number after # means the same in the whole task: a port, or one end of a channel (decision).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from automax_ros.blocks.declare.declaration import Platform
from automax_ros.core.diagnostics import Note, Span
from automax_ros.core.text import quoted
from automax_ros.core.types import DataType
from automax_ros.language.checks.rules.constant_values import constant_value
from automax_ros.language.checks.rules.context import Context, TaskLayout
from automax_ros.language.checks.rules.expressions import check_expression, check_integer
from automax_ros.language.checks.rules.statements import assignable, check_written
from automax_ros.language.program import OpenedFile
from automax_ros.language.tree import tree
from automax_ros.language.tree.task_kind import TaskKind

MAX_FILE = 255
"""Largest number of a channel or a port (J-3675 p. 6-20)."""
MAX_DEPTH = 1000
"""Most messages that a channel holds (decision: a bound on memory; no source has one)."""
MAX_ITEMS = 32
"""Most items of a message (decision)."""
PORTS = ("PORTA", "PORTB")


def find_files(context: Context, layout: TaskLayout) -> None:
    """Find the context's files in the OPEN statements, and report those that cannot be opened."""
    first: dict[int, Span] = {}
    if context.kind is TaskKind.BASIC and context.target is Platform.UDC:
        context.line = None
        context.report("AMX4119", "a UDC runs no BASIC task", Span(1, 1, 2), "its tasks A and B are .BLK files")
    for statement, line, _ in layout.numbered():
        if not isinstance(statement, (tree.OpenChannel, tree.OpenPort)):
            continue
        context.line = line
        opened = _opened_file(statement)
        known = context.files.setdefault(statement.file, opened)
        place = first.setdefault(statement.file, statement.span)
        if known != opened:
            note = Note(f"#{statement.file} is opened here as {known.words}", place)
            message = f"#{statement.file} cannot be {opened.words} too"
            if opened.words == known.words:
                message = f"#{statement.file} is opened with another TYPE"
            context.report("AMX4114", message, statement.span, "take another number", (note,))


def _opened_file(statement: tree.OpenChannel | tree.OpenPort) -> OpenedFile:
    if isinstance(statement, tree.OpenPort):
        return OpenedFile(statement.file, statement.port.upper())
    return OpenedFile(statement.file, "", statement.direction, statement.types)


def check_waiting(context: Context, statement: tree.Statement) -> None:
    """Report the faults of one statement of events, times, channels or ports; ignore others."""
    check = _CHECKS.get(type(statement))
    if check is not None:
        check(context, statement)


def _check_event(context: Context, statement: tree.SetEvent | tree.WaitOn) -> None:
    if context.target is Platform.UDC:
        context.report("AMX4027", "SET cannot be used in a UDC task", statement.span)
    elif statement.event not in context.events and "EVENT" not in context.broken.words:
        hint = context.suggest.hint(statement.event, context.events) or f"add EVENT NAME = {statement.event}"
        place = context.place_of(statement.event, statement.span)
        context.report("AMX4060", f"the event {statement.event} is not declared", place, hint)


def _check_set(context: Context, statement: tree.SetEvent) -> None:
    _check_event(context, statement)
    event = context.events.get(statement.event)
    if event is not None and event.interrupt_status is not None:
        message = f"{statement.event} is a hardware event: the interrupt of its module sets it"
        context.report("AMX4121", message, statement.span, "declare a software event: EVENT NAME = name")


def _check_time(context: Context, statement: tree.Delay | tree.StartEvery) -> None:
    word = "DELAY" if isinstance(statement, tree.Delay) else "START EVERY"
    check_integer(context, statement.count, "AMX2009", f"the time of {word}")
    value = constant_value(statement.count)
    least = 0 if isinstance(statement, tree.Delay) else 1
    if isinstance(value, int) and value < least:
        message = f"{word} needs {least} or more, not {value}"
        context.report("AMX4118", message, statement.count.span)


def _check_open_channel(context: Context, statement: tree.OpenChannel) -> None:
    _check_number(context, statement.file, statement.span)
    if len(statement.types) > MAX_ITEMS:
        message = f"a message has at most {MAX_ITEMS} items, here {len(statement.types)}"
        context.report("AMX4118", message, statement.span)
    if statement.depth is None:
        return
    check_integer(context, statement.depth, "AMX2009", "DEPTH")
    value = constant_value(statement.depth)
    if isinstance(value, int) and not 1 <= value <= MAX_DEPTH:
        context.report("AMX4118", f"DEPTH = {value} is not 1 to {MAX_DEPTH}", statement.depth.span)


def _check_open_port(context: Context, statement: tree.OpenPort) -> None:
    _check_number(context, statement.file, statement.span)
    if statement.port.upper() not in PORTS:
        message = f"{quoted(statement.port)} is not a port: a Processor has PORTA and PORTB"
        context.report("AMX4117", message, statement.span)
    if statement.setup is not None:
        check_integer(context, statement.setup, "AMX2009", "SETUP")
    if statement.baud is not None:
        check_integer(context, statement.baud, "AMX2009", "the baud rate")


def _check_number(context: Context, number: int, span: Span) -> bool:
    if 1 <= number <= MAX_FILE:
        return True
    context.report("AMX4112", f"#{number} is not #1 to #{MAX_FILE}", context.place_of(str(number), span))
    return False


def _file(context: Context, number: int, span: Span) -> OpenedFile | None:
    """Return the file of a number; a number that nothing opens is reported."""
    opened = context.files.get(number)
    if opened is None and _check_number(context, number, span) and "OPEN" not in context.broken.words:
        hint = f"for example OPEN CHANNEL FOR INPUT AS FILE #{number}, TYPE = (I), DEPTH = 8"
        context.report("AMX4113", f"the task does not open #{number}", span, hint)
    return opened


def _port(context: Context, number: int, span: Span, word: str) -> OpenedFile | None:
    opened = _file(context, number, span)
    if opened is not None and opened.direction is not None:
        hint = "channels are never closed" if word == "CLOSE" else "messages pass through INPUT and PRINT"
        context.report("AMX4116", f"{word} needs a port, #{number} is {opened.words}", span, hint)
        return None
    return opened


def _check_input(context: Context, statement: tree.InputFile) -> None:
    kinds = [check_written(context, target) for target in statement.targets]
    opened = _file(context, statement.file, statement.span)
    if opened is None:
        return
    if opened.direction is tree.Direction.OUTPUT:
        context.report("AMX4116", f"INPUT cannot be: #{statement.file} is {opened.words}", statement.span)
    elif opened.direction is tree.Direction.INPUT:
        if _count_agrees(context, statement.file, opened, len(kinds), statement.span):
            for target, kind, item in zip(statement.targets, kinds, opened.types, strict=True):
                if kind is not None and not assignable(kind, item):
                    message = f"an item of #{statement.file} is {item.word}, {target.name} is {kind.word}"
                    context.report("AMX4115", message, target.span)
    else:
        _warn_of_port(context, statement, "INPUT")


def _check_get(context: Context, statement: tree.Get) -> None:
    kind = check_written(context, statement.target)
    if kind is not None and kind is not DataType.STRING:
        message = f"GET gives a character, {statement.target.name} is {kind.word}"
        context.report("AMX4115", message, statement.target.span, "a string variable takes it: GET #1, A$")
    if _port(context, statement.file, statement.span, "GET") is not None:
        _warn_of_port(context, statement, "GET")


def _warn_of_port(context: Context, statement: tree.InputFile | tree.Get, word: str) -> None:
    if statement.empty is None:
        message = f"{word} waits for ever: nothing is connected to a port of the emulator"
        context.report("AMX4120", message, statement.span, f"write {word}:EMPTY=line to go on")


def _check_print(context: Context, statement: tree.PrintFile) -> None:
    kinds = [check_expression(context, item) for item in statement.items]
    opened = _file(context, statement.file, statement.span)
    if opened is None:
        return
    if opened.direction is None:
        if statement.full is not None:
            message = f"FULL= belongs to a channel, #{statement.file} is {opened.words}"
            context.report("AMX4116", message, statement.span)
    elif opened.direction is tree.Direction.INPUT:
        context.report("AMX4116", f"PRINT cannot be: #{statement.file} is {opened.words}", statement.span)
    elif _count_agrees(context, statement.file, opened, len(kinds), statement.span):
        for item, kind, wanted in zip(statement.items, kinds, opened.types, strict=True):
            if kind is not None and not assignable(wanted, kind):
                message = f"an item of #{statement.file} is {wanted.word}, this is {kind.word}"
                context.report("AMX4115", message, item.span)


def _count_agrees(context: Context, number: int, opened: OpenedFile, count: int, span: Span) -> bool:
    if count == len(opened.types):
        return True
    message = f"a message of #{number} has {len(opened.types)} items, here {count}"
    context.report("AMX4115", message, span)
    return False


def _check_put(context: Context, statement: tree.Put) -> None:
    kind = check_expression(context, statement.item)
    if kind is not None and kind is not DataType.STRING:
        context.report("AMX4115", f"PUT writes a string, not {kind.word}", statement.item.span, "CHR$(n), STR$(x)")
    _port(context, statement.file, statement.span, "PUT")


_CHECKS: dict[type[object], Callable[[Context, Any], object]] = {
    tree.SetEvent: _check_set,
    tree.WaitOn: _check_event,
    tree.Delay: _check_time,
    tree.StartEvery: _check_time,
    tree.OpenChannel: _check_open_channel,
    tree.OpenPort: _check_open_port,
    tree.Close: lambda context, it: _port(context, it.file, it.span, "CLOSE"),
    tree.InputFile: _check_input,
    tree.Get: _check_get,
    tree.PrintFile: _check_print,
    tree.Put: _check_put,
}
