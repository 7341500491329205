"""The checker: from the text of a task to a checked Program, or to all its faults in one pass."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, field

from automax_ros.blocks.declare.declaration import Block, Platform
from automax_ros.core.diagnostics import Diagnostic, Note, SourceText, Span, has_errors, in_order
from automax_ros.core.ticks import DEFAULT_TICK_NS
from automax_ros.language.checks.calls.calls import check_call, check_scan_loop, event_name
from automax_ros.language.checks.calls.data_structures import find_structures
from automax_ros.language.checks.rules.basic_statements import check_waiting, find_files
from automax_ros.language.checks.rules.context import Context, TaskLayout, broken_lines
from automax_ros.language.checks.rules.declarations import check_declarations, check_storage
from automax_ros.language.checks.rules.flow import check_flow
from automax_ros.language.checks.rules.statements import check_reads, check_statement, data_pool
from automax_ros.language.checks.rules.unconfirmed import find_unconfirmed
from automax_ros.language.parse.parser import parse
from automax_ros.language.program import BoundCall, CommonSpec, Program
from automax_ros.language.text.reporter import DIAGNOSTIC_LIMIT, TooManyProblemsError
from automax_ros.language.tree.task_kind import TaskKind, kind_of_source
from automax_ros.language.tree.tree import Call, Declaration, End, Label, Module, Read, Remark, Statement
from automax_ros.language.tree.walk import arguments_of, bodies, expressions_of, statements_in_order, variables_in

Use = tuple[Span, "int | None"]
AUTOMAX = Platform.AUTOMAX
_TOO_LARGE, _TOO_MANY, _UTF_16 = "AMX0001", "AMX0002", "AMX0006"
_NOT_READ = (_TOO_LARGE, _TOO_MANY, _UTF_16)
"""Findings of the parser after which the tree is not the whole task."""


@dataclass(frozen=True)
class CheckResult:
    """The result of a check. ``program`` is None if there are errors; ``diagnostics`` are in the order of the text.

    ``unconfirmed`` are the places at which the task uses a form that no source confirms, with a description of the
    form.
    """

    program: Program | None
    diagnostics: list[Diagnostic] = field(default_factory=list)
    unconfirmed: list[tuple[Span, str]] = field(default_factory=list)


def check(
    source: SourceText,
    *,
    name: str,
    catalogue: Mapping[str, Block],
    target: Platform = AUTOMAX,
    tick_ns: int = DEFAULT_TICK_NS,
    commons: Mapping[str, CommonSpec] | None = None,
) -> CheckResult:
    """Check a task; never raises, whatever the text. The source's name says whether it is a BASIC task.

    ``name`` is the task's name, ``catalogue`` the blocks by name, ``tick_ns`` the tick in ns. ``commons`` are those of
    the rack by full name: a COMMON that the rack lacks or defines differently is an error, and so is a write to an
    input point. With None the task's declarations are the definition.

    At most DIAGNOSTIC_LIMIT problems are reported, and one more that says so.
    """
    module, found = parse(source)
    if any(item.code in _NOT_READ for item in found):
        return CheckResult(None, in_order(found))
    context = Context(
        target, tick_ns, catalogue, commons, source.lines, broken_lines(source, found), diagnostics=list(found)
    )
    context.kind = kind_of_source(source.name)
    layout = None
    try:
        layout = _check_module(context, module)
    except TooManyProblemsError:
        message = f"more than {DIAGNOSTIC_LIMIT} problems: the rest of the text is not checked"
        context.diagnostics.append(Diagnostic(_TOO_MANY, message, context.diagnostics[-1].span, context.line))
    diagnostics = in_order(context.diagnostics)
    unconfirmed = find_unconfirmed(module, context.kind)
    if layout is None or has_errors(diagnostics):
        return CheckResult(None, diagnostics, unconfirmed)
    return CheckResult(_program(context, layout, name, source), diagnostics, unconfirmed)


def _check_module(context: Context, module: Module) -> TaskLayout:
    layout = _find_layout(context, module)
    check_declarations(context, layout)
    find_structures(context, layout)
    find_files(context, layout)
    if layout.scan_loop is not None:
        context.line = layout.scan_loop_line
        check_scan_loop(context, layout.scan_loop)
    reads: list[tuple[Read, int | None]] = []
    for statement, line, _ in layout.numbered():
        context.line = line
        if isinstance(statement, Call) and context.kind is TaskKind.BASIC:
            hint = "control blocks run in control-block tasks (.BLK), which scan"
            context.report("AMX4111", f"a BASIC task calls no block: {statement.block}", statement.span, hint)
        elif isinstance(statement, Call):
            check_call(context, statement)
        else:
            check_statement(context, statement)
            check_waiting(context, statement)
            if isinstance(statement, Read):
                reads.append((statement, line))
    check_storage(context)
    check_reads(context, reads)
    check_flow(context, layout)
    _check_sharing(context, layout)
    _check_expected_blocks(context, layout)
    _check_dynamic_blocks(context, layout)
    return layout


def _check_expected_blocks(context: Context, layout: TaskLayout) -> None:
    """Warn of a task without a block that its Processor expects: on a UDC the one that protects the motor (36)."""
    loop = layout.scan_loop
    expected = [block for block in context.catalogue.values() if context.target in block.expected_on]
    if loop is None or not expected:
        return
    calls = {statement.block for statement, _, _ in layout.numbered() if isinstance(statement, Call)}
    context.line = layout.scan_loop_line
    for block in expected:
        if block.name not in calls and not context.is_broken([block]):
            context.report("AMX4097", f"the task has no {block.name} block", loop.span, block.expected_since)


def _check_dynamic_blocks(context: Context, layout: TaskLayout) -> None:
    """Report blocks whose coefficients need a constant scan period in a task that follows an AC line."""
    begins = context.catalogue.get(context.scan_block)
    if begins is None or begins.line_scan is None:
        return
    for statement, line, _ in layout.numbered():
        block = context.catalogue.get(statement.block) if isinstance(statement, Call) else None
        if block is not None and block.coefficients is not None:
            context.line = line
            place = context.place_of(block.name, statement.span)
            hint = "its coefficients need a constant scan period: call it in another task"
            context.report("AMX4187", f"a task with {begins.name} has no {block.name}", place, hint)


def _program(context: Context, layout: TaskLayout, name: str, source: SourceText) -> Program:
    data, data_lines = data_pool(context)
    return Program(
        name=name,
        symbols=context.symbols,
        startup=_executable_statements(layout.startup),
        scan=_executable_statements(layout.scan),
        ticks=context.ticks or 0,
        tick_ns=context.tick_ns,
        calls=context.calls,
        data=data,
        data_lines=data_lines,
        events=tuple(context.events.values()),
        event=event_name(layout.scan_loop) if layout.scan_loop is not None else None,
        scan_loop_line=layout.scan_loop_line or 0,
        target=context.target.value,
        source_hash=hashlib.sha256(source.text.encode("utf-8", "surrogatepass")).hexdigest(),
        kind=context.kind,
        files=tuple(context.files.values()),
        cml=_line_call(context, layout),
    )


def _line_call(context: Context, layout: TaskLayout) -> BoundCall | None:
    """Return the CALL that begins the scans in step with an AC line, None where SCAN_LOOP or nothing begins them."""
    bound = None if layout.scan_loop is None else context.calls.get(layout.scan_loop.span)
    return bound if bound is not None and bound.block.line_scan is not None else None


def _executable_statements(statements: tuple[Statement, ...]) -> tuple[Statement, ...]:
    return tuple(statement for statement in statements if not isinstance(statement, Declaration))


def _find_layout(context: Context, module: Module) -> TaskLayout:
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


def _check_sharing(context: Context, layout: TaskLayout) -> None:
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
