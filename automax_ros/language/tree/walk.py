"""Walks over a syntax tree, shared by the checker's parts."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from automax_ros.language.tree.basic_tree import (
    Delay,
    Get,
    InputFile,
    OpenChannel,
    OpenPort,
    PrintFile,
    Put,
    StartEvery,
)
from automax_ros.language.tree.tree import (
    Argument,
    Assignment,
    Binary,
    Call,
    Element,
    Expression,
    For,
    FunctionCall,
    Gosub,
    Goto,
    If,
    IoWrite,
    OnJump,
    Print,
    Read,
    Reference,
    Statement,
    Target,
    Unary,
)


def statements_in_order(
    statements: Iterable[Statement], line: int | None = None
) -> Iterator[tuple[Statement, int | None]]:
    """Yield every statement, those inside IF and FOR included, in the order of the text, with the line number in force.

    ``line`` is the number in force before the first statement.
    """
    for statement in statements:
        line = line if statement.number is None else statement.number
        yield statement, line
        for body in bodies(statement):
            for inner, inner_line in statements_in_order(body, line):
                yield inner, inner_line
                line = inner_line


def bodies(statement: Statement) -> tuple[tuple[Statement, ...], ...]:
    """Return the statement lists inside a statement: THEN and ELSE of an IF, the body of a FOR."""
    if isinstance(statement, If):
        return statement.then, statement.otherwise
    if isinstance(statement, For):
        return (statement.body,)
    return ()


def expressions_of(statement: Statement) -> tuple[Expression, ...]:
    """Return the expressions of a BASIC statement itself, without those of statements inside it; targets count too."""
    if isinstance(statement, Assignment):
        return statement.target, statement.value
    if isinstance(statement, If):
        return (statement.condition,)
    if isinstance(statement, For):
        step = () if statement.step is None else (statement.step,)
        return (statement.variable, statement.start, statement.stop, *step)
    if isinstance(statement, OnJump):
        return (statement.selector,)
    if isinstance(statement, Read):
        return statement.targets
    if isinstance(statement, Print):
        return statement.items
    if isinstance(statement, IoWrite):
        return statement.slot, statement.register, statement.value
    return _expressions_of_waiting(statement)


def _expressions_of_waiting(statement: Statement) -> tuple[Expression, ...]:
    if isinstance(statement, (Delay, StartEvery)):
        return (statement.count,)
    if isinstance(statement, OpenChannel):
        return () if statement.depth is None else (statement.depth,)
    if isinstance(statement, OpenPort):
        return tuple(part for part in (statement.setup, statement.baud) if part is not None)
    if isinstance(statement, InputFile):
        return statement.targets
    if isinstance(statement, PrintFile):
        return statement.items
    if isinstance(statement, Get):
        return (statement.target,)
    return (statement.item,) if isinstance(statement, Put) else ()


def targets_of(statement: Statement) -> tuple[Target, ...]:
    """Return the variables and elements that a BASIC statement writes."""
    if isinstance(statement, (Assignment, Get)):
        return (statement.target,)
    if isinstance(statement, (Read, InputFile)):
        return statement.targets
    return (statement.variable,) if isinstance(statement, For) else ()


def jumps_of(statement: Statement) -> tuple[int, ...]:
    """Return the lines to which a statement itself may jump, without those of statements inside it."""
    if isinstance(statement, (Goto, Gosub)):
        return (statement.line,)
    if isinstance(statement, OnJump):
        return statement.lines
    line = None
    if isinstance(statement, (InputFile, Get)):
        line = statement.empty
    elif isinstance(statement, PrintFile):
        line = statement.full
    return () if line is None else (line,)


def parts(expression: Expression) -> Iterator[Expression]:
    """Yield an expression and everything inside it, in the order of the text."""
    pending = [expression]
    while pending:
        current = pending.pop()
        yield current
        if isinstance(current, Binary):
            pending += [current.right, current.left]
        elif isinstance(current, Unary):
            pending.append(current.operand)
        elif isinstance(current, Element):
            pending += reversed(current.subscripts)
        elif isinstance(current, FunctionCall):
            pending += reversed(current.arguments)


def variables_in(expression: Expression) -> Iterator[Reference | Element]:
    """Yield the variables and elements inside an expression, in the order of the text."""
    for part in parts(expression):
        if isinstance(part, (Reference, Element)):
            yield part


def arguments_of(statement: Statement) -> tuple[Argument, ...]:
    """Return the parameters of a CALL, () for other statements."""
    return statement.arguments if isinstance(statement, Call) else ()
