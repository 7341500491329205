"""The least and the most time of a scan of a task, over all paths through it.

Each IF may go either way, each ON any of its ways. A FOR of whole literals takes its turns exactly; of other loops, and
of those that a jump back makes, no turn counts for the least and one for the most (decision: nothing bounds them).
A subroutine counts wherever it is called, to the depth that a GOSUB can nest. A scan that STOP ends does not count,
unless there are no others (decision).
"""

from __future__ import annotations

import enum
from collections.abc import Hashable
from dataclasses import dataclass

from automax_ros.compile.base.cost import CostModel, Model
from automax_ros.compile.lowering.basic_statements import WaitingLowering
from automax_ros.compile.lowering.flow import counts_alone
from automax_ros.compile.lowering.statements import GOSUB_DEPTH
from automax_ros.compile.paths import NOTHING, Bounds, longest_turn, ways_out
from automax_ros.language.checks.rules.constant_values import constant_value
from automax_ros.language.program import Program
from automax_ros.language.tree.tree import (
    Call,
    End,
    For,
    Gosub,
    Goto,
    If,
    IntegerLiteral,
    OnJump,
    Return,
    StartEvery,
    Statement,
    Stop,
)
from automax_ros.language.tree.walk import jumps_of, statements_in_order


@dataclass(frozen=True)
class ScanTimes:
    """The least and most time of a scan in ns; ``estimated`` where the sum includes a time that no manual prints."""

    least_ns: int
    most_ns: int
    estimated: bool


class _Way(enum.Enum):
    """An exit from some statements that does not lead to a line."""

    NEXT = "to the statement after them"
    RETURN = "RETURN"
    END = "END"
    STOP = "STOP"


_Ways = dict[Hashable, Bounds]
"""The exits from some statements, lines as ``("line", number)``, each with its time."""


def scan_times(program: Program, model: CostModel) -> ScanTimes:
    """Return the bounds of a scan's time, SCAN_LOOP and END included.

    For a BASIC task it is the part that START EVERY repeats, or the whole task to its END, without waiting; for one
    that never ends the least is 0 and the most one turn (decision).
    """
    subroutines: dict[int, _Ways] = {}
    for _ in range(GOSUB_DEPTH):
        found = _subroutines(program, model, subroutines)
        if found == subroutines:
            break
        subroutines = found
    suite = _Suite(program, model, subroutines, inside=False)
    first = _first_repeated(program)
    edges = suite.edges(program.scan)
    ways = _to_the_end(ways_out(edges, first))
    times = ways.get(_Way.END) or ways.get(_Way.STOP) or Bounds(0, longest_turn(edges, first))
    around = NOTHING if program.is_basic else _around(program, model, ended=_Way.END in ways)
    times = times.plus(around)
    estimated = is_estimated(program.scan[first:], model) or _loop_ns(program, model) > 0
    return ScanTimes(times.least, times.most, estimated)


def command_ns(program: Program, model: CostModel) -> int:
    """Return the time from the beginning of a current minor loop's scan to its command for the 57C406."""
    return model.scan_loop_ns(program) + _loop_ns(program, model)


def period_ns(program: Program) -> int | None:
    """Return the time from scan to scan; for a BASIC task that of its START EVERY, None without a constant one."""
    if not program.is_basic:
        return program.period_ns
    for statement in program.scan:
        if isinstance(statement, StartEvery):
            count = constant_value(statement.count)
            return round(count * statement.unit.ns(program.tick_ns)) if isinstance(count, (int, float)) else None
    return None


def _first_repeated(program: Program) -> int:
    """Return the place of the first statement of each scan; for a BASIC task of that after START EVERY."""
    places = (place for place, statement in enumerate(program.scan) if isinstance(statement, StartEvery))
    return next(places, -1) + 1 if program.is_basic else 0


def _around(program: Program, model: CostModel, ended: bool) -> Bounds:
    """Return the time of SCAN_LOOP, or of the block in its place, and of END if the scan reaches it."""
    time = model.scan_loop_ns(program) + _loop_ns(program, model) + (model.end_ns(program) if ended else 0)
    return Bounds(time, time)


def _loop_ns(program: Program, model: CostModel) -> int:
    """Return the time of the current minor loop, 0 in a task without one."""
    return 0 if program.cml is None else model.loop_ns


def is_estimated(statements: tuple[Statement, ...], model: CostModel) -> bool:
    """Return whether a BASIC statement among these, or inside them, has a time that is an estimate."""
    kinds = {type(statement) for statement, _ in statements_in_order(statements)}
    return model.model is not Model.NONE and not kinds.isdisjoint(WaitingLowering.estimates_us)


def _either(ways: _Ways, *names: _Way) -> Bounds | None:
    found: Bounds | None = None
    for name in names:
        if name in ways:
            found = ways[name].joined(found)
    return found


def _subroutines(program: Program, model: CostModel, inner: dict[int, _Ways]) -> dict[int, _Ways]:
    """Return the exits of each subroutine, where those that it calls have the exits ``inner``."""
    called = {
        line
        for item, _ in statements_in_order(program.scan)
        if isinstance(item, Gosub) or (isinstance(item, OnJump) and item.gosub)
        for line in jumps_of(item)
    }
    if not called:
        return {}
    edges = _Suite(program, model, inner, inside=True).edges(program.scan)
    places = {statement.number: place for place, statement in enumerate(program.scan) if statement.number in called}
    return {line: _to_the_end(ways_out(edges, places[line])) for line in sorted(called) if line in places}


def _to_the_end(ways: _Ways) -> _Ways:
    """Return the exits of the scan's statements, with the last one leading to END."""
    end = _either(ways, _Way.NEXT, _Way.END)
    rest = {way: span for way, span in ways.items() if way not in (_Way.NEXT, _Way.END)}
    return rest if end is None else {**rest, _Way.END: end}


@dataclass(frozen=True)
class _Suite:
    """Times of statements; ``inside`` a subroutine RETURN is an exit, else it does nothing."""

    program: Program
    model: CostModel
    subroutines: dict[int, _Ways]
    inside: bool

    def ways(self, statements: tuple[Statement, ...], first: int = 0) -> _Ways:
        return ways_out(self.edges(statements), first)

    def edges(self, statements: tuple[Statement, ...]) -> list[_Ways]:
        """Return the targets of each statement, by its place, and of what follows the last."""
        labels = {statement.number: place for place, statement in reversed(list(enumerate(statements)))}

        def place_of(way: Hashable, place: int) -> Hashable:
            if way is _Way.NEXT:
                return place + 1
            return labels.get(way[1], way) if isinstance(way, tuple) else way

        edges: list[_Ways] = []
        for place, statement in enumerate(statements):
            leading: _Ways = {}
            for way, span in self._statement(statement).items():
                to = place_of(way, place)
                leading[to] = span.joined(leading.get(to))
            edges.append(leading)
        return [*edges, {_Way.NEXT: NOTHING}]

    def _statement(self, statement: Statement) -> _Ways:
        own = WaitingLowering.statement_ns(self.model, statement)
        if isinstance(statement, Call):
            least, most = self.model.block_bounds_ns(self.program.calls[statement.span])
            return {_Way.NEXT: Bounds(least, most)}
        if isinstance(statement, If):
            inner = _join(self._branch(statement), self.ways(statement.otherwise))
        elif isinstance(statement, For):
            inner = self._loop(statement)
        else:
            inner = self._jump(statement)
        return {way: span.plus(Bounds(own, own)) for way, span in inner.items()}

    def _branch(self, statement: If) -> _Ways:
        """Return the exits of THEN; a jump that is all of an IF is in the IF's time (decision)."""
        first = statement.then[0] if len(statement.then) == 1 and not statement.otherwise else None
        return self._jump(first) if isinstance(first, Goto) else self.ways(statement.then)

    def _jump(self, statement: Statement) -> _Ways:
        if isinstance(statement, Goto):
            return self._to_line(statement.line, gosub=False)
        if isinstance(statement, Gosub):
            return self._to_line(statement.line, gosub=True)
        if isinstance(statement, OnJump):
            past: _Ways = {_Way.NEXT: NOTHING}
            return _join(past, *(self._to_line(line, statement.gosub) for line in statement.lines))
        if isinstance(statement, Return) and self.inside:
            return {_Way.RETURN: NOTHING}
        if isinstance(statement, (End, Stop)):
            return {_Way.END if isinstance(statement, End) else _Way.STOP: NOTHING}
        past = {_Way.NEXT: NOTHING}
        return _join(past, *(self._to_line(line, gosub=False) for line in jumps_of(statement)))

    def _to_line(self, line: int, gosub: bool) -> _Ways:
        """Return the exits of a jump or a GOSUB; one that nests too deep is skipped."""
        if not gosub:
            return {("line", line): NOTHING}
        inner = self.subroutines.get(line, {_Way.RETURN: NOTHING})
        return {_Way.NEXT if way is _Way.RETURN else way: span for way, span in inner.items()}

    def _loop(self, statement: For) -> _Ways:
        turns = self._turns(statement)
        if turns == 0:
            return {_Way.NEXT: NOTHING}
        body = self.ways(statement.body)
        turn = body.get(_Way.NEXT)
        if turn is not None:
            turn = turn.plus(Bounds(self.model.turn_ns, self.model.turn_ns))
        most_before = (turns - 1) * turn.most if turns and turn else 0
        left: _Ways = {
            way: Bounds(span.least, most_before + span.most) for way, span in body.items() if way is not _Way.NEXT
        }
        if turns is None:
            left[_Way.NEXT] = NOTHING if turn is None else Bounds(0, turn.most)
        elif turn is not None:
            left[_Way.NEXT] = Bounds(turns * turn.least, turns * turn.most)
        return left

    def _turns(self, statement: For) -> int | None:
        """Return the turns of a loop of whole literals whose variable only the loop sets, else None."""
        first, last = constant_value(statement.start), constant_value(statement.stop)
        step = constant_value(statement.step or IntegerLiteral(1))
        if not all(type(value) is int for value in (first, last, step)) or step == 0:
            return None
        if not statement.variable.type.is_integer or not counts_alone(self.program, statement):
            return None
        low, high = map(int, statement.variable.type.range)
        return _count(int(first or 0), int(last or 0), int(step or 1), (low, high))


def _count(first: int, last: int, step: int, bounds: tuple[int, int]) -> int:
    """Return the turns from first to last; the loop ends where its variable would leave its range."""
    low, high = bounds
    first = min(max(first, low), high)
    last = min(last, high) if step > 0 else max(last, low)
    return max(0, (last - first) // step + 1)


def _join(*several: _Ways) -> _Ways:
    result: _Ways = {}
    for ways in several:
        for way, span in ways.items():
            result[way] = span.joined(result.get(way))
    return result
