"""The flow of control of a task with jumps: basic blocks in one ``while`` on an integer ``pc``.

Blocks are in the order of the source, so that a jump forward and falling through to the next block cost one comparison
each; only a jump back takes another turn of the loop. Many blocks are put into groups, so that a turn finds its block
with few comparisons, however long the task is.
"""

from __future__ import annotations

import ast
from dataclasses import dataclass, field

from automax_ros.compile.base import build
from automax_ros.compile.base.emitter import OVER, Emitter
from automax_ros.compile.base.layout import Role, StateField
from automax_ros.compile.blocks.folding import value_of
from automax_ros.compile.lowering.expressions import Lowered, lower, of_type
from automax_ros.compile.lowering.stores import converted, store
from automax_ros.core.types import DataType
from automax_ros.language.program import Program
from automax_ros.language.tree.tree import (
    Call,
    End,
    For,
    Gosub,
    Goto,
    If,
    Label,
    OnJump,
    Reference,
    Return,
    Scope,
    Statement,
    Stop,
)
from automax_ros.language.tree.walk import bodies, jumps_of, statements_in_order, targets_of

JUMPS = (Goto, Gosub, Return, OnJump, Stop, End)
PC = "pc"
STEPS = "steps"
GROUP = 16
"""Most blocks, or groups of blocks, that are tested one after the other."""


def jump_targets(statements: tuple[Statement, ...]) -> frozenset[int]:
    """Return the line numbers to which the statements jump."""
    lines: set[int] = set()
    for statement in statements:
        lines.update(jumps_of(statement))
        for body in bodies(statement):
            lines |= jump_targets(body)
    return frozenset(lines)


def is_jumping(statement: Statement, targets: frozenset[int]) -> bool:
    """Return whether a statement jumps, is jumped to, or contains such a one: it cannot be straight code."""
    if isinstance(statement, JUMPS) or statement.number in targets:
        return True
    if isinstance(statement, If):
        return any(is_jumping(inner, targets) for inner in (*statement.then, *statement.otherwise))
    if isinstance(statement, For):
        return any(is_jumping(inner, targets) for inner in statement.body)
    return False


def count_statements(statements: tuple[Statement, ...]) -> int:
    """Return the number of statements of a suite, not counting those inside its IF and FOR."""
    return sum(not isinstance(statement, Label) for statement in statements)


def before_end(statements: tuple[Statement, ...]) -> tuple[Statement, ...]:
    """Return the statements before the task's END, after which only remarks come; all if something jumps to those."""
    targets = jump_targets(statements)
    for position, statement in enumerate(statements):
        if isinstance(statement, End):
            jumped_to = any(item.number in targets for item in statements[position:])
            return statements if jumped_to else statements[:position]
    return statements


@dataclass
class Flow:
    """Basic blocks under construction. Block numbers count from 0; the end is the number after the last."""

    blocks: list[list[ast.stmt]] = field(default_factory=list)
    lines: list[int] = field(default_factory=list)
    counts: list[int] = field(default_factory=list)
    labels: dict[int, int] = field(default_factory=dict)
    _to_lines: list[tuple[ast.Constant, int]] = field(default_factory=list)
    _to_end: list[ast.Constant] = field(default_factory=list)

    def begin(self, line: int) -> list[ast.stmt]:
        """Begin a block and return its suite."""
        self.blocks.append([])
        self.lines.append(line)
        self.counts.append(0)
        return self.blocks[-1]

    @property
    def current(self) -> int:
        """Number of the block under construction."""
        return len(self.blocks) - 1

    def count(self) -> None:
        """Count one more statement of the block under construction."""
        self.counts[-1] += 1

    def to_block(self, number: int) -> ast.stmt:
        """Return the statement that goes to a block."""
        return build.assign(PC, build.constant(number))

    def to_next(self) -> ast.stmt:
        """Return the statement that goes to the block that begins next."""
        return self.to_block(self.current + 1)

    def to_line(self, line: int) -> ast.stmt:
        """Return the statement that goes to a BASIC line, already known or not."""
        return build.assign(PC, self.block_of(line))

    def block_of(self, line: int) -> ast.Constant:
        """Return the number of the block of a BASIC line, already known or not."""
        place = ast.Constant(0)
        self._to_lines.append((place, line))
        return place

    def to_end(self) -> ast.stmt:
        """Return the statement that ends the function."""
        place = ast.Constant(0)
        self._to_end.append(place)
        return build.assign(PC, place)

    def later(self) -> ast.Constant:
        """Return a block number to be set by ``here`` once the block is known."""
        return ast.Constant(0)

    def here(self, *places: ast.Constant) -> None:
        """Set block numbers that ``later`` returned to the block under construction."""
        for place in places:
            place.value = self.current

    def assemble(self, limit: int) -> list[ast.stmt]:
        """Return the loop over all blocks from the first on; more than ``limit`` statements raise ScanTooLong."""
        too_long = ast.Raise(build.call("ScanTooLong", build.item("block_lines", build.name(PC))), None)
        return [build.assign(PC, build.constant(0)), self.blocks_loop(limit, [too_long])]

    def blocks_loop(self, limit: int, too_many: list[ast.stmt]) -> ast.stmt:
        """Return the loop over all blocks, which starts at ``pc`` and executes ``too_many`` beyond ``limit``."""
        for place, line in self._to_lines:
            place.value = self.labels[line]
        for place in self._to_end:
            place.value = len(self.blocks)
        turns: list[ast.stmt] = [build.when(build.compare(build.name(STEPS), ">", build.constant(limit)), too_many)]
        turns += _dispatch([self._whole(number) for number in range(len(self.blocks))], 0)
        end = build.constant(len(self.blocks))
        return build.loop(build.compare(build.name(PC), "<>", end), turns)

    def _whole(self, number: int) -> list[ast.stmt]:
        counted = [build.add_to(STEPS, build.constant(self.counts[number]))] if self.counts[number] else []
        return [*counted, *_turning(self.blocks[number], number)]


def _dispatch(blocks: list[list[ast.stmt]], first: int) -> list[ast.stmt]:
    """Return the tests that lead to blocks, the first of which has the number ``first``."""
    pc = build.name(PC)
    if len(blocks) <= GROUP:
        return [
            build.when(build.compare(pc, "=", build.constant(number)), block)
            for number, block in enumerate(blocks, first)
        ]
    size = GROUP
    while size * GROUP < len(blocks):
        size *= GROUP
    return [
        build.when(
            build.compare(pc, "<", build.constant(first + start + size)),
            _dispatch(blocks[start : start + size], first + start),
        )
        for start in range(0, len(blocks), size)
    ]


def _turning(suite: list[ast.stmt], number: int) -> list[ast.stmt]:
    """Return the end of block ``number`` with ``continue`` after each jump that may lead back."""
    last = suite[-1]
    if isinstance(last, ast.If):
        return [*suite[:-1], ast.If(last.test, _turning(last.body, number), _turning(last.orelse, number))]
    if isinstance(last, ast.Return):
        return suite
    assert isinstance(last, ast.Assign)
    forward = isinstance(last.value, ast.Constant) and isinstance(last.value.value, int) and last.value.value > number
    return suite if forward else [*suite, ast.Continue()]


STEP_IS_ZERO = 7027


@dataclass(frozen=True)
class Loop:
    """A loop that has begun: its limit and step are literals or locals named after ``place``, its line.

    A second loop of one line has ``.2`` after the line, and so on. FOR tests at the top; after the loop its variable
    holds the value that failed (decision). An increment that leaves the variable's range is logged, clamped, and ends
    the loop (decision: or it would never end).
    """

    statement: For
    place: str
    stop: ast.expr
    step: ast.expr
    stop_type: DataType
    step_type: DataType
    stop_bounds: tuple[int, int]
    step_bounds: tuple[int, int]

    @property
    def may_be_idle(self) -> bool:
        """Whether the step is known only at run time and may be 0."""
        return value_of(self.step) is None


def begin_loop(emitter: Emitter, statement: For, place: str) -> Loop:
    """Emit the start of a loop: the variable gets its first value, limit and step are evaluated once."""
    prefix = f"for{place.replace('.', '_')}"
    start = lower(emitter, statement.start)
    start = Lowered(emitter.keep(start.node), start.type, start.low, start.high)
    stop = lower(emitter, statement.stop)
    step = Lowered(build.constant(1), DataType.DOUBLE, 1, 1)
    if statement.step is not None:
        step = lower(emitter, statement.step)
    stop_node = _keep(emitter, f"{prefix}_stop", stop.node)
    step_node = _keep(emitter, f"{prefix}_step", step.node)
    store(emitter, statement.variable, start)
    bounds = (stop.low, stop.high), (step.low, step.high)
    loop = Loop(statement, place, stop_node, step_node, stop.type, step.type, *bounds)
    if loop.may_be_idle:
        is_zero = build.compare(step_node, "=", build.constant(0))
        emitter.emit(build.when(is_zero, [emitter.log_call(build.constant(STEP_IS_ZERO))]))
    return loop


def _keep(emitter: Emitter, name: str, node: ast.expr) -> ast.expr:
    if value_of(node) is not None:
        return node
    emitter.emit(build.assign(name, node))
    return build.name(name)


def loop_fields(loop: Loop) -> dict[str, StateField]:
    """Return the state fields of a loop's limit and step, by their Python names."""
    fields = {}
    for word, node, kind in (("stop", loop.stop, loop.stop_type), ("step", loop.step, loop.step_type)):
        if isinstance(node, ast.Name):
            stored = DataType.REAL if kind is DataType.REAL else DataType.DOUBLE
            fields[node.id] = StateField(f"{loop.place} FOR.{word}", stored, Role.STACK, stored.zero)
    return fields


def loop_test(emitter: Emitter, loop: Loop) -> ast.expr:
    """Return the test at the top of a turn; the variable is read as in any BASIC statement."""
    variable = emitter.read(loop.statement.variable.name)
    step = value_of(loop.step)
    if isinstance(step, (int, float)):
        return build.compare(variable, "<=" if step >= 0 else ">=", loop.stop)
    rising = build.compare(loop.step, ">=", build.constant(0))
    return build.choose(rising, build.compare(variable, "<=", loop.stop), build.compare(variable, ">=", loop.stop))


def end_turn(emitter: Emitter, loop: Loop) -> ast.expr | None:
    """Emit NEXT: add the step; return the test whether the sum left the variable's range, None where it cannot."""
    target = loop.statement.variable
    present = of_type(emitter.read(target.name), target.type)
    total = build.binary(present.node, "+", loop.step)
    if DataType.REAL in (target.type, loop.step_type):
        value = Lowered(total, DataType.REAL)
    else:
        value = Lowered(total, DataType.DOUBLE, *_bounds_of_sum(emitter, loop, present))
    before = len(emitter.body)
    node = converted(emitter, target.name, target.type, value)
    overflows = len(emitter.body) > before
    emitter.write(target.name, node)
    return build.name(OVER) if overflows else None


def _bounds_of_sum(emitter: Emitter, loop: Loop, present: Lowered) -> tuple[int, int]:
    """Return the bounds of variable + step; the loop's limit bounds a variable that nothing else sets."""
    low, high = present.low + loop.step_bounds[0], present.high + loop.step_bounds[1]
    if loop.stop_type is not DataType.REAL and counts_alone(emitter.program, loop.statement):
        if loop.step_bounds[0] >= 0:
            high = min(high, loop.stop_bounds[1] + loop.step_bounds[1])
        elif loop.step_bounds[1] < 0:
            low = max(low, loop.stop_bounds[0] + loop.step_bounds[0])
    return low, high


def counts_alone(program: Program, loop: For) -> bool:
    """Return whether only a loop itself can set its variable while it runs."""
    name = loop.variable.name
    return program.symbols[name].scope is Scope.LOCAL and not _sets(program, loop.body, name)


def _sets(program: Program, statements: tuple[Statement, ...], name: str) -> bool:
    """Return whether a loop's statements may set a variable, as a subroutine may. No jump leads back into a loop."""
    for statement, _ in statements_in_order(statements):
        if isinstance(statement, Gosub) or (isinstance(statement, OnJump) and statement.gosub):
            return True
        if any(target.name == name for target in targets_of(statement)):
            return True
        if isinstance(statement, Call) and Reference(name) in program.calls[statement.span].targets:
            return True
    return False
