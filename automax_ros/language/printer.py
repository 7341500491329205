"""Prints a syntax tree as text, in one canonical form that parses back to an equal tree.

Statements keep their numbers; one without a number is put on the line of the one before it. Blocks are indented, a CALL
that is too long for its line is broken at its parameters. Expressions have only the parentheses that precedence needs.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

from automax_ros.language.parse.expressions import LEVELS, NOT_LEVEL
from automax_ros.language.text.constants import REAL_DIGITS
from automax_ros.language.tree.basic_tree import (
    ITEM_TYPES,
    Close,
    Delay,
    Get,
    InputFile,
    OpenChannel,
    OpenPort,
    PrintFile,
    Put,
    StartEvery,
    WaitOn,
)
from automax_ros.language.tree.functions import FUNCTIONS
from automax_ros.language.tree.tree import (
    Argument,
    Assignment,
    Binary,
    BooleanLiteral,
    Call,
    ClearErrorLog,
    Data,
    Declaration,
    Declared,
    Element,
    End,
    Event,
    Expression,
    For,
    FunctionCall,
    Gosub,
    Goto,
    If,
    IntegerLiteral,
    IoWrite,
    Label,
    Module,
    OnJump,
    Print,
    Read,
    RealLiteral,
    Reference,
    Remark,
    Restore,
    Return,
    SetEvent,
    Statement,
    Stop,
    StringLiteral,
    Tuning,
    Unary,
)

_SIGN_LEVEL = max(LEVELS.values()) + 1
_PRIMARY_LEVEL = _SIGN_LEVEL + 1


__all__ = ["numbered", "print_expression", "print_module"]
LINE_WIDTH = 100
_LAST_NUMBER = 32767
_STEP = 10


def print_expression(expression: Expression) -> str:
    """Return an expression as text; raises ValueError for a string with both kinds of quotes."""
    if isinstance(expression, Binary):
        level = LEVELS[expression.operator]
        left, right = _operand(expression.left, level), _operand(expression.right, level + 1)
        return f"{left} {expression.operator} {right}"
    if isinstance(expression, Unary):
        if expression.operator == "NOT":
            return f"NOT {_operand(expression.operand, NOT_LEVEL + 1)}"
        return f"{expression.operator}{_operand(expression.operand, _PRIMARY_LEVEL)}"
    if isinstance(expression, Reference):
        return expression.name
    if isinstance(expression, Element):
        return f"{expression.name}({_list(expression.subscripts)})"
    if isinstance(expression, FunctionCall):
        function = FUNCTIONS.get(expression.name)
        if not expression.arguments and function is not None and not function.arguments:
            return expression.name
        return f"{expression.name}({_list(expression.arguments)})"
    return _literal(expression)


def print_simple(statement: Statement) -> str:
    """Return a statement other than IF and FOR as text, without its number.

    Raises ValueError for a string or a remark that cannot be written in the language.
    """
    if isinstance(statement, Declaration):
        return f"{statement.scope.value} {', '.join(_declared(item) for item in statement.variables)}"
    if isinstance(statement, Assignment):
        return f"{print_expression(statement.target)} = {print_expression(statement.value)}"
    if isinstance(statement, (Goto, Gosub)):
        return f"{'GOTO' if isinstance(statement, Goto) else 'GOSUB'} {statement.line}"
    if isinstance(statement, OnJump):
        word = "GOSUB" if statement.gosub else "GOTO"
        return f"ON {print_expression(statement.selector)} {word} {', '.join(str(line) for line in statement.lines)}"
    if isinstance(statement, Read):
        return f"READ {_list(statement.targets)}"
    if isinstance(statement, Data):
        return f"DATA {_list(statement.values)}"
    if isinstance(statement, Restore):
        return "RESTORE" if statement.line is None else f"RESTORE {statement.line}"
    if isinstance(statement, Print):
        return _print(statement)
    if isinstance(statement, Call):
        return f"CALL {statement.block}({', '.join(print_argument(item) for item in statement.arguments)})"
    return _rest(statement)


def print_argument(argument: Argument) -> str:
    """Return a parameter of a CALL as text."""
    return f"{argument.keyword} = {print_expression(argument.value)}"


def _rest(statement: Statement) -> str:
    if isinstance(statement, Event):
        return _event(statement)
    if isinstance(statement, IoWrite):
        return f"IOWRITE {_list((statement.slot, statement.register, statement.value))}"
    if isinstance(statement, Remark):
        return _remark(statement)
    if isinstance(statement, SetEvent):
        return f"SET {statement.event}"
    waiting = _WAITING.get(type(statement))
    if waiting is not None:
        return waiting(statement)
    words: dict[type[object], str] = {
        Return: "RETURN",
        Stop: "STOP",
        End: "END",
        ClearErrorLog: "CLR_ERRLOG",
        Label: "",
    }
    return words[type(statement)]


def _operand(expression: Expression, level: int) -> str:
    text = print_expression(expression)
    return text if _level(expression) >= level else f"({text})"


def _level(expression: Expression) -> int:
    if isinstance(expression, Binary):
        return LEVELS[expression.operator]
    if isinstance(expression, Unary):
        return NOT_LEVEL if expression.operator == "NOT" else _SIGN_LEVEL
    return _PRIMARY_LEVEL


def _list(items: tuple[Expression, ...]) -> str:
    return ", ".join(print_expression(item) for item in items)


def _literal(literal: IntegerLiteral | RealLiteral | StringLiteral | BooleanLiteral) -> str:
    if isinstance(literal, BooleanLiteral):
        return "TRUE" if literal.value else "FALSE"
    if isinstance(literal, StringLiteral):
        quote = "'" if '"' in literal.value else '"'
        if quote in literal.value:
            raise ValueError("a string constant cannot hold both kinds of quotes")
        return f"{quote}{literal.value}{quote}"
    if isinstance(literal, RealLiteral):
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


def _declared(item: Declared) -> str:
    length = "" if item.length is None else f":{item.length}"
    subscripts = f"({', '.join(str(count) for count in item.subscripts)})" if item.subscripts else ""
    tuning = "" if item.tuning is None else f" [{_tuning(item.tuning)}]"
    return f"{item.name}{length}{subscripts}{tuning}"


def _tuning(tuning: Tuning) -> str:
    keys = (("CURRENT", tuning.current), ("HIGH", tuning.high), ("LOW", tuning.low), ("STEP", tuning.step))
    return ", ".join(f"{key}={print_expression(value)}" for key, value in keys if value is not None)


def _print(statement: Print) -> str:
    return " ".join(["PRINT", *_printed(statement)])


def _printed(statement: Print | PrintFile) -> list[str]:
    parts = []
    for index, item in enumerate(statement.items):
        separator = statement.separators[index] if index < len(statement.separators) else ""
        parts.append(print_expression(item) + separator)
    return parts


def _event(event: Event) -> str:
    text = f"EVENT NAME = {event.name}"
    if event.interrupt_status is not None:
        text += f", INTERRUPT_STATUS = {event.interrupt_status.name}"
    return text if event.timeout is None else f"{text}, TIMEOUT = {event.timeout}"


def _remark(remark: Remark) -> str:
    lines = remark.text.split("\n")
    if any(line.endswith("&") or "\r" in line for line in lines):
        raise ValueError("a line of a remark cannot end with `&` or hold a carriage return")
    mark = "!" if remark.costs else "REM"
    text = " &\n".join(lines)
    return f"{mark} {text}" if text else mark


def _wait(statement: WaitOn) -> str:
    return f"WAIT ON {statement.event}"


def _delay(statement: Delay) -> str:
    return f"DELAY {print_expression(statement.count)} {statement.unit.value}"


def _start_every(statement: StartEvery) -> str:
    return f"START EVERY {print_expression(statement.count)} {statement.unit.value}"


def _open_channel(statement: OpenChannel) -> str:
    letters = {kind: letter for letter, kind in ITEM_TYPES.items()}
    types = ", ".join(letters[kind] for kind in statement.types)
    text = f"OPEN CHANNEL FOR {statement.direction.value} AS FILE #{statement.file}, TYPE = ({types})"
    return text if statement.depth is None else f"{text}, DEPTH = {print_expression(statement.depth)}"


def _open_port(statement: OpenPort) -> str:
    text = f"OPEN {_literal(StringLiteral(statement.port))} AS FILE #{statement.file}"
    if statement.setup is None:
        return f"{text}, ACCESS = {statement.access}"
    text += f", SETUP = {print_expression(statement.setup)}"
    return text if statement.baud is None else f"{text}, {print_expression(statement.baud)}"


def _close(statement: Close) -> str:
    return f"CLOSE #{statement.file}"


def _branch(key: str, line: int | None) -> str:
    return "" if line is None else f":{key}={line}"


def _input(statement: InputFile) -> str:
    return f"INPUT{_branch('EMPTY', statement.empty)} #{statement.file}, {_list(statement.targets)}"


def _print_file(statement: PrintFile) -> str:
    head = f"PRINT{_branch('FULL', statement.full)} #{statement.file}"
    return f"{head}, {' '.join(_printed(statement))}" if statement.items else head


def _get(statement: Get) -> str:
    return f"GET{_branch('EMPTY', statement.empty)} #{statement.file}, {print_expression(statement.target)}"


def _put(statement: Put) -> str:
    return f"PUT #{statement.file}, {print_expression(statement.item)}"


_WAITING: dict[type[object], Callable[[Any], str]] = {
    WaitOn: _wait,
    Delay: _delay,
    StartEvery: _start_every,
    OpenChannel: _open_channel,
    OpenPort: _open_port,
    Close: _close,
    InputFile: _input,
    PrintFile: _print_file,
    Get: _get,
    Put: _put,
}


def print_module(module: Module) -> str:
    """Return the text of a task.

    A tree in which no statement has a number is numbered first. Raises ValueError for a tree that has no text, such as
    one with a statement without a number after a remark.
    """
    if not _numbers(module.statements):
        module = numbered(module)
    writer = _Writer()
    writer.statements(module.statements)
    return writer.text()


def numbered(module: Module) -> Module:
    """Return the tree with every statement on a separate line, numbered in tens (closer in long tasks).

    ELSE, END_IF and NEXT get numbers as well, as labels. Raises ValueError above 32767 statements.
    """
    count = _Numbering(_STEP).statements(module.statements, count_only=True)[1]
    step = min(_STEP, _LAST_NUMBER // max(count, 1))
    if step == 0:
        raise ValueError(f"{count} lines are more than there are line numbers")
    return Module(_Numbering(step).statements(module.statements)[0])


def _numbers(statements: tuple[Statement, ...]) -> list[int]:
    found = []
    for statement in statements:
        if statement.number is not None:
            found.append(statement.number)
        if isinstance(statement, If):
            found += _numbers(statement.then) + _numbers(statement.otherwise)
        elif isinstance(statement, For):
            found += _numbers(statement.body)
    return found


class _Numbering:
    """Assigns line numbers in order."""

    def __init__(self, step: int) -> None:
        self._step = step
        self._count = 0

    def statements(
        self, statements: tuple[Statement, ...], count_only: bool = False
    ) -> tuple[tuple[Statement, ...], int]:
        """Return the statements with numbers, and the count of numbers assigned."""
        result: list[Statement] = []
        for statement in statements:
            if isinstance(statement, Label):
                continue
            result.extend(self._statement(statement))
        return (() if count_only else tuple(result)), self._count

    def _statement(self, statement: Statement) -> list[Statement]:
        first = dataclasses.replace(statement, number=self._next())
        if isinstance(first, For):
            body = self.statements(first.body)[0]
            return [dataclasses.replace(first, body=(*body, Label(number=self._next())))]
        if isinstance(first, If) and not first.one_line:
            then = self.statements(first.then)[0]
            otherwise = first.otherwise
            if otherwise:
                then = (*then, Label(number=self._next()))
                otherwise = self.statements(otherwise)[0]
            return [dataclasses.replace(first, then=then, otherwise=otherwise), Label(number=self._next())]
        return [first]

    def _next(self) -> int:
        self._count += 1
        return self._count * self._step


class _Writer:
    """Collects lines, with several statements on one where that is allowed."""

    def __init__(self) -> None:
        self._lines: list[str] = []
        self._last: Statement | None = None
        self._indent = 0

    def text(self) -> str:
        return "".join(f"{line}\n" for line in self._lines)

    def statements(self, statements: tuple[Statement, ...]) -> None:
        """Write statements; the label after a block IF is the number of its END_IF."""
        index = 0
        while index < len(statements):
            statement = statements[index]
            index += 1
            if isinstance(statement, If) and not statement.one_line:
                label = statements[index] if index < len(statements) else None
                ends = isinstance(label, Label)
                self._block_if(statement, label.number if label is not None and ends else None)
                index += ends
            elif isinstance(statement, For):
                self._for(statement)
            elif isinstance(statement, If):
                self._emit(statement.number, self._one_line(statement), statement)
            elif isinstance(statement, Call):
                self._call(statement)
            else:
                self._emit(statement.number, print_simple(statement), statement)

    def _emit(self, number: int | None, text: str, statement: Statement | None) -> None:
        if number is not None:
            self._lines.append(f"{number} {'  ' * self._indent}{text}".rstrip(" "))
        else:
            self._check_same_line(statement)
            self._lines[-1] += f" \\ {text}"
        self._last = statement

    def _check_same_line(self, statement: Statement | None) -> None:
        if not self._lines:
            raise ValueError("the first statement has no line number")
        if isinstance(self._last, (Remark, Label)):
            raise ValueError("a statement after a remark or a bare number needs a line number")
        if isinstance(self._last, If) and self._last.one_line and not isinstance(statement, Remark):
            raise ValueError("a statement after a one-line IF needs a line number")

    def _call(self, statement: Call) -> None:
        text = print_simple(statement)
        if len(text) <= LINE_WIDTH or len(statement.arguments) < 2:
            self._emit(statement.number, text, statement)
            return
        arguments = [print_argument(argument) for argument in statement.arguments]
        self._emit(statement.number, f"CALL {statement.block}({arguments[0]}, &", statement)
        margin = " " * self._lines[-1].rindex(arguments[0])
        self._lines.extend(f"{margin}{argument}, &" for argument in arguments[1:-1])
        self._lines.append(f"{margin}{arguments[-1]})")

    def _for(self, statement: For) -> None:
        step = "" if statement.step is None else f" STEP {print_expression(statement.step)}"
        first, last = print_expression(statement.start), print_expression(statement.stop)
        name = statement.variable.name
        self._emit(statement.number, f"FOR {name} = {first} TO {last}{step}", None)
        number, body = _split_label(statement.body)
        self._inner(body)
        self._emit(number, f"NEXT {name}", None)

    def _block_if(self, statement: If, end: int | None) -> None:
        self._emit(statement.number, f"IF {print_expression(statement.condition)} THEN", None)
        number, then = _split_label(statement.then)
        self._inner(then)
        if number is not None or statement.otherwise:
            self._emit(number, "ELSE", None)
            self._inner(statement.otherwise)
        self._emit(end, "END_IF", None)

    def _inner(self, statements: tuple[Statement, ...]) -> None:
        self._indent += 1
        self.statements(statements)
        self._indent -= 1

    def _one_line(self, statement: If) -> str:
        if not statement.then:
            raise ValueError("a one-line IF needs a statement after THEN")
        text = f"IF {print_expression(statement.condition)} THEN {self._branch(statement.then)}"
        if not statement.otherwise:
            return text
        if _takes_else(statement.then[-1]):
            raise ValueError("ELSE would belong to the inner IF of a one-line IF")
        return f"{text} ELSE {self._branch(statement.otherwise)}"

    def _branch(self, statements: tuple[Statement, ...]) -> str:
        parts = []
        for index, statement in enumerate(statements):
            if isinstance(statement, (Remark, Label, For)) or (isinstance(statement, If) and not statement.one_line):
                raise ValueError(f"a one-line IF cannot hold a {type(statement).__name__}")
            if isinstance(statement, If):
                if index < len(statements) - 1:
                    raise ValueError("an IF inside a one-line IF must be its last statement")
                parts.append(self._one_line(statement))
            elif index == 0 and isinstance(statement, Goto):
                parts.append(str(statement.line))
            else:
                parts.append(print_simple(statement))
        return " \\ ".join(parts)


def _takes_else(statement: Statement) -> bool:
    """Return whether a following ELSE would belong to this statement."""
    while isinstance(statement, If):
        if not statement.otherwise:
            return True
        statement = statement.otherwise[-1]
    return False


def _split_label(statements: tuple[Statement, ...]) -> tuple[int | None, tuple[Statement, ...]]:
    """Return the number of the label at the end, and the rest; the label after a block IF is that of its END_IF."""
    if not statements or not isinstance(statements[-1], Label):
        return None, statements
    before = statements[-2] if len(statements) > 1 else None
    if isinstance(before, If) and not before.one_line:
        return None, statements
    return statements[-1].number, statements[:-1]
