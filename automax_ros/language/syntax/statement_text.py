"""Expressions and simple statements as text, with no more parentheses than precedence needs."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from automax_ros.language.syntax.constants import REAL_DIGITS
from automax_ros.language.syntax.expressions import LEVELS, NOT_LEVEL
from automax_ros.language.syntax.functions import FUNCTIONS
from automax_ros.language.syntax.tree import (
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
    FunctionCall,
    Gosub,
    Goto,
    IntegerLiteral,
    IoWrite,
    Label,
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
from automax_ros.language.syntax.waiting_tree import (
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

_SIGN_LEVEL = max(LEVELS.values()) + 1
_PRIMARY_LEVEL = _SIGN_LEVEL + 1


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

    Raises ValueError for a string or a remark that the language cannot write down.
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
