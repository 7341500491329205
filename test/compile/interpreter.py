"""A task by walking its syntax tree: an independent model of what the compiler makes, from the rules of semantics.

It knows values, not static types or bounds: every intermediate is clamped, every value has its own kind.
"""

from __future__ import annotations

import math

from automax_ros.blocks.declare.instance import Instance
from automax_ros.core.types import DataType, type_of_name
from automax_ros.language.program import Program
from automax_ros.language.tree import tree
from automax_ros.language.tree.tree import Scope
from compile.builtin_model import HIGH32, LARGEST, LOW32, Functions, single, whole

RANGES = {DataType.INTEGER: (-32768, 32767, 7020), DataType.DOUBLE: (LOW32, HIGH32, 7021)}


class Jump(Exception):
    def __init__(self, line):
        self.line = line


class Leave(Exception):
    """RETURN from a subroutine."""


class Ended(Exception):
    """The scan is over; ``stopped`` by STOP."""

    def __init__(self, stopped):
        self.stopped = stopped


class Interpreter(Functions):
    """``commons`` is actual memory, of which no write changes ``forced``.

    ``log`` (line, code) and ``writes`` (kind, name, element, value) are filled.
    """

    def __init__(self, program: Program) -> None:
        self.program = program
        self.locals = {
            name: self._fresh(symbol) for name, symbol in program.symbols.items() if symbol.scope is Scope.LOCAL
        }
        self.commons = {
            name: self._fresh(symbol) for name, symbol in program.symbols.items() if symbol.scope is Scope.COMMON
        }
        self.latch = {}
        self.forced = set()
        self.log, self.writes, self.printed = [], [], []
        self.blocks = {}
        self.pointer = 0
        self.line = 0
        self.depth = 0
        self.overflow = 0
        self.errors = 0
        self.stopped = False

    def _fresh(self, symbol):
        if symbol.tuning is not None:
            return symbol.tuning.current
        return [symbol.type.zero] * symbol.elements if symbol.dimensions else symbol.type.zero

    def run(self):
        self.pointer, self.blocks = 0, {}
        self.line = 0
        self._all(self.program.startup)

    def scan(self):
        latched = [name for name, symbol in self.program.symbols.items() if symbol.latched]
        self.latch = {name: self.commons[name] for name in latched}
        before = dict(self.latch)
        self.line = self.program.scan_loop_line
        if self._all(self.program.scan):
            return
        for name in latched:
            if self.latch[name] != before[name]:
                self._write_common("COMMIT", name, 0, self.latch[name])

    def _all(self, statements) -> bool:
        """Carry statements out from the top; return whether STOP ended them."""
        self.depth = 0
        try:
            self._list(statements)
        except Ended as end:
            self.stopped = end.stopped
            return end.stopped
        return False

    # Statements

    def _list(self, statements, start=0):
        numbers = {item.number: index for index, item in enumerate(statements) if item.number is not None}
        index = start
        while index < len(statements):
            try:
                self._one(statements[index])
                index += 1
            except Jump as jump:
                if jump.line not in numbers:
                    raise
                index = numbers[jump.line]

    def _one(self, statement):
        if statement.number is not None:
            self.line = statement.number
        method = getattr(self, f"_do_{type(statement).__name__.lower()}", None)
        if method is not None:
            method(statement)

    def _framed(self, work):
        """One statement: its first overflow is logged at its end."""
        line, self.overflow = self.line, 0
        result = work()
        if self.overflow:
            self._error(self.overflow, line)
        return result

    def _do_assignment(self, statement):
        self._framed(lambda: self._store(statement.target, self.value(statement.value)))

    def _do_if(self, statement):
        chosen = statement.then if self._framed(lambda: self.value(statement.condition)) else statement.otherwise
        self._list(chosen)

    def _do_for(self, statement):
        variable = statement.variable

        def begin():
            first = self.value(statement.start)
            last = self.value(statement.stop)
            step = 1 if statement.step is None else self.value(statement.step)
            self._store(variable, first)
            if step == 0:
                self._error(7027)
            return last, step

        last, step = self._framed(begin)
        while step:
            value = self.value(variable)
            if (value > last) if step > 0 else (value < last):
                break
            self._list(statement.body)

            def following():
                low, high, code = RANGES.get(variable.type, (0, 0, 0))
                total = self.value(variable) + step
                if variable.type.is_integer:
                    total = whole(total)
                    if not low <= total <= high:
                        total = low if total < low else high
                        self._note(code)
                self._store(variable, total)
                return bool(self.overflow)

            if self._framed(following):
                break

    def _do_goto(self, statement):
        raise Jump(statement.line)

    def _do_gosub(self, statement):
        self._call(statement.line)

    def _call(self, line):
        if self.depth == 16:
            self._error(7028)
            return
        self.depth += 1
        try:
            self._from_line(line)
        except Leave:
            self.depth -= 1
            return
        raise Ended(False)

    def _from_line(self, line):
        """The subroutine stands on the top level."""
        statements = self.program.scan
        if line not in [item.number for item in statements]:
            statements = self.program.startup
        self._list(statements, [item.number for item in statements].index(line))

    def _do_return(self, _):
        if self.depth == 0:
            self._error(7029)
        else:
            raise Leave

    def _do_onjump(self, statement):
        selector = self._framed(lambda: self.value(statement.selector))
        if 1 <= selector <= len(statement.lines):
            line = statement.lines[selector - 1]
            if statement.gosub:
                self._call(line)
            else:
                raise Jump(line)

    def _do_end(self, _):
        raise Ended(False)

    def _do_stop(self, _):
        raise Ended(True)

    def _do_print(self, statement):
        def put():
            text = ""
            for item, separator in zip(statement.items, statement.separators, strict=True):
                text += self.text(self.value(item))
                if separator == ",":
                    text += " " * (14 - len(text) % 14)
            self.printed.append(text)

        self._framed(put)

    def _do_read(self, statement):
        self._framed(lambda: [self._read_one(target) for target in statement.targets])

    def _read_one(self, target):
        if self.pointer >= len(self.program.data):
            self._error(7030)
            return
        value = self.program.data[self.pointer]
        self.pointer += 1
        kinds = {bool: DataType.BOOLEAN, str: DataType.STRING}
        kind = kinds.get(type(value))
        if kind is not (target.type if target.type in kinds.values() else None):
            self._error(7032)
            value = target.type.zero
        self._store(target, value)

    def _do_restore(self, statement):
        line = statement.line or 0
        self.pointer = next(
            (first for number, first in self.program.data_lines if number >= line), len(self.program.data)
        )

    def _do_clearerrorlog(self, _):
        self.errors = 0

    def _do_call(self, statement):
        bound = self.program.calls[statement.span]
        self.line = bound.line
        constants = (tree.IntegerLiteral, tree.RealLiteral, tree.BooleanLiteral)
        inputs = {item.name for item in bound.block.inputs}
        given = {name: value for name, value in bound.arguments.items() if name in inputs}
        fixed = {name.lower(): value.value for name, value in given.items() if isinstance(value, constants)}
        if statement.span not in self.blocks:
            self.blocks[statement.span] = Instance(bound.block, self.program.period_ns, **fixed)
        block = self.blocks[statement.span]
        now = {name.lower(): self._seen(value) for name, value in given.items() if name.lower() not in fixed}
        outputs = {output.name: output for output in bound.block.outputs}
        targets = [(outputs[name], target) for name, target in bound.arguments.items() if name in outputs]
        elements = {output.name: self.index(target) for output, target in targets if isinstance(target, tree.Element)}
        results = block.scan(**now)
        if block.error:
            self._error(block.error)
        for output, target in targets:
            if block.wrote or not output.holds:
                self._put_at(target, elements.get(output.name), results[output.variable], in_block=True)

    def _seen(self, given):
        if isinstance(given, tree.Unary):
            return not self._seen(given.operand)
        return self.latch[given.name] if given.name in self.latch else self.value(given)

    # Stores

    def _store(self, target, value):
        kind = target.type
        if kind is DataType.STRING:
            value = value[: self.program.symbols[target.name].length]
        elif kind is DataType.REAL:
            value, clamped = single(float(value))
            if clamped:
                self._note(7022)
        elif kind.is_integer:
            low, high, code = RANGES[kind]
            value = whole(value) if isinstance(value, float) else int(value)
            if not low <= value <= high:
                value = low if value < low else high
                self._note(code)
        self._put(target, value)

    def _put(self, target, value):
        self._put_at(target, self.index(target) if isinstance(target, tree.Element) else None, value)

    def _put_at(self, target, element, value, in_block=False):
        name = target.name
        if isinstance(target, tree.Element) and element is None:
            self._error(7026)
            return
        if name in self.locals:
            if element is None:
                self.locals[name] = value
            else:
                self.locals[name][element] = value
        elif name in self.forced:
            return
        elif in_block and name in self.latch:
            self.latch[name] = value
        else:
            self._write_common("BASIC", name, element or 0, value)

    def _write_common(self, kind, name, element, value):
        self.writes.append((kind, name, element, value))
        if self.program.symbols[name].dimensions:
            self.commons[name][element] = value
        else:
            self.commons[name] = value

    # Expressions

    def index(self, element):
        """Flat index, None where a subscript is out of range."""
        subscripts = [self.value(item) for item in element.subscripts]
        flat = 0
        for subscript, size in zip(subscripts, self.program.symbols[element.name].dimensions, strict=True):
            if not 0 <= subscript < size:
                return None
            flat = flat * size + subscript
        return flat

    def value(self, node):
        return getattr(self, f"_{type(node).__name__.lower()}")(node)

    def _integerliteral(self, node):
        return node.value

    _realliteral = _stringliteral = _booleanliteral = _integerliteral

    def _reference(self, node):
        return self.locals[node.name] if node.name in self.locals else self.commons[node.name]

    def _element(self, node):
        index = self.index(node)
        if index is None:
            self._error(7026)
            return type_of_name(node.name).zero
        return (self.locals[node.name] if node.name in self.locals else self.commons[node.name])[index]

    def _unary(self, node):
        operand = self.value(node.operand)
        if node.operator == "NOT":
            return (not operand) if isinstance(operand, bool) else -1 - operand
        if node.operator == "+":
            return operand
        if isinstance(operand, float):
            return -operand
        return self.fitted(-operand)

    def _binary(self, node):
        chain, first = [], node
        while isinstance(first, tree.Binary):
            chain.append(first)
            first = first.left
        left = self.value(first)
        for item in reversed(chain):
            left = self.operation(item.operator, left, self.value(item.right))
        return left

    def operation(self, operator, left, right):
        if operator in ("=", "<>", "<", ">", "<=", ">="):
            return {
                "=": left == right,
                "<>": left != right,
                "<": left < right,
                ">": left > right,
                "<=": left <= right,
                ">=": left >= right,
            }[operator]
        if operator in ("AND", "OR", "XOR"):
            result = {"AND": left & right, "OR": left | right, "XOR": left ^ right}[operator]
            return result if isinstance(left, bool) and isinstance(right, bool) else int(result)
        if isinstance(left, str):
            return (left + right)[:132]
        real = isinstance(left, float) or isinstance(right, float)
        left, right = (float(left), float(right)) if real else (int(left), int(right))
        if operator == "/":
            return self.quotient(left, right, real)
        if operator == "**":
            return self.real_power(left, right) if real else self.power(left, right)
        result = {"+": left + right, "-": left - right, "*": left * right}[operator]
        return result if real else self.fitted(result)

    def quotient(self, left, right, real):
        if right == 0:
            self._error(7024)
            most = LARGEST if real else HIGH32
            least = -LARGEST if real else LOW32
            return most if left > 0 else least if left < 0 else (0.0 if real else 0)
        if real:
            return left / right
        return self.fitted(abs(left) // abs(right) * (1 if (left < 0) == (right < 0) else -1))

    def power(self, base, exponent):
        if exponent < 0:
            if base == 0:
                self._error(7024)
                return HIGH32
            return base ** (exponent % 2) if abs(base) == 1 else 0
        # 40 doublings leave 32 bits as surely as more, of the same parity
        return self.fitted(base ** (exponent if exponent < 40 else 40 + exponent % 2))

    def real_power(self, base, exponent):
        if base == 0 and exponent < 0:
            self._error(7024)
            return LARGEST
        if base < 0 and exponent != math.floor(exponent) and math.isfinite(base) and math.isfinite(exponent):
            self._error(7025)
            return 0.0
        try:
            return math.pow(base, exponent)
        except OverflowError:
            self._note(7023)
            return -LARGEST if base < 0 and exponent % 2 == 1 else LARGEST

    def _functioncall(self, node):
        arguments = [self.value(argument) for argument in node.arguments]
        letter = {"%": "i", "$": "s", "@": "b"}.get(node.name[-1], "")
        return getattr(self, f"fn_{node.name.rstrip('%$@').lower()}{letter}")(*arguments)
