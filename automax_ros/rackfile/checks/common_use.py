"""Finds the writers and readers of each common of a rack; checks them: two writers, no writer, no use.

All are warnings, and few of them false (decision). Writes before SCAN_LOOP, and those of a BASIC task that does its
work once and ends, are initialisation: another task may write the common later. Elements of arrays count as separate
unless both tasks name one by constants. If each task writes only constants to a BOOLEAN it is a handshake: one sets
what the other resets. I/O points are wiring: writers of the points that a task reads are not searched for.
What ``meant_so`` of the rack file names is left out (``omissions``).
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

from automax_ros.core.diagnostics import Diagnostic, Span
from automax_ros.core.kinds import Direction
from automax_ros.core.names import PREDEFINED
from automax_ros.language.program import BoundCall, Program
from automax_ros.language.tree.tree import (
    Assignment,
    BooleanLiteral,
    Call,
    Element,
    Expression,
    IntegerLiteral,
    Reference,
    Scope,
    StartEvery,
    Statement,
)
from automax_ros.language.tree.walk import expressions_of, jumps_of, statements_in_order, targets_of, variables_in
from automax_ros.rackfile.model.config import CommonVariable, RackConfig

Finding = tuple[str, Diagnostic]
"""The common, plant or slot that is the matter, and what is said of it."""
_NAMED = 6
"""Most commons that one warning names."""


class _Write(NamedTuple):
    task: str
    target: Reference | Element
    line: int
    is_constant: bool


def writer_findings(config: RackConfig, programs: Mapping[str, Program]) -> dict[str, list[Diagnostic]]:
    """Return the places where a task writes a common that another task writes too (AMX6495), by task."""
    found: dict[str, list[Diagnostic]] = {}
    for task, (name, diagnostic) in written_twice(config, programs):
        if name not in config.meant_so:
            found.setdefault(task, []).append(diagnostic)
    return found


def written_twice(config: RackConfig, programs: Mapping[str, Program]) -> Iterator[tuple[str, Finding]]:
    """Yield the second task of two that write one common, with what is said of it there (AMX6495)."""
    files = {task.name: task.file.name for _, task in config.placed_tasks}
    written: dict[str, list[_Write]] = {}
    for _, task in config.placed_tasks:
        program = programs.get(task.name)
        if program is None or program.target == "udc":  # Its dual port has rules of its own (udc_rules).
            continue
        own: dict[str, list[_Write]] = {}
        for write in _writes(program):
            own.setdefault(write.target.name, []).append(write)
        for name, writes in own.items():
            pair = _common_writes(written.get(name, []), writes)
            if pair is not None:
                first, second = pair
                message = (
                    f"{name} is written here, and in line {first.line} of {files[first.task]} by task {first.task}"
                )
                hint = "the last writer wins: use one task to write it, or give each its own common"
                yield task.name, (name, Diagnostic("AMX6495", message, second.target.span, second.line, hint))
            written.setdefault(name, []).extend(writes)


def never_written(config: RackConfig, programs: Mapping[str, Program]) -> Iterator[Finding]:
    """Yield the commons that tasks read and nothing writes (AMX6496)."""
    files = {task.name: task.file.name for _, task in config.placed_tasks}
    written = _connected_names(config)
    written |= {item.name for item in config.declared if item.direction is Direction.IN or item.preset is not None}
    for program in programs.values():
        written |= {target.name for target, _, _ in _targets(program, (*program.startup, *program.scan))}
    reads: dict[str, tuple[str, int | None]] = {}
    for name, program in programs.items():
        for common, line in reads_of(program):
            reads.setdefault(common, (files[name], line))
    for variable in config.declared:
        read = reads.get(variable.name)
        if read is not None and variable.name not in written and variable.point is None:
            zero = {"BOOLEAN": "FALSE", "STRING": "empty"}.get(variable.type.word, "0")
            place = f"line {read[1]} of {read[0]}"
            message = f"{variable.name} is read in {place}, and no task writes it: it stays {zero}"
            hint = "let a task write it; or write ros: in for what comes from outside, or a preset"
            yield variable.name, Diagnostic("AMX6496", message, first_word(config, variable.line), hint=hint)


def never_used(config: RackConfig, programs: Mapping[str, Program]) -> list[CommonVariable]:
    """Return the commons that no task declares and nothing else uses."""
    declared = {
        symbol.name
        for program in programs.values()
        for symbol in program.symbols.values()
        if symbol.scope is Scope.COMMON
    }
    declared |= _connected_names(config)
    return [item for item in config.declared if programs and item.name not in declared and item.point is None]


def unused_warning(config: RackConfig, unused: Sequence[CommonVariable]) -> Iterator[Diagnostic]:
    """Yield one warning for all commons that nobody uses (AMX6497)."""
    if unused:
        named = [f"{item.name} (line {item.line})" for item in unused[:_NAMED]]
        more = f" and {len(unused) - _NAMED} more" if len(unused) > _NAMED else ""
        what = f"common {named[0]} is" if len(unused) == 1 else f"commons {', '.join(named)}{more} are"
        hint = "take out what is left over; or is a task missing?"
        yield Diagnostic("AMX6497", f"the {what} used by no task", first_word(config, unused[0].line), hint=hint)


def _connected_names(config: RackConfig) -> set[str]:
    return {*PREDEFINED, *(feed.common for feed in config.feeds), *(item.common for item in config.joint_commands)}


def first_word(config: RackConfig, line: int) -> Span:
    """Return the place of the first word in a line of the rack file."""
    text = config.text.split("\n")[line - 1]
    start = len(text) - len(text.lstrip())
    return Span(line, start + 1, start + 1 + len(re.split(r"[\s:]", text[start:])[0]))


def _common_writes(first: list[_Write], second: list[_Write]) -> tuple[_Write, _Write] | None:
    """Return a write of each of two tasks to one variable or element; None if there is none, or for a handshake."""
    if all(item.is_constant for item in (*first, *second)):
        return None
    places = {element: write for write in reversed(first) if (element := _element(write)) is not None}
    return next(((places[element], two) for two in second if (element := _element(two)) in places), None)


def _element(write: _Write) -> tuple[int, ...] | None:
    """Return the subscripts of a write's target, () for a simple variable, None if they are not constants."""
    if isinstance(write.target, Reference):
        return ()  # A block's table is a whole array, and as such an input.
    numbers = [item.value for item in write.target.subscripts if isinstance(item, IntegerLiteral)]
    return tuple(numbers) if len(numbers) == len(write.target.subscripts) else None


def _writes(program: Program) -> Iterator[_Write]:
    """Yield the writes of a task's scans to commons, without initialisation."""
    if program.is_basic and not _repeats(program):
        return
    for target, line, value in _targets(program, program.scan):
        symbol = program.symbols.get(target.name)
        if (
            symbol is not None
            and symbol.scope is Scope.COMMON
            and (isinstance(target, Element) or not symbol.dimensions)
        ):
            yield _Write(program.name, target, line or 0, isinstance(value, BooleanLiteral))


def _targets(
    program: Program, statements: tuple[Statement, ...]
) -> Iterator[tuple[Reference | Element, int | None, Expression | None]]:
    """Yield the targets of statements and of the blocks among them, with the line, and the value of an assignment."""
    if program.cml is not None:
        yield from ((target, program.cml.line, None) for target in _outputs(program.cml))
    for statement, line in statements_in_order(statements):
        value = statement.value if isinstance(statement, Assignment) else None
        yield from ((target, line, value) for target in targets_of(statement))
        if isinstance(statement, Call) and statement.span in program.calls:
            yield from ((target, line, None) for target in _outputs(program.calls[statement.span]))


def _outputs(bound: BoundCall) -> Iterator[Reference | Element]:
    return (target for target in bound.targets if isinstance(target, (Reference, Element)))


def reads_of(program: Program) -> Iterator[tuple[str, int | None]]:
    """Yield the name of each variable that a task reads, with the BASIC line."""
    for bound in program.calls.values():
        outputs = {output.name for output in bound.block.outputs}
        for keyword, value in bound.arguments.items():
            if keyword not in outputs:
                yield from ((variable.name, bound.line) for variable in variables_in(value))
    for event in program.events:
        if event.interrupt_status is not None:
            yield event.interrupt_status.name, event.number
    for statement, line in statements_in_order((*program.startup, *program.scan)):
        targets = targets_of(statement)
        for expression in expressions_of(statement):
            inner = expression.subscripts if isinstance(expression, Element) else ()
            for part in inner if expression in targets else (expression,):
                yield from ((variable.name, line) for variable in variables_in(part))


def _repeats(program: Program) -> bool:
    """Return whether a BASIC task repeats for ever: it jumps back, or starts again by the clock."""
    for statement, line in statements_in_order(program.scan):
        if isinstance(statement, StartEvery) or any(target <= (line or 0) for target in jumps_of(statement)):
            return True
    return False
