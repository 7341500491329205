"""Long and deep expressions compile: neither the checker's limits nor a tree's shape may blow the stack."""

from __future__ import annotations

import dataclasses

import pytest

from automax_ros.compile.compiler import compile_program
from automax_ros.language.tree.tree import (
    Assignment,
    Binary,
    FunctionCall,
    IntegerLiteral,
    RealLiteral,
    Reference,
    StringLiteral,
    Unary,
)
from automax_ros.runtime.memory.memory import CommonMemory
from automax_ros.runtime.tasks.task import Task
from compile.support import lines, program_of, ran


def deep_sum(operands: int) -> Binary:
    expression: object = Reference("R")
    for number in range(operands - 1):
        expression = Binary("+-"[number % 2], expression, Reference("Q"))
    return expression


@pytest.mark.parametrize("target", ["R", "D!", "S$", "X@"])
def test_chains_of_thousands_of_operands_compile(target):
    """The checker limits a tree's height; the compiler itself must not depend on that."""
    program = program_of(lines("R = Q"))
    chains = {
        "R": deep_sum(5000),
        "D!": deep_integers(5000),
        "S$": deep_strings(3000),
        "X@": Binary("=", deep_sum(2001), Reference("R")),
    }
    scan = (Assignment(Reference(target), chains[target], number=100),)
    compiled = compile_program(dataclasses.replace(program, scan=scan), {})
    task = Task(compiled, CommonMemory([]))
    task.state[compiled.layout.index("R")] = 2.0
    task.state[compiled.layout.index("Q")] = 0.5
    task.state[compiled.layout.index("A%")] = 3
    task.run()
    task.scan(0)
    assert task.value(target) == {"R": 2.5, "D!": 15000, "S$": "x" * 31, "X@": True}[target]


def deep_integers(operands: int) -> Binary:
    expression: object = Reference("A%")
    for _ in range(operands - 1):
        expression = Binary("+", expression, Reference("A%"))
    return expression


def deep_strings(operands: int):
    expression: object = StringLiteral("x")
    for _ in range(operands - 1):
        expression = Binary("+", expression, StringLiteral("x"))
    return expression


def test_64_nested_operations_each_with_a_long_chain_compile():
    """Signs, functions and parentheses do not hide how deep a tree is."""
    inner: object = Reference("R")
    for level in range(64):
        for _ in range(39):
            inner = Binary("+", inner, RealLiteral(0.0))
        inner = Unary("-", inner) if level % 2 else FunctionCall("ABS", (inner,))
    for _ in range(39):
        inner = Binary("+", inner, IntegerLiteral(0))
    program = program_of(lines("R = Q"))
    compiled = compile_program(dataclasses.replace(program, scan=(Assignment(Reference("R"), inner, number=100),)), {})
    task = Task(compiled, CommonMemory([]))
    task.state[compiled.layout.index("R")] = 3.0
    task.run()
    task.scan(0)
    assert task.value("R") == -3.0


def test_a_statement_of_8192_characters_compiles():
    terms = " + ".join(f"({' * '.join(['A%'] * 20)})" for _ in range(38))
    statement = f"D! = ({terms}) * (({terms}) / 38)"
    assert 7000 < len(statement) < 8192
    task = ran("A% = 1", statement)
    assert task.value("D!") == 38
