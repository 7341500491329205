"""Prints a syntax tree as text, in one canonical form that parses back to an equal tree.

Statements keep their numbers; one without a number is put on the line of the one before it. Blocks are indented, a CALL
that is too long for its line is broken at its parameters. Expressions have only the parentheses that precedence needs.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

from automax_ros.language.parse.declarations import TUNING_KEYS
from automax_ros.language.parse.expressions import LEVELS, NOT_LEVEL
from automax_ros.language.text.constants import REAL_DIGITS
from automax_ros.language.tree import tree
from automax_ros.language.tree.functions import FUNCTIONS
from automax_ros.language.tree.walk import statements_in_order

_SIGN_LEVEL = max(LEVELS.values()) + 1
_PRIMARY_LEVEL = _SIGN_LEVEL + 1


__all__ = ["numbered", "print_expression", "print_module"]
LINE_WIDTH = 100
_LAST_NUMBER = 32767
_STEP = 10


def print_expression(expression: tree.Expression) -> str:
    """Return an expression as text; raises ValueError for a string with both kinds of quotes."""
    if isinstance(expression, tree.Binary):
        level = LEVELS[expression.operator]
        left, right = _operand(expression.left, level), _operand(expression.right, level + 1)
        return f"{left} {expression.operator} {right}"
    if isinstance(expression, tree.Unary):
        if expression.operator == "NOT":
            return f"NOT {_operand(expression.operand, NOT_LEVEL + 1)}"
        return f"{expression.operator}{_operand(expression.operand, _PRIMARY_LEVEL)}"
    if isinstance(expression, tree.Reference):
        return expression.name
    if isinstance(expression, tree.Element):
        return f"{expression.name}({_list(expression.subscripts)})"
    if isinstance(expression, tree.FunctionCall):
        function = FUNCTIONS.get(expression.name)
        if not expression.arguments and function is not None and not function.arguments:
            return expression.name
        return f"{expression.name}({_list(expression.arguments)})"
    return _literal(expression)


def print_simple(statement: tree.Statement) -> str:
    """Return a statement other than IF and FOR as text, without its number.

    Raises ValueError for a string or a remark that cannot be written in the language.
    """
    return _SIMPLE[type(statement)](statement)


def print_argument(argument: tree.Argument) -> str:
    """Return a parameter of a CALL as text."""
    return f"{argument.keyword} = {print_expression(argument.value)}"


def _operand(expression: tree.Expression, level: int) -> str:
    own = _PRIMARY_LEVEL
    if isinstance(expression, tree.Binary):
        own = LEVELS[expression.operator]
    elif isinstance(expression, tree.Unary):
        own = NOT_LEVEL if expression.operator == "NOT" else _SIGN_LEVEL
    text = print_expression(expression)
    return text if own >= level else f"({text})"


def _list(items: tuple[tree.Expression, ...]) -> str:
    return ", ".join(print_expression(item) for item in items)


def _literal(literal: tree.IntegerLiteral | tree.RealLiteral | tree.StringLiteral | tree.BooleanLiteral) -> str:
    if isinstance(literal, tree.BooleanLiteral):
        return "TRUE" if literal.value else "FALSE"
    if isinstance(literal, tree.StringLiteral):
        quote = "'" if '"' in literal.value else '"'
        if quote in literal.value:
            raise ValueError("a string constant cannot hold both kinds of quotes")
        return f"{quote}{literal.value}{quote}"
    if isinstance(literal, tree.RealLiteral):
        return literal.text or _real(literal.value)
    if literal.hexadecimal:
        digits = f"{literal.value % 2**32:X}"
        return f"{'' if digits[0].isdigit() else '0'}{digits}H"
    return str(literal.value)


def _real(value: float) -> str:
    """Return a real constant of at most 8 digits, with its decimal point."""
    text = f"{value:.8G}"
    if "." in text or "E" in text:
        return text
    return f"{text}.0" if len(text.lstrip("-")) < REAL_DIGITS else f"{text}."


def _declaration(item: tree.Declared) -> str:
    text = item.name if item.length is None else f"{item.name}:{item.length}"
    if item.subscripts:
        text += f"({_numbers(item.subscripts)})"
    if item.tuning is None:
        return text
    keys = {key: getattr(item.tuning, key.lower()) for key in TUNING_KEYS}
    given = ", ".join(f"{key}={print_expression(value)}" for key, value in keys.items() if value is not None)
    return f"{text} [{given}]"


def _numbers(numbers: tuple[int, ...]) -> str:
    return ", ".join(str(number) for number in numbers)


def _on_jump(statement: tree.OnJump) -> str:
    word = "GOSUB" if statement.gosub else "GOTO"
    return f"ON {print_expression(statement.selector)} {word} {_numbers(statement.lines)}"


def _items(statement: tree.Print | tree.PrintFile) -> str:
    parts = []
    for index, item in enumerate(statement.items):
        separator = statement.separators[index] if index < len(statement.separators) else ""
        parts.append(print_expression(item) + separator)
    return " ".join(parts)


def _event(event: tree.Event) -> str:
    text = f"EVENT NAME = {event.name}"
    if event.interrupt_status is not None:
        text += f", INTERRUPT_STATUS = {event.interrupt_status.name}"
    return text if event.timeout is None else f"{text}, TIMEOUT = {event.timeout}"


def _remark(remark: tree.Remark) -> str:
    lines = remark.text.split("\n")
    if any(line.endswith("&") or "\r" in line for line in lines):
        raise ValueError("a line of a remark cannot end with `&` or hold a carriage return")
    mark = "!" if remark.costs else "REM"
    text = " &\n".join(lines)
    return f"{mark} {text}" if text else mark


def _time(word: str, statement: tree.Delay | tree.StartEvery) -> str:
    return f"{word} {print_expression(statement.count)} {statement.unit.value}"


def _open_channel(statement: tree.OpenChannel) -> str:
    letters = {kind: letter for letter, kind in tree.ITEM_TYPES.items()}
    types = ", ".join(letters[kind] for kind in statement.types)
    text = f"OPEN CHANNEL FOR {statement.direction.value} AS FILE #{statement.file}, TYPE = ({types})"
    return text if statement.depth is None else f"{text}, DEPTH = {print_expression(statement.depth)}"


def _open_port(statement: tree.OpenPort) -> str:
    text = f"OPEN {_literal(tree.StringLiteral(statement.port))} AS FILE #{statement.file}"
    if statement.setup is None:
        return f"{text}, ACCESS = {statement.access}"
    text += f", SETUP = {print_expression(statement.setup)}"
    return text if statement.baud is None else f"{text}, {print_expression(statement.baud)}"


def _file(word: str, number: int, items: str, branch: str = "", line: int | None = None) -> str:
    """Return a statement of a channel or port; ``branch`` is the key before its ``line``."""
    head = word if line is None else f"{word}:{branch}={line}"
    return f"{head} #{number}, {items}" if items else f"{head} #{number}"


_SIMPLE: dict[type[tree.Statement], Callable[[Any], str]] = {
    tree.Declaration: lambda it: f"{it.scope.value} {', '.join(_declaration(item) for item in it.variables)}",
    tree.Assignment: lambda it: f"{print_expression(it.target)} = {print_expression(it.value)}",
    tree.Goto: lambda it: f"GOTO {it.line}",
    tree.Gosub: lambda it: f"GOSUB {it.line}",
    tree.Return: lambda _: "RETURN",
    tree.OnJump: _on_jump,
    tree.Read: lambda it: f"READ {_list(it.targets)}",
    tree.Data: lambda it: f"DATA {_list(it.values)}",
    tree.Restore: lambda it: "RESTORE" if it.line is None else f"RESTORE {it.line}",
    tree.Print: lambda it: f"PRINT {_items(it)}".rstrip(),
    tree.Stop: lambda _: "STOP",
    tree.Event: _event,
    tree.Call: lambda it: f"CALL {it.block}({', '.join(print_argument(item) for item in it.arguments)})",
    tree.IoWrite: lambda it: f"IOWRITE {_list((it.slot, it.register, it.value))}",
    tree.ClearErrorLog: lambda _: "CLR_ERRLOG",
    tree.End: lambda _: "END",
    tree.Remark: _remark,
    tree.Label: lambda _: "",
    tree.SetEvent: lambda it: f"SET {it.event}",
    tree.WaitOn: lambda it: f"WAIT ON {it.event}",
    tree.Delay: lambda it: _time("DELAY", it),
    tree.StartEvery: lambda it: _time("START EVERY", it),
    tree.OpenChannel: _open_channel,
    tree.OpenPort: _open_port,
    tree.Close: lambda it: _file("CLOSE", it.file, ""),
    tree.InputFile: lambda it: _file("INPUT", it.file, _list(it.targets), "EMPTY", it.empty),
    tree.PrintFile: lambda it: _file("PRINT", it.file, _items(it), "FULL", it.full),
    tree.Get: lambda it: _file("GET", it.file, print_expression(it.target), "EMPTY", it.empty),
    tree.Put: lambda it: _file("PUT", it.file, print_expression(it.item)),
}
"""The printed form of each statement but IF and FOR."""


def print_module(module: tree.Module) -> str:
    """Return the text of a task.

    A tree in which no statement has a number is numbered first. Raises ValueError for a tree that has no text, such as
    one with a statement without a number after a remark.
    """
    if not any(statement.number is not None for statement, _ in statements_in_order(module.statements)):
        module = numbered(module)
    writer = _Writer()
    writer.statements(module.statements)
    return writer.text()


def numbered(module: tree.Module) -> tree.Module:
    """Return the tree with every statement on a separate line, numbered in tens (closer in long tasks).

    ELSE, END_IF and NEXT get numbers as well, as labels. Raises ValueError above 32767 statements.
    """
    count = _Numbering(_STEP).statements(module.statements, count_only=True)[1]
    step = min(_STEP, _LAST_NUMBER // max(count, 1))
    if step == 0:
        raise ValueError(f"{count} lines are more than there are line numbers")
    return tree.Module(_Numbering(step).statements(module.statements)[0])


class _Numbering:
    def __init__(self, step: int) -> None:
        self._step = step
        self._count = 0

    def statements(
        self, statements: tuple[tree.Statement, ...], count_only: bool = False
    ) -> tuple[tuple[tree.Statement, ...], int]:
        """Return the statements with numbers, and the count of numbers assigned."""
        result: list[tree.Statement] = []
        for statement in statements:
            if isinstance(statement, tree.Label):
                continue
            result.extend(self._statement(statement))
        return (() if count_only else tuple(result)), self._count

    def _statement(self, statement: tree.Statement) -> list[tree.Statement]:
        first = dataclasses.replace(statement, number=self._next())
        if isinstance(first, tree.For):
            body = self.statements(first.body)[0]
            return [dataclasses.replace(first, body=(*body, tree.Label(number=self._next())))]
        if isinstance(first, tree.If) and not first.one_line:
            then = self.statements(first.then)[0]
            otherwise = first.otherwise
            if otherwise:
                then = (*then, tree.Label(number=self._next()))
                otherwise = self.statements(otherwise)[0]
            return [dataclasses.replace(first, then=then, otherwise=otherwise), tree.Label(number=self._next())]
        return [first]

    def _next(self) -> int:
        self._count += 1
        return self._count * self._step


class _Writer:
    """Collects lines, with several statements on one where that is allowed."""

    def __init__(self) -> None:
        self._lines: list[str] = []
        self._last: tree.Statement | None = None
        self._indent = 0

    def text(self) -> str:
        return "".join(f"{line}\n" for line in self._lines)

    def statements(self, statements: tuple[tree.Statement, ...]) -> None:
        """Write statements; the label after a block IF is the number of its END_IF."""
        index = 0
        while index < len(statements):
            statement = statements[index]
            index += 1
            if isinstance(statement, tree.If) and not statement.one_line:
                label = statements[index] if index < len(statements) else None
                ends = isinstance(label, tree.Label)
                self._block_if(statement, label.number if label is not None and ends else None)
                index += ends
            elif isinstance(statement, tree.For):
                self._for(statement)
            elif isinstance(statement, tree.If):
                self._emit(statement.number, self._one_line(statement), statement)
            elif isinstance(statement, tree.Call):
                self._call(statement)
            else:
                self._emit(statement.number, print_simple(statement), statement)

    def _emit(self, number: int | None, text: str, statement: tree.Statement | None) -> None:
        if number is not None:
            self._lines.append(f"{number} {'  ' * self._indent}{text}".rstrip(" "))
        else:
            self._check_same_line(statement)
            self._lines[-1] += f" \\ {text}"
        self._last = statement

    def _check_same_line(self, statement: tree.Statement | None) -> None:
        if not self._lines:
            raise ValueError("the first statement has no line number")
        if isinstance(self._last, (tree.Remark, tree.Label)):
            raise ValueError("a statement after a remark or a bare number needs a line number")
        if isinstance(self._last, tree.If) and self._last.one_line and not isinstance(statement, tree.Remark):
            raise ValueError("a statement after a one-line IF needs a line number")

    def _call(self, statement: tree.Call) -> None:
        text = print_simple(statement)
        if len(text) <= LINE_WIDTH or len(statement.arguments) < 2:
            self._emit(statement.number, text, statement)
            return
        arguments = [print_argument(argument) for argument in statement.arguments]
        self._emit(statement.number, f"CALL {statement.block}({arguments[0]}, &", statement)
        margin = " " * self._lines[-1].rindex(arguments[0])
        self._lines.extend(f"{margin}{argument}, &" for argument in arguments[1:-1])
        self._lines.append(f"{margin}{arguments[-1]})")

    def _for(self, statement: tree.For) -> None:
        step = "" if statement.step is None else f" STEP {print_expression(statement.step)}"
        first, last = print_expression(statement.start), print_expression(statement.stop)
        name = statement.variable.name
        self._emit(statement.number, f"FOR {name} = {first} TO {last}{step}", None)
        number, body = _split_label(statement.body)
        self._inner(body)
        self._emit(number, f"NEXT {name}", None)

    def _block_if(self, statement: tree.If, end: int | None) -> None:
        self._emit(statement.number, f"IF {print_expression(statement.condition)} THEN", None)
        number, then = _split_label(statement.then)
        self._inner(then)
        if number is not None or statement.otherwise:
            self._emit(number, "ELSE", None)
            self._inner(statement.otherwise)
        self._emit(end, "END_IF", None)

    def _inner(self, statements: tuple[tree.Statement, ...]) -> None:
        self._indent += 1
        self.statements(statements)
        self._indent -= 1

    def _one_line(self, statement: tree.If) -> str:
        if not statement.then:
            raise ValueError("a one-line IF needs a statement after THEN")
        text = f"IF {print_expression(statement.condition)} THEN {self._branch(statement.then)}"
        if not statement.otherwise:
            return text
        if _takes_else(statement.then[-1]):
            raise ValueError("ELSE would belong to the inner IF of a one-line IF")
        return f"{text} ELSE {self._branch(statement.otherwise)}"

    def _branch(self, statements: tuple[tree.Statement, ...]) -> str:
        parts = []
        for index, statement in enumerate(statements):
            if isinstance(statement, (tree.Remark, tree.Label, tree.For)) or _is_block_if(statement):
                raise ValueError(f"a one-line IF cannot hold a {type(statement).__name__}")
            if isinstance(statement, tree.If):
                if index < len(statements) - 1:
                    raise ValueError("an IF inside a one-line IF must be its last statement")
                parts.append(self._one_line(statement))
            elif index == 0 and isinstance(statement, tree.Goto):
                parts.append(str(statement.line))
            else:
                parts.append(print_simple(statement))
        return " \\ ".join(parts)


def _is_block_if(statement: tree.Statement) -> bool:
    return isinstance(statement, tree.If) and not statement.one_line


def _takes_else(statement: tree.Statement) -> bool:
    """Return whether a following ELSE would belong to this statement."""
    while isinstance(statement, tree.If):
        if not statement.otherwise:
            return True
        statement = statement.otherwise[-1]
    return False


def _split_label(statements: tuple[tree.Statement, ...]) -> tuple[int | None, tuple[tree.Statement, ...]]:
    """Return the number of the label at the end, and the rest; the label after a block IF is that of its END_IF."""
    if not statements or not isinstance(statements[-1], tree.Label):
        return None, statements
    before = statements[-2] if len(statements) > 1 else None
    if isinstance(before, tree.If) and not before.one_line:
        return None, statements
    return statements[-1].number, statements[:-1]
