"""Short builders of Python syntax trees, for the compiler, and the functions that such trees become."""

from __future__ import annotations

import ast
import gc
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager

from automax_ros.core.types import Value

LOAD, STORE = ast.Load(), ast.Store()
"""One of each for all trees: they have no content, and a separate node takes as much memory as any other."""


def nodes(*trees: ast.AST) -> Iterator[ast.AST]:
    """Yield every expression and statement of trees, in no particular order; several times faster than ``ast.walk``."""
    waiting = list(trees)
    while waiting:
        node = waiting.pop()
        yield node
        for part in vars(node).values():
            if isinstance(part, list):
                waiting.extend(part)
            elif isinstance(part, (ast.expr, ast.stmt)):
                waiting.append(part)


def placed(definitions: Iterable[ast.stmt]) -> ast.Module:
    """Return a module of functions whose nodes have the positions that Python requires: generated code has no lines."""
    module = ast.Module([*definitions], [])
    for node in nodes(*module.body):
        if isinstance(node, (ast.expr, ast.stmt)):
            node.lineno, node.col_offset = 1, 0
    return module


def name(identifier: str) -> ast.Name:
    """Return a reference to a variable."""
    return ast.Name(identifier, LOAD)


def constant(value: Value) -> ast.expr:
    """Return a literal; negative numbers as Python parses them."""
    if isinstance(value, (int, float)) and not isinstance(value, bool) and value < 0:
        return ast.UnaryOp(ast.USub(), ast.Constant(-value))
    return ast.Constant(value)


def assign(target: str, value: ast.expr) -> ast.Assign:
    """Return ``target = value``."""
    return ast.Assign([ast.Name(target, STORE)], value)


def assign_all(targets: Sequence[str], value: ast.expr) -> ast.Assign:
    """Return ``a, b, c = value``."""
    names: list[ast.expr] = [ast.Name(target, STORE) for target in targets]
    return ast.Assign([ast.Tuple(names, STORE)], value)


def add_to(target: str, value: ast.expr) -> ast.AugAssign:
    """Return ``target += value``."""
    return ast.AugAssign(ast.Name(target, STORE), ast.Add(), value)


def names(identifiers: Sequence[str]) -> ast.Tuple:
    """Return a tuple of variables."""
    return ast.Tuple([name(identifier) for identifier in identifiers], LOAD)


def call(function: str | ast.expr, *arguments: ast.expr) -> ast.Call:
    """Return ``function(arguments)``."""
    return ast.Call(name(function) if isinstance(function, str) else function, list(arguments), [])


def attribute(base: str, member: str) -> ast.Attribute:
    """Return ``base.member``."""
    return ast.Attribute(name(base), member, LOAD)


def do(value: ast.expr) -> ast.Expr:
    """Return an expression as a statement."""
    return ast.Expr(value)


def when(test: ast.expr, body: list[ast.stmt], otherwise: list[ast.stmt] | None = None) -> ast.If:
    """Return ``if test: body else: otherwise``; empty branches become ``pass``."""
    return ast.If(test, body or [ast.Pass()], otherwise or [])


def loop(test: ast.expr, body: list[ast.stmt]) -> ast.While:
    """Return ``while test: body``."""
    return ast.While(test, body or [ast.Pass()], [])


def finally_do(body: list[ast.stmt], last: list[ast.stmt]) -> ast.Try:
    """Return ``try: body finally: last``."""
    return ast.Try(body=body or [ast.Pass()], handlers=[], orelse=[], finalbody=last or [ast.Pass()])


_COMPARE: dict[str, type[ast.cmpop]] = {
    "=": ast.Eq,
    "<>": ast.NotEq,
    "<": ast.Lt,
    ">": ast.Gt,
    "<=": ast.LtE,
    ">=": ast.GtE,
}
_ARITHMETIC: dict[str, type[ast.operator]] = {
    "+": ast.Add,
    "-": ast.Sub,
    "*": ast.Mult,
    "/": ast.Div,
    "//": ast.FloorDiv,
    "AND": ast.BitAnd,
    "OR": ast.BitOr,
    "XOR": ast.BitXor,
}


def compare(left: ast.expr, operator: str, right: ast.expr) -> ast.Compare:
    """Return a comparison; ``operator`` as in BASIC."""
    return ast.Compare(left, [_COMPARE[operator]()], [right])


def binary(left: ast.expr, operator: str, right: ast.expr) -> ast.BinOp:
    """Return an arithmetic or bitwise operation; ``operator`` as in BASIC, ``//`` for floor division."""
    return ast.BinOp(left, _ARITHMETIC[operator](), right)


def negative(operand: ast.expr) -> ast.UnaryOp:
    """Return ``-operand``."""
    return ast.UnaryOp(ast.USub(), operand)


def inverse(operand: ast.expr) -> ast.UnaryOp:
    """Return ``not operand``."""
    return ast.UnaryOp(ast.Not(), operand)


def both(*operands: ast.expr) -> ast.BoolOp:
    """Return ``a and b and ...``."""
    return ast.BoolOp(ast.And(), list(operands))


def either(*operands: ast.expr) -> ast.BoolOp:
    """Return ``a or b or ...``."""
    return ast.BoolOp(ast.Or(), list(operands))


def choose(test: ast.expr, value: ast.expr, otherwise: ast.expr) -> ast.IfExp:
    """Return ``value if test else otherwise``."""
    return ast.IfExp(test, value, otherwise)


def item(base: str, index: ast.expr) -> ast.Subscript:
    """Return ``base[index]`` as a value."""
    return ast.Subscript(name(base), index, LOAD)


def set_item(base: str, index: ast.expr, value: ast.expr) -> ast.Assign:
    """Return ``base[index] = value``."""
    return ast.Assign([ast.Subscript(name(base), index, STORE)], value)


def function(identifier: str, parameters: Sequence[str], body: list[ast.stmt]) -> ast.FunctionDef:
    """Return a function definition."""
    arguments = ast.arguments(
        posonlyargs=[],
        args=[ast.arg(parameter, lineno=1, col_offset=0) for parameter in parameters],
        kwonlyargs=[],
        kw_defaults=[],
        defaults=[],
    )
    made = ast.parse("def f(): pass").body[0]
    assert isinstance(made, ast.FunctionDef)
    made.name, made.args, made.body = identifier, arguments, body or [ast.Pass()]
    return made


def is_simple(expression: ast.expr) -> bool:
    """Return whether an expression may be written twice without cost: a variable or a literal."""
    if isinstance(expression, ast.UnaryOp) and isinstance(expression.op, ast.USub):
        return isinstance(expression.operand, ast.Constant)
    return isinstance(expression, (ast.Name, ast.Constant))


@contextmanager
def collections_paused() -> Iterator[None]:
    """Suspend garbage collection: a long task's tree is all alive, and scanning it takes most of the time."""
    enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if enabled:
            gc.enable()


def made(definitions: list[ast.FunctionDef], name: str, known: dict[str, object]) -> dict[str, object]:
    """Return the compiled functions of a task of this name; their only globals are ``known``."""
    with collections_paused():
        code = compile(placed(definitions), f"<{name}>", "exec")
    found: dict[str, object] = {"__builtins__": {}, **known}
    exec(code, found)
    return found
