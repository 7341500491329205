"""Checks of the flow of a task: targets of jumps, statements that are never reached (section 4, semantics BASIC)."""

from __future__ import annotations

import enum
from collections.abc import Iterator
from dataclasses import dataclass

from automax_ros.core.diagnostics import Note, Span
from automax_ros.language.checks.rules.context import Context, TaskLayout
from automax_ros.language.tree import tree
from automax_ros.language.tree.walk import bodies, jumps_of

_IDLE = (tree.Remark, tree.Data, tree.Declaration, tree.Event, tree.Label)
"""Statements that do nothing when they are reached."""


class Region(enum.Enum):
    """The part of a task to which a line belongs."""

    STARTUP = "before SCAN_LOOP"
    LOOP = "the beginning of the scan"
    SCAN = "the scan"


@dataclass(frozen=True)
class Place:
    """The place of a statement: ``blocks`` are the IF and FOR bodies around it, outermost first."""

    region: Region
    blocks: tuple[int, ...]
    statement: tree.Statement


@dataclass(frozen=True)
class Jump:
    """A line to which a statement may jump."""

    line: int
    place: Place
    number: int | None
    verb: str


def check_flow(context: Context, layout: TaskLayout) -> None:
    """Report impossible jumps, RESTOREs without DATA, and statements that are never reached.

    Where a wrong jump, or one on a line that could not be read, should lead is not known; then nothing counts as never
    reached.
    """
    places, jumps = _collect(layout)
    before = len(context.diagnostics)
    for jump in jumps:
        context.line = jump.number
        _check_jump(context, jump, places)
    jumps_are_good = len(context.diagnostics) == before and not context.broken.words
    _check_returns(context, layout)
    _check_restores(context, layout, places)
    if jumps_are_good:
        targets = frozenset(jump.line for jump in jumps)
        _check_reached(context, layout.startup, targets, None)
        _check_reached(context, _up_to_end(layout.scan), targets, layout.scan_loop_line)


def _collect(layout: TaskLayout) -> tuple[dict[int, Place], list[Jump]]:
    places: dict[int, Place] = {}
    jumps: list[Jump] = []
    if layout.scan_loop is not None and layout.scan_loop_line is not None:
        places[layout.scan_loop_line] = Place(Region.LOOP, (), layout.scan_loop)
    parts = ((Region.STARTUP, layout.startup, None), (Region.SCAN, layout.scan, layout.scan_loop_line))
    for region, part, first_line in parts:
        line = first_line
        for statement, blocks in _place_statements(part, ()):
            place = Place(region, blocks, statement)
            if statement.number is not None:
                line = statement.number
                places.setdefault(line, place)
            jumps.extend(Jump(target, place, line, verb) for target, verb in _targets(statement))
    return places, jumps


def _place_statements(
    statements: tuple[tree.Statement, ...], blocks: tuple[int, ...]
) -> Iterator[tuple[tree.Statement, tuple[int, ...]]]:
    for statement in statements:
        yield statement, blocks
        for body in bodies(statement):
            yield from _place_statements(body, (*blocks, id(body)))


def _targets(statement: tree.Statement) -> list[tuple[int, str]]:
    if isinstance(statement, tree.Goto):
        return [(statement.line, "GOTO")]
    if isinstance(statement, tree.Gosub):
        return [(statement.line, "GOSUB")]
    if isinstance(statement, tree.OnJump):
        verb = "ON ... GOSUB" if statement.gosub else "ON ... GOTO"
        return [(line, verb) for line in statement.lines]
    if isinstance(statement, tree.PrintFile):
        return [(line, "FULL =") for line in jumps_of(statement)]
    return [(line, "EMPTY =") for line in jumps_of(statement)]


def _check_jump(context: Context, jump: Jump, places: dict[int, Place]) -> None:
    span = context.place_of(str(jump.line), jump.place.statement.span)
    place = places.get(jump.line)
    if place is None:
        if jump.line not in context.broken.numbers:
            context.report("AMX4047", f"there is no line {jump.line} to go to", span, _near_line(jump.line, places))
        return
    note = (Note(f"line {jump.line} is here", place.statement.span),)
    if isinstance(place.statement, tree.Declaration):
        context.report("AMX4051", f"line {jump.line} declares variables: nothing is executed there", span, notes=note)
    elif place.region is Region.LOOP or (place.region is Region.STARTUP and _ends_at_scan_loop(jump)):
        where = f"{'is' if place.region is Region.LOOP else 'lies before'} {context.scan_block}"
        hint = f"END goes back to {context.scan_block} by itself; what lies before it runs once"
        if jump.place.region is Region.STARTUP:
            hint = f"what lies before {context.scan_block} runs down to it; FOR repeats, IF ... END_IF leaves out"
        context.report("AMX4048", f"{jump.verb} {jump.line} cannot be: the line {where}", span, hint, note)
    elif place.region is not jump.place.region:
        message = f"{jump.verb} {jump.line} would jump over {context.scan_block}"
        context.report("AMX4049", message, span, f"what lies before {context.scan_block} runs down to it", note)
    elif jump.place.blocks[: len(place.blocks)] != place.blocks and not context.broken.blocks:
        context.report("AMX4050", f"{jump.verb} {jump.line} would jump into an IF or FOR block", span, notes=note)


def _ends_at_scan_loop(jump: Jump) -> bool:
    """Return whether a line before SCAN_LOOP is out of reach: for GOTO from anywhere, for GOSUB from the scan."""
    return not jump.verb.endswith("GOSUB") or jump.place.region is Region.SCAN


def _near_line(line: int, places: dict[int, Place]) -> str | None:
    following = min((number for number in places if number > line), default=None)
    return None if following is None else f"the next line is {following}"


def _check_returns(context: Context, layout: TaskLayout) -> None:
    statements = list(layout.numbered())
    if "GOSUB" in context.broken.words or any(
        isinstance(item, tree.Gosub) or (isinstance(item, tree.OnJump) and item.gosub) for item, _, _ in statements
    ):
        return
    for statement, line, _ in statements:
        if isinstance(statement, tree.Return):
            context.line = line
            context.report("AMX4055", "RETURN in a task without GOSUB", statement.span)


def _check_restores(context: Context, layout: TaskLayout, places: dict[int, Place]) -> None:
    data = [line or 0 for line, _ in context.data]
    for statement, line, _ in layout.numbered():
        if not isinstance(statement, tree.Restore) or "DATA" in context.broken.words:
            continue
        context.line = line
        if not data:
            context.report("AMX4052", "RESTORE in a task without DATA", statement.span)
        elif statement.line is not None and statement.line not in places:
            if statement.line not in context.broken.numbers:
                hint = _near_line(statement.line, places)
                context.report("AMX4047", f"there is no line {statement.line} to RESTORE to", statement.span, hint)
        elif statement.line is not None and statement.line > max(data):
            message = f"there is no DATA in line {statement.line} or after it"
            context.report("AMX4052", message, statement.span, f"the last DATA is in line {max(data)}")


def _check_reached(
    context: Context, statements: tuple[tree.Statement, ...], targets: frozenset[int], line: int | None
) -> int | None:
    """Report the first statement of each unreachable sequence; return the line number in force at the end."""
    ended: Span | None = None
    for statement in statements:
        line = line if statement.number is None else statement.number
        if statement.number in targets:
            ended = None
        if ended is not None and not isinstance(statement, _IDLE):
            context.line = line
            note = Note("the task always leaves here", ended)
            context.report("AMX4054", "this statement is never reached", statement.span, notes=(note,))
            ended = None
        for body in bodies(statement):
            line = _check_reached(context, body, targets, line)
        if _leaves(statement, targets):
            ended = statement.span
    return line


def _up_to_end(statements: tuple[tree.Statement, ...]) -> tuple[tree.Statement, ...]:
    """Return the statements before END; those after it are a separate error."""
    at = next((index for index, item in enumerate(statements) if isinstance(item, tree.End)), len(statements))
    return statements[:at]


def _leaves(statement: tree.Statement, targets: frozenset[int]) -> bool:
    """Return whether the statement that follows can only be reached by a jump."""
    if isinstance(statement, tree.If):
        return all(_body_leaves(body, targets) for body in (statement.then, statement.otherwise))
    return isinstance(statement, (tree.Goto, tree.Stop, tree.Return, tree.End))


def _body_leaves(body: tuple[tree.Statement, ...], targets: frozenset[int]) -> bool:
    """Return whether the end of an IF's branch is never reached."""
    for statement in reversed(body):
        if _leaves(statement, targets):
            return True
        if not isinstance(statement, _IDLE) or statement.number in targets:
            return False
    return False
