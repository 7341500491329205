"""Finds the parts of a task: the part before SCAN_LOOP, SCAN_LOOP itself, and the scan up to END (section 4)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from automax_ros.core.diagnostics import Note, Span
from automax_ros.language.checks.rules.context import Context
from automax_ros.language.tree.task_kind import TaskKind
from automax_ros.language.tree.tree import Call, End, Label, Module, Remark, Statement
from automax_ros.language.tree.walk import bodies, statements_in_order


@dataclass(frozen=True)
class TaskLayout:
    """The parts of a task. Without a SCAN_LOOP everything counts as scan, so that it is checked as such."""

    startup: tuple[Statement, ...]
    scan_loop: Call | None
    scan: tuple[Statement, ...]
    scan_loop_line: int | None = None

    def numbered(self) -> Iterator[tuple[Statement, int | None, bool]]:
        """Yield every statement but SCAN_LOOP with the line number in force, and whether it is after SCAN_LOOP."""
        for statement, line in statements_in_order(self.startup):
            yield statement, line, False
        for statement, line in statements_in_order(self.scan, self.scan_loop_line):
            yield statement, line, self.scan_loop is not None


def find_layout(context: Context, module: Module) -> TaskLayout:
    """Split a task at its SCAN_LOOP and report the faults of SCAN_LOOP and END; a BASIC task has only one part."""
    loops = [
        (statement, line)
        for statement, line in statements_in_order(module.statements)
        if isinstance(statement, Call) and (block := context.catalogue.get(statement.block)) and block.begins_scan
    ]
    if context.kind is TaskKind.BASIC:
        layout = TaskLayout((), None, module.statements)
        _check_ends(context, module, layout)
        return layout
    _check_scan_loops(context, module, loops)
    layout = _split(module, loops)
    _check_blocks_before(context, layout)
    _check_ends(context, module, layout)
    return layout


def _split(module: Module, loops: list[tuple[Call, int | None]]) -> TaskLayout:
    statements = module.statements
    if not loops:
        return TaskLayout((), None, statements)
    call, line = loops[0]
    at = next(index for index, item in enumerate(statements) if _contains(item, call))
    return TaskLayout(statements[:at], call, statements[at + 1 :], line)


def _contains(statement: Statement, wanted: Call) -> bool:
    return any(inner is wanted for inner, _ in statements_in_order((statement,)))


def _check_scan_loops(context: Context, module: Module, loops: list[tuple[Call, int | None]]) -> None:
    if not loops:
        if not context.is_broken(block for block in context.catalogue.values() if block.begins_scan):
            context.line = None
            context.report(
                "AMX4040",
                "the task has no SCAN_LOOP block",
                _end_of_text(module),
                "every Control Block task needs CALL SCAN_LOOP(TICKS=n) after its declarations",
            )
        return
    first, _ = loops[0]
    context.scan_block = first.block
    top = {id(statement) for statement in module.statements}
    for call, line in loops:
        context.line = line
        if call.block != first.block:
            note = Note(f"{first.block} is here", first.span)
            message = f"a task with {first.block} has no {call.block}"
            context.report("AMX4180", message, call.span, "make them two tasks", (note,))
        elif call is not first:
            note = Note(f"the first {call.block} is here", first.span)
            context.report("AMX4041", f"a task has only one {call.block}", call.span, notes=(note,))
        elif id(call) not in top and not context.broken.blocks:
            context.report("AMX4043", f"{call.block} stands inside an IF or FOR block", call.span)


def _check_blocks_before(context: Context, layout: TaskLayout) -> None:
    if layout.scan_loop is None:
        return
    name = context.scan_block
    for statement, line in statements_in_order(layout.startup):
        if isinstance(statement, Call):
            context.line = line
            note = Note(f"{name} is here", layout.scan_loop.span)
            message = f"{statement.block} is called before {name}, which must be the first block"
            context.report("AMX4042", message, statement.span, f"move the block after {name}", (note,))


def _check_ends(context: Context, module: Module, layout: TaskLayout) -> None:
    for statement, line in statements_in_order(layout.startup):
        if isinstance(statement, End):
            context.line = line
            context.report(
                "AMX4046",
                f"END stands before {context.scan_block}",
                statement.span,
                "END marks the end of the scan; STOP ends a task",
            )
    if context.broken.blocks and isinstance(_last(module), End):
        return
    at = next((index for index, item in enumerate(layout.scan) if isinstance(item, End)), None)
    if at is None:
        if "END" not in context.broken.words and not any(isinstance(item, End) for item in layout.startup):
            context.line = None
            context.report(
                "AMX4044", "the task has no END", _end_of_text(module), "the last statement of a task is END"
            )
        return
    following = [item for item in layout.scan[at + 1 :] if not isinstance(item, (Remark, Label))]
    if following:
        context.line = following[0].number
        early = "the task's run early" if context.kind is TaskKind.BASIC else "a scan early"
        context.report(
            "AMX4045",
            "nothing may follow END",
            following[0].span,
            f"END is the last statement; subroutines stand before it, and IF ... THEN END ends {early}",
            (Note("END is here", layout.scan[at].span),),
        )


def _end_of_text(module: Module) -> Span:
    last = _last(module)
    return Span(1, 1, 2) if last is None else last.span


def _last(module: Module) -> Statement | None:
    """Return the last statement of the text, which may be inside a block."""
    last = module.statements[-1] if module.statements else None
    while last is not None and any(bodies(last)):
        last = [body for body in bodies(last) if body][-1][-1]
    return last
