"""The quick form of coefficients: the same numbers as the blocks' own formulas, of the same types, bit for bit."""

from __future__ import annotations

from random import Random

import pytest

from automax_ros.blocks.catalogue import CATALOGUE
from automax_ros.blocks.declare.declaration import Block
from automax_ros.compile.blocks.coefficients import QUICK_AFTER, CoefficientFunction, kept_names, quick_form
from automax_ros.core.numbers import stored_real
from automax_ros.core.types import DataType

BLOCKS = [block for block in CATALOGUE.values() if block.coefficients is not None and block.step is not None]
PERIODS_S = (0.0005, 0.0055, 0.11, 61.0)


def function_of(block: Block, period_s: float) -> CoefficientFunction:
    """Return the function of a block whose REAL parameters are all variables."""
    assert block.coefficients is not None
    reals = {item.name for item in block.inputs if item.type is DataType.REAL}
    changing = tuple(name for name in block.coefficients.parameters if name in reals)
    literals = {
        name: {"ORDER": 2.0, "ISA": 1.0}.get(name, 0.0) for name in block.coefficients.parameters if name not in reals
    }
    return CoefficientFunction(block, period_s, literals, changing, quick_form)


def outcome(function: object, values: list[float]) -> str:
    """Return what a call gives, or which error it raises."""
    try:
        return repr(function(*values))  # type: ignore[operator]
    except (ArithmeticError, ValueError, KeyError) as error:
        return type(error).__name__


@pytest.mark.parametrize("block", BLOCKS, ids=lambda block: block.name)
def test_the_quick_form_gives_the_same_bits(block: Block) -> None:
    assert block.coefficients is not None
    random = Random(block.name)
    for period_s in PERIODS_S:
        function = function_of(block, period_s)
        quick = quick_form(function)
        assert quick is not None
        kept = [0.0] * len(kept_names(block.coefficients))
        for _ in range(100):
            values = [
                stored_real(random.choice((-1, 1, 1, 1)) * 10 ** random.uniform(-4, 5))[0] for _ in function.evaluated
            ]
            assert outcome(quick, [*values, *kept]) == outcome(function.evaluate, [*values, *kept])
            kept = [abs(value) for value in values[: len(kept)]] if random.random() < 0.5 else kept


def test_it_is_made_once_a_function_is_called_often() -> None:
    made: list[CoefficientFunction] = []

    def quickened(function: CoefficientFunction) -> None:
        made.append(function)

    function = function_of(CATALOGUE["PID"], 0.0055)
    function.quickened = quickened
    values = [1.0] * len(function.evaluated)
    results = {function(*values) for _ in range(QUICK_AFTER - 1)}
    assert not made
    results |= {function(*values) for _ in range(3 * QUICK_AFTER)}
    assert made == [function]
    assert len(results) == 1
