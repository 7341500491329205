"""Lowering of statements: straight code where nothing jumps, basic blocks where something does."""

from __future__ import annotations

import ast
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import ClassVar, NamedTuple

from automax_ros.compile.base import build
from automax_ros.compile.base.cost import CostModel
from automax_ros.compile.base.emitter import Emitter
from automax_ros.compile.base.functions import DOUBLE_CLAMPED, INTEGER_CLAMPED, REAL_CLAMPED
from automax_ros.compile.base.layout import Role, StateField
from automax_ros.compile.lowering.calls import BlockInstance, lower_block
from automax_ros.compile.lowering.expressions import lower, of_type
from automax_ros.compile.lowering.flow import (
    PC,
    STEPS,
    Flow,
    Loop,
    before_end,
    begin_loop,
    count_statements,
    end_turn,
    is_jumping,
    jump_targets,
    loop_fields,
    loop_test,
)
from automax_ros.compile.lowering.stores import printable, store
from automax_ros.core.types import DataType
from automax_ros.language.tree.tree import (
    Assignment,
    Call,
    ClearErrorLog,
    Data,
    Declaration,
    End,
    Event,
    For,
    Gosub,
    Goto,
    If,
    IoWrite,
    Label,
    OnJump,
    Print,
    Read,
    Remark,
    Restore,
    Return,
    SetEvent,
    Statement,
    Stop,
)

STATEMENT_LIMIT = 1_000_000
"""Statements of one scan, or of the part before SCAN_LOOP (semantics, BASIC)."""
GOSUB_DEPTH = 16
GOSUB_TOO_DEEP, RETURN_WITHOUT_GOSUB, OUT_OF_DATA = 7028, 7029, 7030
STOPPED = "stopped"


class StatementRow(NamedTuple):
    """The lowering of a kind of statement, and its estimated time on a 7010, microseconds; a CALL's is its block's."""

    carry_out: Callable[..., None]
    estimate_us: float = 0.0


@dataclass
class StatementLowering:
    """Lowers the statements of one function into an emitter; ``instances`` are the blocks by the CALL's span.

    Afterwards ``block_lines`` holds the BASIC line of each basic block, if there are any.
    """

    emitter: Emitter
    instances: dict[object, BlockInstance]
    fields: dict[str, StateField] = field(default_factory=dict)
    counts_steps: bool = False
    can_stop: bool = False
    block_lines: tuple[int, ...] = ()
    _repeating: int = 0
    _targets: frozenset[int] = frozenset()
    _loops: dict[int, int] = field(default_factory=dict)
    _always_blocks: ClassVar[bool] = False

    def lower_all(self, statements: tuple[Statement, ...]) -> None:
        """Emit the statements; END after them is left to the caller."""
        statements = before_end(statements)
        self._targets = jump_targets(statements)
        if self._always_blocks or any(self._jumps(statement) for statement in statements):
            self._lower_blocks(statements)
        else:
            self._lower_straight(statements)

    def _jumps(self, statement: Statement) -> bool:
        return is_jumping(statement, self._targets)

    # Straight code

    def _lower_straight(self, statements: tuple[Statement, ...]) -> None:
        for statement in statements:
            self._note_line(statement)
            self.emitter.mark_line(statement.number)
            if isinstance(statement, If):
                self._straight_if(statement)
            elif isinstance(statement, For):
                self._straight_for(statement)
            else:
                self._lower_simple(statement)

    def _straight_if(self, statement: If) -> None:
        line = self.emitter.line
        condition = self._condition(statement)
        with self.emitter.suite() as then:
            self._branch(statement.then)
        with self.emitter.suite() as otherwise:
            self._branch(statement.otherwise)
        whole = build.when(condition, then, otherwise)
        self.emitter.emit(whole)
        whole.lineno = line  # the line of its test, to which the test's temporaries belong

    def _branch(self, statements: tuple[Statement, ...]) -> None:
        """Emit a branch of an IF; where the code may repeat, the branch counts its own statements."""
        number = count_statements(statements)
        if self._repeating and number:
            self.emitter.emit(build.add_to(STEPS, build.constant(number)))
        self._lower_straight(statements)

    def _straight_for(self, statement: For) -> None:
        emitter, line = self.emitter, self.emitter.line
        self.counts_steps = True
        loop = self._begin_loop(statement)
        emitter.book_cost()
        with emitter.suite() as turn:
            with emitter.statement(line):
                test = loop_test(emitter, loop)
                emitter.book_cost()
                emitter.emit(build.when(build.inverse(test), [ast.Break()]))
            emitter.emit(*self._count(count_statements(statement.body) + 1, line))
            self._repeating += 1
            self._lower_straight(statement.body)
            self._repeating -= 1
            emitter.add_cost(emitter.cost_model.turn_ns)
            with emitter.statement(emitter.line):
                overflowed = end_turn(emitter, loop)
            if overflowed is not None:
                emitter.book_cost()
                emitter.emit(build.when(overflowed, [ast.Break()]))
        whole_loop: list[ast.stmt] = [build.loop(build.constant(True), turn)]
        if loop.may_be_idle:
            whole_loop = [build.when(build.compare(loop.step, "<>", build.constant(0)), whole_loop)]
        emitter.emit(*whole_loop)

    def _begin_loop(self, statement: For) -> Loop:
        line = self.emitter.line
        with self.emitter.statement(line):
            self._charge(statement)
            self._loops[line] = self._loops.get(line, 0) + 1
            place = f"{line}" if self._loops[line] == 1 else f"{line}.{self._loops[line]}"
            loop = begin_loop(self.emitter, statement, place)
        self.fields.update(loop_fields(loop))
        return loop

    def _count(self, number: int, line: int) -> list[ast.stmt]:
        too_long = ast.Raise(build.call("ScanTooLong", build.constant(line)), None)
        limit = build.compare(build.name(STEPS), ">", build.constant(STATEMENT_LIMIT))
        return [build.add_to(STEPS, build.constant(number)), build.when(limit, [too_long])]

    # Basic blocks

    def _lower_blocks(self, statements: tuple[Statement, ...]) -> None:
        self.counts_steps = True
        self._repeating += 1
        flow = Flow()
        outer = self.emitter.body
        self._begin_block(flow)
        self._flow_all(flow, statements)
        self.emitter.book_cost()
        self.emitter.emit(flow.to_end())
        self.emitter.body = outer
        self._assemble(flow)

    def _assemble(self, flow: Flow) -> None:
        self.block_lines = (*flow.lines, self.emitter.line)
        self.emitter.emit(*flow.assemble(STATEMENT_LIMIT))

    def _begin_block(self, flow: Flow) -> None:
        self.emitter.body = flow.begin(self.emitter.line)

    def _next_block(self, flow: Flow, *jump: ast.stmt) -> None:
        """End the current block by a jump, by default to the next block, which begins."""
        self.emitter.book_cost()
        self.emitter.emit(*(jump or (flow.to_next(),)))
        self._begin_block(flow)

    def _flow_all(self, flow: Flow, statements: tuple[Statement, ...]) -> None:
        for statement in statements:
            self._note_line(statement)
            if statement.number in self._targets and statement.number is not None:
                self._next_block(flow)
                flow.labels[statement.number] = flow.current
            if isinstance(statement, Label):
                continue
            flow.count()
            if self._jumps(statement):
                self.emitter.mark_line(statement.number)
                row = self._flowing.get(type(statement))
                if row is None:
                    self._lower_simple(statement)
                else:
                    row.carry_out(self, flow, statement)
            else:
                self._lower_straight((statement,))

    def _goto(self, flow: Flow, statement: Goto) -> None:
        self._charge(statement)
        self._next_block(flow, flow.to_line(statement.line))

    def _end(self, flow: Flow, _: End) -> None:
        self._next_block(flow, flow.to_end())

    def _stop(self, flow: Flow, _: Stop) -> None:
        self.can_stop = True
        self._next_block(flow, build.assign(STOPPED, build.constant(True)), flow.to_end())

    def _flow_if(self, flow: Flow, statement: If) -> None:
        condition = self._condition(statement)
        otherwise_at, end_at = flow.later(), flow.later()
        jump = build.when(condition, [flow.to_next()], [build.assign(PC, otherwise_at)])
        if len(statement.then) == 1 and isinstance(statement.then[0], Goto) and not statement.otherwise:
            self._next_block(flow, build.when(condition, [flow.to_line(statement.then[0].line)], [flow.to_next()]))
            return
        self._next_block(flow, jump)
        self._flow_all(flow, statement.then)
        self._next_block(flow, build.assign(PC, end_at))
        flow.here(otherwise_at)
        if statement.otherwise:
            self._flow_all(flow, statement.otherwise)
            self._next_block(flow)
        flow.here(end_at)

    def _flow_for(self, flow: Flow, statement: For) -> None:
        emitter, line = self.emitter, self.emitter.line
        loop = self._begin_loop(statement)
        after_at = flow.later()
        leave: ast.stmt = build.assign("pc", after_at)
        if loop.may_be_idle:
            step_is_zero = build.compare(loop.step, "=", build.constant(0))
            self._next_block(flow, build.when(step_is_zero, [leave], [flow.to_next()]))
        else:
            self._next_block(flow)
        top = flow.current
        flow.count()
        with emitter.statement(line):
            test = loop_test(emitter, loop)
            emitter.book_cost()
            emitter.emit(build.when(test, [flow.to_next()], [leave]))
        self._begin_block(flow)
        self._flow_all(flow, statement.body)
        emitter.add_cost(emitter.cost_model.turn_ns)
        emitter.book_cost()
        with emitter.statement(emitter.line):
            overflowed = end_turn(emitter, loop)
        again = flow.to_block(top)
        self._next_block(flow, again if overflowed is None else build.when(overflowed, [leave], [again]))
        flow.here(after_at)

    def _flow_on(self, flow: Flow, statement: OnJump) -> None:
        self._charge(statement)
        with self.emitter.statement(self.emitter.line):
            selector = self.emitter.keep(lower(self.emitter, statement.selector).node)
        blocks = ast.Tuple([flow.block_of(line) for line in statement.lines], build.LOAD)
        jump = build.assign(PC, ast.Subscript(blocks, build.binary(selector, "-", build.constant(1)), build.LOAD))
        taken: list[ast.stmt] = self._calling(flow, jump) if statement.gosub else [jump]
        count = build.constant(len(statement.lines))
        in_list = ast.Compare(build.constant(1), [ast.LtE(), ast.LtE()], [selector, count])
        self._next_block(flow, build.when(in_list, taken, [flow.to_next()]))

    def _gosub(self, flow: Flow, statement: Gosub) -> None:
        self._charge(statement)
        self._next_block(flow, *self._calling(flow, flow.to_line(statement.line)))

    def _calling(self, flow: Flow, jump: ast.stmt) -> list[ast.stmt]:
        self.fields["gosub_lines"] = StateField(
            "GOSUB.blocks", DataType.DOUBLE, Role.STACK, 0, GOSUB_DEPTH, is_array=True
        )
        self.fields["gosub_depth"] = StateField("GOSUB.depth", DataType.DOUBLE, Role.STACK, 0)
        depth = build.name("gosub_depth")
        call = [
            build.set_item("gosub_lines", depth, build.constant(flow.current + 1)),
            build.add_to("gosub_depth", build.constant(1)),
            jump,
        ]
        skip = [self.emitter.log_call(build.constant(GOSUB_TOO_DEEP)), flow.to_next()]
        return [build.when(build.compare(depth, "<", build.constant(GOSUB_DEPTH)), call, skip)]

    def _return(self, flow: Flow, statement: Return) -> None:
        self._charge(statement)
        if "gosub_depth" not in self.fields:
            self._calling(flow, flow.to_next())
        depth = build.name("gosub_depth")
        back: list[ast.stmt] = [
            build.add_to("gosub_depth", build.constant(-1)),
            build.assign(PC, build.item("gosub_lines", depth)),
        ]
        go_on = [self.emitter.log_call(build.constant(RETURN_WITHOUT_GOSUB)), flow.to_next()]
        self._next_block(flow, build.when(depth, back, go_on))

    # Single statements

    def _note_line(self, statement: Statement) -> None:
        if statement.number is not None:
            self.emitter.line = statement.number

    def _charge(self, statement: Statement) -> None:
        self.emitter.add_cost(self.statement_ns(self.emitter.cost_model, statement))

    def _condition(self, statement: If) -> ast.expr:
        with self.emitter.statement(self.emitter.line):
            self._charge(statement)
            condition = lower(self.emitter, statement.condition).node
        self.emitter.book_cost()
        return condition

    def _lower_simple(self, statement: Statement) -> None:
        row = self._simple.get(type(statement))
        if row is None:
            raise TypeError(f"no lowering of {type(statement).__name__}")
        with self.emitter.statement(self.emitter.line):
            self._charge(statement)
            row.carry_out(self, statement)

    def _assign(self, statement: Assignment) -> None:
        store(self.emitter, statement.target, lower(self.emitter, statement.value))

    def _call(self, statement: Call) -> None:
        instance = self.instances[statement.span]
        self.emitter.line = instance.bound.line
        self.emitter.add_cost(self.emitter.cost_model.block_ns(instance.bound))
        lower_block(self.emitter, instance)

    def _print(self, statement: Print) -> None:
        values = [printable(self.emitter, item) for item in statement.items]
        separators = build.constant("".join(separator or " " for separator in statement.separators))
        call = build.call(self.emitter.member("print_line"), ast.Tuple(values, build.LOAD), separators)
        self.emitter.emit(build.do(call))

    def _read(self, statement: Read) -> None:
        self._use_data()
        for target in statement.targets:
            kind, emitter = target.type, self.emitter
            length = emitter.symbol(target.name).length
            emitter.book_cost()
            with emitter.suite() as present:
                call = emitter.operation(
                    "data_value",
                    build.item("data", build.name("data_pointer")),
                    build.constant(kind.value),
                    build.constant(length),
                )
                value = emitter.noting(call, INTEGER_CLAMPED, DOUBLE_CLAMPED, REAL_CLAMPED)
                emitter.emit(build.add_to("data_pointer", build.constant(1)))
                store(emitter, target, of_type(value, kind))
            limits = [build.name("data_pointer"), build.constant(len(emitter.program.data))]
            there = ast.Compare(build.constant(0), [ast.LtE(), ast.Lt()], limits)
            missing = [emitter.log_call(build.constant(OUT_OF_DATA))]
            emitter.emit(build.when(there, present, missing))

    def _restore(self, statement: Restore) -> None:
        self._use_data()
        pool = self.emitter.program
        first = len(pool.data)
        for line, index in reversed(pool.data_lines):
            if statement.line is None or line >= statement.line:
                first = index
        self.emitter.emit(build.assign("data_pointer", build.constant(first if statement.line is not None else 0)))

    def _use_data(self) -> None:
        self.fields["data_pointer"] = StateField(
            "DATA.pointer", DataType.DOUBLE, Role.STACK, 0, below=len(self.emitter.program.data) + 1
        )
        self.emitter.extra_globals["data"] = self.emitter.program.data

    def _io_write(self, statement: IoWrite) -> None:
        nodes = [lower(self.emitter, part).node for part in (statement.slot, statement.register, statement.value)]
        self.emitter.checkpoint()
        problem = self.emitter.temporary()
        self.emitter.emit(build.assign(problem, build.call(self.emitter.member("io_write"), *nodes)))
        self.emitter.emit(build.when(build.name(problem), [self.emitter.log_call(build.name(problem))]))

    def _clear_log(self, _: ClearErrorLog) -> None:
        self.emitter.emit(build.do(build.call(self.emitter.member("clear_errors"))))

    def _set_event(self, statement: SetEvent) -> None:
        self.emitter.checkpoint()
        self.emitter.emit(build.do(build.call(self.emitter.member("set_event"), build.constant(statement.event))))

    def _nothing(self, _: Statement) -> None:
        pass

    _flowing: ClassVar[dict[type, StatementRow]] = {
        Goto: StatementRow(_goto, 2.0),
        Gosub: StatementRow(_gosub, 4.0),
        Return: StatementRow(_return, 3.0),
        OnJump: StatementRow(_flow_on, 5.0),
        If: StatementRow(_flow_if, 4.0),
        For: StatementRow(_flow_for, 8.0),
        Stop: StatementRow(_stop),
        End: StatementRow(_end),
    }
    _simple: ClassVar[dict[type, StatementRow]] = {
        Assignment: StatementRow(_assign, 6.0),
        Call: StatementRow(_call),
        Print: StatementRow(_print, 60.0),
        Read: StatementRow(_read, 6.0),
        Restore: StatementRow(_restore, 2.0),
        IoWrite: StatementRow(_io_write, 10.0),
        ClearErrorLog: StatementRow(_clear_log, 4.0),
        SetEvent: StatementRow(_set_event, 12.0),
        **dict.fromkeys((Remark, Declaration, Data, Event, Label), StatementRow(_nothing)),
    }
    estimates_us: ClassVar[dict[type, float]] = {
        kind: row.estimate_us for kind, row in (*_flowing.items(), *_simple.items()) if row.estimate_us
    }
    """Estimated microseconds on a 7010 by kind of BASIC statement; others take none (decision)."""

    @classmethod
    def statement_ns(cls, model: CostModel, statement: Statement) -> int:
        """Return the time of a statement without those inside it: but for remarks, an estimate."""
        if isinstance(statement, Remark):
            return model.remark_ns(statement)
        return model.estimate_ns(cls.estimates_us.get(type(statement), 0.0))
