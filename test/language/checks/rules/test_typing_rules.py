"""Types of expressions (J-3675 chapter 5, semantics BASIC)."""

import itertools

import pytest

from automax_ros.core.types import DataType
from automax_ros.language.checks.rules.typing_rules import LOGICAL, RELATIONAL, binary_type, type_of, unary_type
from automax_ros.language.tree.tree import Binary, IntegerLiteral, Reference, Unary

N, D, R, B, S = DataType.INTEGER, DataType.DOUBLE, DataType.REAL, DataType.BOOLEAN, DataType.STRING
ARITHMETIC = frozenset({"+", "-", "*", "/", "**"})


@pytest.mark.parametrize("operator", sorted(ARITHMETIC))
@pytest.mark.parametrize(
    ("left", "right", "result"),
    [(N, N, D), (N, D, D), (D, D, D), (N, R, R), (R, D, R), (R, R, R), (B, N, D), (B, B, D), (B, R, R), (R, B, R)],
)
def test_arithmetic(operator: str, left: DataType, right: DataType, result: DataType) -> None:
    assert binary_type(operator, left, right) is result


def test_strings_are_only_joined() -> None:
    assert binary_type("+", S, S) is S
    assert all(binary_type(operator, S, S) is None for operator in (ARITHMETIC | LOGICAL) - {"+"})
    assert all(binary_type("+", S, kind) is None for kind in (N, D, R, B))


@pytest.mark.parametrize("operator", sorted(RELATIONAL))
def test_relations_join_alike(operator: str) -> None:
    numbers = (N, D, R)
    for left, right in itertools.product(DataType, DataType):
        alike = left is right and operator in ("=", "<>")
        allowed = alike or (left in numbers and right in numbers)
        assert binary_type(operator, left, right) is (B if allowed else None)


@pytest.mark.parametrize("operator", sorted(LOGICAL))
@pytest.mark.parametrize(
    ("left", "right", "result"),
    [(B, B, B), (N, N, D), (B, N, D), (D, B, D), (R, N, None), (B, R, None), (S, B, None), (R, R, None)],
)
def test_logic(operator: str, left: DataType, right: DataType, result: DataType | None) -> None:
    assert binary_type(operator, left, right) is result


def test_unary() -> None:
    assert [unary_type("-", kind) for kind in (N, D, R, B, S)] == [D, D, R, None, None]
    assert [unary_type("+", kind) for kind in (N, D, R, B, S)] == [D, D, R, None, None]
    assert [unary_type("NOT", kind) for kind in (N, D, R, B, S)] == [D, D, None, B, None]


def test_a_constant_is_an_integer_up_to_32767() -> None:
    assert type_of(IntegerLiteral(32767)) is N
    assert type_of(IntegerLiteral(32768)) is D
    assert type_of(IntegerLiteral(-1, True)) is D


def test_long_chain_does_not_recurse() -> None:
    chain: Binary | Reference = Reference("A%")
    for _ in range(20_000):
        chain = Binary("+", chain, Reference("R"))
    assert type_of(chain) is R


def test_ill_typed_expression_has_no_type() -> None:
    with pytest.raises(ValueError, match="cannot take"):
        type_of(Unary("-", Reference("X@")))
