"""Lowering of the statements of BASIC tasks: each place where a task can wait begins a separate basic block.

A statement that must wait (INPUT of an empty channel, PRINT to a full one) is executed again from its beginning when
the task continues, so PRINT sends the values of that time (decision).
"""

from __future__ import annotations

import ast
import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

from automax_ros.compile.base import build
from automax_ros.compile.base.layout import Role, StateField
from automax_ros.compile.base.scan_io import MUST_WAIT, Suspension
from automax_ros.compile.lowering.expressions import lower, of_type
from automax_ros.compile.lowering.flow import Flow, is_jumping
from automax_ros.compile.lowering.statements import GOSUB_DEPTH, StatementLowering, StatementRow
from automax_ros.compile.lowering.stores import converted_to, printable, store
from automax_ros.core.types import DataType
from automax_ros.language.program import OpenedFile
from automax_ros.language.tree.tree import (
    Close,
    Delay,
    Direction,
    For,
    Get,
    If,
    InputFile,
    OpenChannel,
    OpenPort,
    PrintFile,
    Put,
    StartEvery,
    Statement,
    Stop,
    WaitOn,
)

BURST_LIMIT = 1000
"""Statements that a BASIC task executes before others get their turn (decision: so no loop hangs the rack)."""
FILE_NOT_OPEN, NEGATIVE_TIME = 7050, 7054
EVERY, GOSUB, GOSUB_LINES = "every_block", "gosub_depth", "gosub_lines"
MAX_TEXT = 132
"""Longest text of a message's string (J-3675 p. 5-4: temporary strings)."""


@dataclass
class WaitingLowering(StatementLowering):
    """Lowers the statements of a BASIC task; afterwards ``blocks`` is the number of basic blocks."""

    blocks: int = 0

    _always_blocks: ClassVar[bool] = True

    def _jumps(self, statement: Statement) -> bool:
        """Return whether a statement waits or jumps; every FOR counts, so that a loop can suspend between two turns."""
        if type(statement) in self._waiting or isinstance(statement, For):
            return True
        if isinstance(statement, If):
            return any(self._jumps(inner) for inner in (*statement.then, *statement.otherwise)) or is_jumping(
                statement, self._targets
            )
        return is_jumping(statement, self._targets)

    def _assemble(self, flow: Flow) -> None:
        self.blocks = len(flow.blocks)
        for name in (GOSUB_LINES, EVERY):
            if name in self.fields:
                self.fields[name] = dataclasses.replace(self.fields[name], below=self.blocks + 1)
        if GOSUB in self.fields:
            self.fields[GOSUB] = dataclasses.replace(self.fields[GOSUB], below=GOSUB_DEPTH + 1)
        with self.emitter.suite() as too_many:
            self.emitter.checkpoint()
            self.emitter.emit(_return(Suspension.BUSY, build.constant(0)))
        self.emitter.emit(flow.blocks_loop(BURST_LIMIT, too_many))

    def _stop(self, flow: Flow, _: Stop) -> None:
        self.emitter.checkpoint()
        self._next_block(flow, flow.to_next(), _return(Suspension.STOP, build.constant(0)))

    def _file(self, number: int) -> OpenedFile:
        return next(item for item in self.emitter.program.files if item.number == number)

    def _flag(self, number: int) -> str:
        name = f"file{number}_open"
        self.fields[name] = StateField(f"FILE {number}.open", DataType.BOOLEAN, Role.STACK, False)
        return name

    # Events and times

    def _wait_on(self, flow: Flow, statement: WaitOn) -> None:
        self._charge(statement)
        self.emitter.checkpoint()
        names = [event.name for event in self.emitter.program.events]
        place = build.constant(names.index(statement.event))
        self._next_block(flow, flow.to_next(), _return(Suspension.EVENT, place))

    def _delay(self, flow: Flow, statement: Delay) -> None:
        self._charge(statement)
        ns = self._time(statement)
        self.emitter.checkpoint()
        suspended = [flow.to_next(), _return(Suspension.DELAY, ns)]
        self._next_block(flow, build.when(build.compare(ns, ">", build.constant(0)), suspended, [flow.to_next()]))

    def _start_every(self, flow: Flow, statement: StartEvery) -> None:
        self._charge(statement)
        self.fields[EVERY] = StateField("START EVERY.block", DataType.DOUBLE, Role.STACK, 0)
        ns = self._time(statement)
        self.emitter.checkpoint()
        registered: list[ast.stmt] = [
            build.assign(EVERY, build.constant(flow.current + 1)),
            build.do(build.call(self.emitter.member("start_every"), ns)),
        ]
        wrong = [self.emitter.log_call(build.constant(NEGATIVE_TIME))]
        self.emitter.emit(build.when(build.compare(ns, ">", build.constant(0)), registered, wrong))
        self._next_block(flow)

    def _time(self, statement: Delay | StartEvery) -> ast.expr:
        """Emit the time of a statement in ns; a negative one of DELAY is logged."""
        unit_ns = statement.unit.ns(self.emitter.program.tick_ns)
        with self.emitter.statement(self.emitter.line):
            count = lower(self.emitter, statement.count).node
            name = "wait_ns"
            self.emitter.emit(build.assign(name, build.binary(count, "*", build.constant(unit_ns))))
            if isinstance(statement, Delay):
                wrong = build.compare(build.name(name), "<", build.constant(0))
                self.emitter.emit(build.when(wrong, [self.emitter.log_call(build.constant(NEGATIVE_TIME))]))
        return build.name(name)

    # Channels and ports

    def _own_block(self, flow: Flow, statement: Statement) -> None:
        """Begin a block to which the task can return, with the time of the statement.

        It is always a new one: the numbers of blocks are the state's ``PC``, so they are the same in all forms and for
        all execution times. A recorded modeled burst is replayed as an ideal one.
        """
        self._next_block(flow)
        self._charge(statement)

    def _open_channel(self, flow: Flow, statement: OpenChannel) -> None:
        self._own_block(flow, statement)
        types = build.constant("".join(kind.value or "." for kind in statement.types))
        number, flag = build.constant(statement.file), self._flag(statement.file)
        if statement.direction is Direction.INPUT and statement.depth is not None:
            with self.emitter.statement(self.emitter.line):
                depth = self.emitter.keep(lower(self.emitter, statement.depth).node)
            self.emitter.checkpoint()
            call = build.call(self.emitter.member("open_reader"), number, types, depth)
        else:
            self.emitter.checkpoint()
            call = build.call(self.emitter.member("open_writer"), number, types)
        self.emitter.emit(build.assign("outcome", call), self._wait_if(flow, Suspension.ABSENT, statement.file))
        self.emitter.emit(build.assign(flag, build.compare(build.name("outcome"), "=", build.constant(0))))
        self._log_outcome()
        self._next_block(flow)

    def _wait_if(self, flow: Flow, why: Suspension, number: int) -> ast.stmt:
        """Return the statement that suspends the task if an access must wait; it returns to the present block."""
        must = build.compare(build.name("outcome"), "<", build.constant(0))
        return build.when(must, [flow.to_block(flow.current), _return(why, build.constant(number))])

    def _log_outcome(self) -> None:
        self.emitter.emit(
            build.when(
                build.compare(build.name("outcome"), ">", build.constant(0)),
                [self.emitter.log_call(build.name("outcome"))],
            )
        )

    def _if_open(self, number: int, call: ast.expr, closed: ast.expr) -> ast.expr:
        return build.choose(build.name(self._flag(number)), call, closed)

    def _input(self, flow: Flow, statement: InputFile) -> None:
        opened = self._file(statement.file)
        if opened.direction is None:
            self._wait_for_port(flow, statement)
            return
        self._own_block(flow, statement)
        self.emitter.checkpoint()
        call = build.call(self.emitter.member("receive"), build.constant(statement.file))
        nothing = ast.Tuple([ast.Tuple([], build.LOAD), build.constant(FILE_NOT_OPEN)], build.LOAD)
        self.emitter.emit(
            build.assign_all(["message", "outcome"], self._if_open(statement.file, call, nothing)),
        )
        if statement.empty is None:
            self.emitter.emit(self._wait_if(flow, Suspension.EMPTY, statement.file))
        self._log_outcome()
        with self.emitter.statement(self.emitter.line):
            with self.emitter.suite() as stored:
                for place, (target, kind) in enumerate(zip(statement.targets, opened.types, strict=True)):
                    store(self.emitter, target, of_type(build.item("message", build.constant(place)), kind))
            self.emitter.emit(build.when(build.name("message"), stored))
        self._branch_if_waiting(flow, statement.empty)

    def _branch_if_waiting(self, flow: Flow, line: int | None) -> None:
        """End the block: continue, or go to the line of EMPTY= or FULL= if the access would have to wait."""
        if line is None:
            self._next_block(flow)
            return
        must = build.compare(build.name("outcome"), "=", build.constant(MUST_WAIT))
        self._next_block(flow, build.when(must, [flow.to_line(line)], [flow.to_next()]))

    def _print_file(self, flow: Flow, statement: PrintFile) -> None:
        opened = self._file(statement.file)
        if opened.direction is None:
            separators = "".join(separator or " " for separator in statement.separators)
            values = lambda: [printable(self.emitter, item) for item in statement.items]  # noqa: E731
            self._to_port(flow, statement, opened, values, separators)
            return
        self._own_block(flow, statement)
        with self.emitter.statement(self.emitter.line):
            values_sent: list[ast.expr] = []
            for item, kind in zip(statement.items, opened.types, strict=True):
                sent = converted_to(self.emitter, kind, MAX_TEXT, lower(self.emitter, item))
                values_sent.append(self.emitter.keep(sent))
            message: ast.expr = ast.Tuple(values_sent, build.LOAD)
            self.emitter.emit(build.assign("message", message))
        self.emitter.checkpoint()
        call = build.call(self.emitter.member("send"), build.constant(statement.file), build.name("message"))
        self.emitter.emit(build.assign("outcome", self._if_open(statement.file, call, build.constant(FILE_NOT_OPEN))))
        if statement.full is None:
            self.emitter.emit(self._wait_if(flow, Suspension.FULL, statement.file))
        self._log_outcome()
        self._branch_if_waiting(flow, statement.full)

    def _open_port(self, flow: Flow, statement: OpenPort) -> None:
        self._charge(statement)
        with self.emitter.statement(self.emitter.line):
            for part in (statement.setup, statement.baud):
                if part is not None:
                    lower(self.emitter, part)
            self.emitter.emit(build.assign(self._flag(statement.file), build.constant(True)))
        self._next_block(flow)

    def _close(self, flow: Flow, statement: Close) -> None:
        self._charge(statement)
        flag = self._flag(statement.file)
        self._log_if_closed(flag)
        self.emitter.emit(build.assign(flag, build.constant(False)))
        self._next_block(flow)

    def _log_if_closed(self, flag: str) -> None:
        self.emitter.book_cost()
        closed = build.inverse(build.name(flag))
        self.emitter.emit(build.when(closed, [self.emitter.log_call(build.constant(FILE_NOT_OPEN))]))

    def _put(self, flow: Flow, statement: Put) -> None:
        self._to_port(
            flow, statement, self._file(statement.file), lambda: [printable(self.emitter, statement.item)], " "
        )

    def _to_port(
        self,
        flow: Flow,
        statement: PrintFile | Put,
        opened: OpenedFile,
        values: Callable[[], list[ast.expr]],
        separators: str,
    ) -> None:
        """Emit a line of a port, which goes to the task's log with the port's name (decision: nothing is connected)."""
        self._charge(statement)
        flag = self._flag(statement.file)
        with self.emitter.statement(self.emitter.line):
            printed = ast.Tuple([build.constant(f"{opened.port}: "), *values()], build.LOAD)
            call = build.call(self.emitter.member("print_line"), printed, build.constant(f";{separators}"))
            self.emitter.emit(build.when(build.name(flag), [build.do(call)]))
        self._log_if_closed(flag)
        self._next_block(flow)

    def _wait_for_port(self, flow: Flow, statement: InputFile | Get) -> None:
        """Emit input from a port, where nothing ever arrives (decision): wait for ever, or go to the line of EMPTY=."""
        self._charge(statement)
        flag = self._flag(statement.file)
        self._log_if_closed(flag)
        self.emitter.checkpoint()
        is_open = build.name(flag)
        if statement.empty is not None:
            self._next_block(flow, build.when(is_open, [flow.to_line(statement.empty)], [flow.to_next()]))
            return
        waits = [flow.to_next(), _return(Suspension.PORT, build.constant(statement.file))]
        self._next_block(flow, build.when(is_open, waits, [flow.to_next()]))

    _waiting: ClassVar[dict[type, StatementRow]] = {
        WaitOn: StatementRow(_wait_on, 20.0),
        Delay: StatementRow(_delay, 20.0),
        StartEvery: StatementRow(_start_every, 20.0),
        OpenChannel: StatementRow(_open_channel, 60.0),
        OpenPort: StatementRow(_open_port, 60.0),
        Close: StatementRow(_close, 30.0),
        InputFile: StatementRow(_input, 40.0),
        PrintFile: StatementRow(_print_file, 60.0),
        Get: StatementRow(_wait_for_port, 30.0),
        Put: StatementRow(_put, 40.0),
    }
    _flowing: ClassVar[dict[type, StatementRow]] = {**StatementLowering._flowing, **_waiting, Stop: StatementRow(_stop)}
    estimates_us: ClassVar[dict[type, float]] = {
        **StatementLowering.estimates_us,
        **{kind: row.estimate_us for kind, row in _waiting.items()},
    }


def _return(why: Suspension, number: ast.expr) -> ast.stmt:
    return ast.Return(ast.Tuple([build.constant(int(why)), number], build.LOAD))
