"""Syntax tree to text, in one canonical form that parses back to an equal tree.

Statements keep their numbers; one without a number stands on the line of the one before it. Blocks are indented, a CALL
that is too long for its line is broken at its parameters.
"""

from __future__ import annotations

import dataclasses

from automax_ros.language.syntax.statement_text import print_argument, print_expression, print_simple
from automax_ros.language.syntax.tree import Call, For, Goto, If, Label, Module, Remark, Statement

__all__ = ["numbered", "print_expression", "print_module"]

LINE_WIDTH = 100
_LAST_NUMBER = 32767
_STEP = 10


def print_module(module: Module) -> str:
    """Return the text of a task.

    A tree in which no statement has a number is numbered first. Raises ValueError for a tree that no text gives, such
    as a statement without a number after a remark.
    """
    if not _numbers(module.statements):
        module = numbered(module)
    writer = _Writer()
    writer.statements(module.statements)
    return writer.text()


def numbered(module: Module) -> Module:
    """Return the tree with a line of its own for every statement, numbered in tens (closer in long tasks).

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
    """Hands out line numbers in order."""

    def __init__(self, step: int) -> None:
        self._step = step
        self._count = 0

    def statements(
        self, statements: tuple[Statement, ...], count_only: bool = False
    ) -> tuple[tuple[Statement, ...], int]:
        """Return the statements with numbers, and how many numbers were given out."""
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
    """Collects lines; knows what may follow on the same one."""

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
