"""Translation of Python statements, with the known range of each name.

A loop is translated repeatedly until the ranges known at its top are valid for every turn; the result is kept, so that
an inner loop does not start from the beginning each time.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Callable
from typing import Any

from automax_ros.compile.base.native_source import NotNative
from automax_ros.compile.native.translate.environment import Environment, joined
from automax_ros.compile.native.translate.frame import Frame
from automax_ros.compile.native.translate.ranges import Range
from automax_ros.compile.native.translate.typed import Typed, bare, c_type, whole_text

_PASSING = re.compile(r"(b\d+_\w+|t\d+|over|dropped)$")
"""Locals of one block or statement."""

MOST_TURNS = 200
"""Most translations of a loop, each for wider ranges at its top; each name takes a few."""


class Body:
    """Translates the statements of one function."""

    def __init__(self, frame: Frame) -> None:
        self.frame = frame
        self._loops: list[_Loop] = []
        self._depth = 0

    def execute(self, statements: list[ast.stmt], known: Environment | None) -> Environment | None:
        """Emit statements; return the ranges known after them, None where that place is not reached."""
        before, self.frame.touched = self.frame.touched, set()
        self._depth += 1
        known = self._execute(statements, known)
        self._depth -= 1
        self.frame.touched |= before
        return known

    def _execute(self, statements: list[ast.stmt], known: Environment | None) -> Environment | None:
        passed: set[str] = set()
        lines = [*(getattr(statement, "lineno", 0) for statement in statements), 0]
        for place, statement in enumerate(statements):
            if known is None:
                return None
            try:
                known = self._carry_out_one(statement, known)
            except NotNative as error:
                if error.line:
                    raise
                raise NotNative(error.reason, lines[place]) from None
            if known is not None and lines[place] and lines[place] != lines[place + 1]:
                known = self._without_passing(self._held_to_types(known))
                passed |= self.frame.touched
                self.frame.touched.clear()
        self.frame.touched |= passed
        return known

    def _without_passing(self, known: Environment) -> Environment:
        """Return the known ranges without the names that nothing reads after a BASIC line of straight code."""
        fields = self.frame.fields
        if self._depth > 1:
            return known
        gone = {name for name in self.frame.touched if name not in fields and _PASSING.match(name)}
        return known.without(gone) if gone else known

    def _held_to_types(self, known: Environment) -> Environment:
        """Emit, at the end of a BASIC line, the end of the scan if a variable is outside its range.

        No block leaves a variable outside it, but for some, such as RAMP, ranges alone do not prove that.
        """
        frame = self.frame
        for name in sorted(frame.touched):
            declared = frame.declared.get(name)
            if declared is None or name not in known or declared.holds(known[name]):
                continue
            present = known[name]
            if present.kind is not declared.kind:
                raise NotNative(f"{name} would hold a value of another kind than its own")
            place = frame.read(name, known).text
            tests = [f"{place} < {whole_text(int(declared.low))}"] * (present.low < declared.low)
            tests += [f"{place} > {whole_text(int(declared.high))}"] * (present.high > declared.high)
            frame.emit(f"if ({' || '.join(tests)}) return AUTOMAX_FAULT;")
            low, high = max(present.low, declared.low), min(present.high, declared.high)
            known = known.setting(name, Range(declared.kind, low, high))
        return known

    def _carry_out_one(self, statement: ast.stmt, known: Environment) -> Environment | None:
        carry_out = self._statements.get(type(statement))
        if carry_out is None:
            raise NotNative(f"a statement of the kind {type(statement).__name__}")
        return carry_out(self, statement, known)

    def asked(self) -> None:
        """Emit the end of the scan if something in the statement requested it; a function leaves that to the scan."""
        if self.frame.asks_end and self.frame.is_scan:
            self.frame.emit("if (*ended) return *ended;")
        self.frame.asks_end = False

    def _assign(self, statement: ast.Assign, known: Environment) -> Environment:
        known = known.copy()
        target = statement.targets[0]
        if isinstance(target, ast.Tuple):
            self._assign_all(target, statement.value, known)
        else:
            self._assign_one(target, self.frame.value(statement.value, known), known)
        self.asked()
        return known

    def _assign_all(self, targets: ast.Tuple, value: ast.expr, known: Environment) -> None:
        if isinstance(value, ast.Tuple):
            results = [self.frame.value(item, known) for item in value.elts]
            results = [self._keep(item) for item in results]
        elif isinstance(value, ast.Call):
            results = self.frame.call(value, known)
        else:
            raise NotNative("an assignment to several names")
        for target, result in zip(targets.elts, results, strict=True):
            self._assign_one(target, result, known)

    def _keep(self, item: Typed) -> Typed:
        """Return a value in a separate local: names in it are about to change."""
        name = self.frame.temporary(item.range)
        self.frame.emit(f"{name} = {bare(item.text)};")
        return Typed(name, item.range)

    def _assign_one(self, target: ast.expr, item: Typed, known: Environment) -> None:
        if item.mixed:
            raise NotNative("a value that is an integer or a REAL, as it happens")
        if isinstance(target, ast.Name):
            if target.id in self.frame.arrays:
                raise NotNative("an array as a whole")
            self.frame.store(target.id, item, known)
            return
        if not (isinstance(target, ast.Subscript) and isinstance(target.value, ast.Name)):
            raise NotNative("an assignment to what is not a name")
        name = target.value.id
        array = self.frame.arrays.get(name)
        if array is None:
            raise NotNative(f"an element of {name}")
        place = self.frame.place_in(array.size, target.slice, known)
        item = self.frame.held(item, self.frame.declared.get(name))
        self.frame.emit(f"{array.place}[{bare(place)}] = {bare(item.text)};")
        known[name] = known[name].joined(item.range)
        c_type(known[name])

    def _add(self, statement: ast.AugAssign, known: Environment) -> Environment:
        target = statement.target
        if not isinstance(target, ast.Name):
            raise NotNative("a sum into what is not a name")
        known = known.copy()
        node = ast.BinOp(ast.Name(target.id, ast.Load()), statement.op, statement.value)
        self.frame.store(target.id, self.frame.value(node, known), known)
        self.asked()
        return known

    def _if(self, statement: ast.If, known: Environment) -> Environment | None:
        frame = self.frame
        test = self._test(statement.test, known)
        then = frame.refined(statement.test, known, truth=True)
        otherwise = frame.refined(statement.test, known, truth=False)
        if then is None:
            return self.execute(statement.orelse, otherwise)
        if otherwise is None:
            return self.execute(statement.body, then)
        frame.emit(f"if ({bare(test)}) {{")
        with frame.indented():
            then = self.execute(statement.body, then)
        begin = len(frame.lines)
        frame.emit("} else {")
        with frame.indented():
            otherwise = self.execute(statement.orelse, otherwise)
        if len(frame.lines) == begin + 1:
            frame.lines.pop()
        frame.emit("}")
        frame.unite_else(begin)
        return joined(then, otherwise)

    def _test(self, node: ast.expr, known: Environment) -> str:
        """Return a test in C; one that can end the scan is evaluated before."""
        test = self.frame.value(node, known)
        if not self.frame.asks_end:
            return test.text
        kept = self._keep(test)
        self.asked()
        return kept.text

    def _while(self, statement: ast.While, known: Environment) -> Environment | None:
        frame, kept = self.frame, self.frame.loops.get(id(statement))
        top = known if kept is None else known.joined(kept)
        begin = len(frame.lines)
        for _ in range(MOST_TURNS):
            loop = _Loop()
            self._loops.append(loop)
            del frame.lines[begin:]
            leaves = self._turn(statement, top, loop)
            self._loops.pop()
            again = top if loop.continued is None else top.joined(loop.continued)
            grown = {
                name: after
                for name, before, after in top.differing(again)
                if before is None or after is None or not before.holds(after)
            }
            if not grown:
                break
            wider = again.copy()
            for name, after in grown.items():
                if after is not None:
                    wider[name] = frame.pinned(name, top[name].widened(after))
            top = wider
        else:
            raise NotNative("a loop in which a value has no bounds")
        frame.loops[id(statement)] = top
        return joined(leaves, loop.broken)

    def _turn(self, statement: ast.While, top: Environment, loop: _Loop) -> Environment | None:
        """Emit the loop; return the ranges known where its test fails."""
        frame = self.frame
        begin = len(frame.lines)
        with frame.indented():
            test = self._test(statement.test, top)
        if len(frame.lines) == begin:
            frame.emit(f"while ({bare(test)}) {{")
        else:
            frame.lines.insert(begin, "    " * frame.depth + "for (;;) {")
        with frame.indented():
            if len(frame.lines) > begin + 1:
                frame.emit(f"if (!{test}) break;")
            out = self.execute(statement.body, frame.refined(statement.test, top, truth=True))
        frame.emit("}")
        loop.continued = joined(loop.continued, out)
        return frame.refined(statement.test, top, truth=False)

    def _break(self, _: ast.Break, known: Environment) -> None:
        self.frame.emit("break;")
        self._loops[-1].broken = joined(self._loops[-1].broken, known)

    def _continue(self, _: ast.Continue, known: Environment) -> None:
        self.frame.emit("continue;")
        self._loops[-1].continued = joined(self._loops[-1].continued, known)

    def _pass(self, _: ast.Pass, known: Environment) -> Environment:
        return known

    def _expression(self, statement: ast.Expr, known: Environment) -> Environment | None:
        if isinstance(statement.value, ast.Constant):
            return known
        if not isinstance(statement.value, ast.Call):
            raise NotNative("an expression as a statement")
        for item in self.frame.call(statement.value, known):
            self.frame.emit(f"{item.text};")
        self.asked()
        return known

    def _raise(self, statement: ast.Raise, known: Environment) -> None:
        call = statement.exc
        if not (isinstance(call, ast.Call) and isinstance(call.func, ast.Name) and call.func.id == "ScanTooLong"):
            raise NotNative("an exception")
        line = self.frame.value(call.args[0], known)
        self.frame.emit(f"host->too_long_line = {line.text};")
        self.frame.emit("return AUTOMAX_TOO_LONG;")

    def _return(self, statement: ast.Return, known: Environment) -> None:
        value = statement.value
        if isinstance(value, ast.IfExp) and ast.Tuple in (type(value.body), type(value.orelse)):
            self._if(ast.If(value.test, [ast.Return(value.body)], [ast.Return(value.orelse)]), known)
            return
        if isinstance(value, ast.Call):
            first, *others = self.frame.call(value, known)
            self._deliver([self._keep(first) if others else first, *others])  # the call sets the others
            return
        nodes = value.elts if isinstance(value, ast.Tuple) else [value]
        self._deliver([self.frame.value(node, known) for node in nodes if node is not None])

    def _deliver(self, results: list[Typed]) -> None:
        for number, item in enumerate(results[1:], 1):
            self.frame.emit(f"*result_{number} = {bare(item.text)};")
        self.frame.emit(f"return {bare(results[0].text)};")
        if any(item.mixed for item in results):
            raise NotNative("a result that is an integer or a REAL, as it happens")
        self.frame.returned.append([item.range for item in results])

    _statements: dict[type[ast.stmt], Callable[[Any, Any, Environment], Environment | None]] = {  # noqa: RUF012
        ast.Assign: _assign,
        ast.AugAssign: _add,
        ast.If: _if,
        ast.While: _while,
        ast.Break: _break,
        ast.Continue: _continue,
        ast.Pass: _pass,
        ast.Expr: _expression,
        ast.Raise: _raise,
        ast.Return: _return,
    }


class _Loop:
    """The ranges known where a loop is left by BREAK, and where its turns end."""

    def __init__(self) -> None:
        self.broken: Environment | None = None
        self.continued: Environment | None = None
