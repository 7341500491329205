"""The manual's WARNING in 3.3: a block and a BASIC statement of one task that use the same latched common."""

from __future__ import annotations

from automax_ros.core.diagnostics import Note, Span
from automax_ros.language.checks.rules.context import Context
from automax_ros.language.checks.rules.task_layout import TaskLayout
from automax_ros.language.tree.tree import Call
from automax_ros.language.tree.walk import arguments_of, expressions_of, variables_in

Use = tuple[Span, "int | None"]


def check_sharing(context: Context, layout: TaskLayout) -> None:
    """Warn once for every latched common that blocks and BASIC statements of the scan both use.

    Statements before SCAN_LOOP do not count: they run before the first latch, and the manual places them there.
    """
    by_blocks: dict[str, Use] = {}
    by_basic: dict[str, Use] = {}
    for statement, line, after in layout.numbered():
        if not after:
            continue
        if isinstance(statement, Call):
            expressions = tuple(argument.value for argument in arguments_of(statement))
            uses = by_blocks
        else:
            expressions, uses = expressions_of(statement), by_basic
        for expression in expressions:
            for variable in variables_in(expression):
                uses.setdefault(variable.name, (variable.span, line))
    for name, (span, line) in by_basic.items():
        symbol = context.symbols.get(name)
        if symbol is None or not symbol.latched or name not in by_blocks:
            continue
        block_span, block_line = by_blocks[name]
        context.line = line
        context.report(
            "AMX4086",
            f"{name} is used by BASIC in line {line} and by a block in line {block_line}",
            span,
            "blocks see the value latched at the start of the scan, BASIC the present one (3.3)",
            (Note("the block is here", block_span),),
        )
