"""Walks over a syntax tree, shared by the checker's parts."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from automax_ros.language.tree import tree


def statements_in_order(
    statements: Iterable[tree.Statement], line: int | None = None
) -> Iterator[tuple[tree.Statement, int | None]]:
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


def bodies(statement: tree.Statement) -> tuple[tuple[tree.Statement, ...], ...]:
    """Return the statement lists inside a statement: THEN and ELSE of an IF, the body of a FOR."""
    if isinstance(statement, tree.If):
        return statement.then, statement.otherwise
    if isinstance(statement, tree.For):
        return (statement.body,)
    return ()


_EXPRESSIONS: dict[type[tree.Statement], tuple[str, ...]] = {
    tree.Assignment: ("target", "value"),
    tree.If: ("condition",),
    tree.For: ("variable", "start", "stop", "step"),
    tree.OnJump: ("selector",),
    tree.Read: ("targets",),
    tree.Print: ("items",),
    tree.IoWrite: ("slot", "register", "value"),
    tree.Delay: ("count",),
    tree.StartEvery: ("count",),
    tree.OpenChannel: ("depth",),
    tree.OpenPort: ("setup", "baud"),
    tree.InputFile: ("targets",),
    tree.PrintFile: ("items",),
    tree.Get: ("target",),
    tree.Put: ("item",),
}
"""The fields of BASIC statements with expressions, in the order of the text; targets count too."""
_WRITTEN = ("target", "targets", "variable")
"""The fields with the variables and elements that a statement writes."""


def expressions_of(statement: tree.Statement) -> tuple[tree.Expression, ...]:
    """Return the expressions of a BASIC statement itself, without those of statements inside it; targets count too."""
    found: list[tree.Expression] = []
    for name in _EXPRESSIONS.get(type(statement), ()):
        value = getattr(statement, name)
        found += value if isinstance(value, tuple) else () if value is None else (value,)
    return tuple(found)


def targets_of(statement: tree.Statement) -> tuple[tree.Target, ...]:
    """Return the variables and elements that a BASIC statement writes."""
    name = _EXPRESSIONS.get(type(statement), ("",))[0]
    if name not in _WRITTEN:
        return ()
    value: tree.Target | tuple[tree.Target, ...] = getattr(statement, name)
    return value if isinstance(value, tuple) else (value,)


def jumps_of(statement: tree.Statement) -> tuple[int, ...]:
    """Return the lines to which a statement itself may jump, without those of statements inside it."""
    if isinstance(statement, (tree.Goto, tree.Gosub)):
        return (statement.line,)
    if isinstance(statement, tree.OnJump):
        return statement.lines
    line = None
    if isinstance(statement, (tree.InputFile, tree.Get)):
        line = statement.empty
    elif isinstance(statement, tree.PrintFile):
        line = statement.full
    return () if line is None else (line,)


def parts(expression: tree.Expression) -> Iterator[tree.Expression]:
    """Yield an expression and everything inside it, in the order of the text."""
    pending = [expression]
    while pending:
        current = pending.pop()
        yield current
        if isinstance(current, tree.Binary):
            pending += [current.right, current.left]
        elif isinstance(current, tree.Unary):
            pending.append(current.operand)
        elif isinstance(current, tree.Element):
            pending += reversed(current.subscripts)
        elif isinstance(current, tree.FunctionCall):
            pending += reversed(current.arguments)


def variables_in(expression: tree.Expression) -> Iterator[tree.Reference | tree.Element]:
    """Yield the variables and elements inside an expression, in the order of the text."""
    for part in parts(expression):
        if isinstance(part, (tree.Reference, tree.Element)):
            yield part


def arguments_of(statement: tree.Statement) -> tuple[tree.Argument, ...]:
    """Return the parameters of a CALL, () for other statements."""
    return statement.arguments if isinstance(statement, tree.Call) else ()
