"""The flow of control of a task with jumps: basic blocks in one ``while`` on an integer ``pc``.

Blocks are in the order of the source, so that a jump forward and falling through to the next block cost one comparison
each; only a jump back takes another turn of the loop. Many blocks are put into groups, so that a turn finds its block
with few comparisons, however long the task is.
"""

from __future__ import annotations

import ast
from dataclasses import dataclass, field

from automax_ros.compile.base import build
from automax_ros.language.tree.tree import (
    End,
    For,
    Gosub,
    Goto,
    If,
    Label,
    OnJump,
    Return,
    Statement,
    Stop,
)
from automax_ros.language.tree.walk import bodies, jumps_of

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
        turns += _dispatched([self._whole(number) for number in range(len(self.blocks))], 0)
        end = build.constant(len(self.blocks))
        return build.loop(build.compare(build.name(PC), "<>", end), turns)

    def _whole(self, number: int) -> list[ast.stmt]:
        counted = [build.add_to(STEPS, build.constant(self.counts[number]))] if self.counts[number] else []
        return [*counted, *_turning(self.blocks[number], number)]


def _dispatched(blocks: list[list[ast.stmt]], first: int) -> list[ast.stmt]:
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
            _dispatched(blocks[start : start + size], first + start),
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
