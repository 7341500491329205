"""Which commons a checked task can write, and where: by BASIC statements and by the outputs of blocks."""

from __future__ import annotations

from automax_ros.core.diagnostics import Span
from automax_ros.language.program import Program
from automax_ros.language.syntax.tree import Call, Element, Expression, Reference, Scope
from automax_ros.language.syntax.walk import statements_in_order, targets_of

Place = tuple[int, Span]
"""The BASIC line, and where the variable stands in the text."""


def places_that_write(program: Program, scope: Scope = Scope.COMMON) -> dict[str, list[Place]]:
    """Return where each common, or local, that the task can write is written, in the order of the text."""
    found: dict[str, list[Place]] = {}

    def note(target: Expression | None, line: int | None) -> None:
        if not isinstance(target, (Reference, Element)) or line is None:
            return
        symbol = program.symbols.get(target.name)
        if symbol is not None and symbol.scope is scope:
            found.setdefault(symbol.name, []).append((line, target.span))

    if program.cml is not None:
        for given in program.cml.targets:
            note(given, program.cml.line)
    for statement, line in statements_in_order((*program.startup, *program.scan)):
        for target in targets_of(statement):
            note(target, line)
        if isinstance(statement, Call) and statement.span in program.calls:
            bound = program.calls[statement.span]
            for output in bound.block.outputs:
                note(bound.arguments.get(output.name), bound.line)
    return found


def lines_that_write(program: Program) -> dict[str, tuple[int, ...]]:
    """Return the BASIC lines that can write each common of a task, each once, in the order of the text."""
    return {
        name: tuple(dict.fromkeys(line for line, _ in places)) for name, places in places_that_write(program).items()
    }
