"""Each operation of C against Python's own: edges with edges, and random values."""

from __future__ import annotations

import linecache
import math
import shutil
from types import SimpleNamespace

import pytest
from soaking import in_soak

from automax_ros.compile.base import functions
from automax_ros.compile.base.native_source import NotNative
from automax_ros.compile.blocks.coefficients import raised
from automax_ros.compile.native.run.cache import NativeCache
from automax_ros.compile.native.translate.frame import Unit
from automax_ros.core import numbers
from automax_ros.core.numbers import stored_real
from compile.native.operations import (
    ANY,
    BIG,
    EXACT,
    FLAG,
    LONG,
    WORD,
    Built,
    Operation,
    first_difference,
    real,
    rows,
    translated,
    whole,
)

pytestmark = pytest.mark.skipif(shutil.which("gcc") is None, reason="native code needs a C compiler")


FORMULAS = {
    "sum_of": ("a, b", "a + b"),
    "difference_of": ("a, b", "a - b"),
    "product": ("a, b", "a * b"),
    "quotient": ("a, b", "a / b"),
    "quotient_below": ("a, b", "a // b"),
    "rest_of": ("a, b", "a % b"),
    "negative": ("a", "-a"),
    "inverted": ("a", "~a"),
    "both_bits": ("a, b", "a & b"),
    "any_bits": ("a, b", "a | b"),
    "other_bits": ("a, b", "a ^ b"),
    "shifted_left": ("a, b", "a << b"),
    "shifted_right": ("a, b", "a >> b"),
    "less": ("a, b", "a < b"),
    "at_most": ("a, b", "a <= b"),
    "equal": ("a, b", "a == b"),
    "unequal": ("a, b", "a != b"),
    "between": ("a, b, c", "a < b <= c"),
    "least": ("a, b", "min(a, b)"),
    "most": ("a, b", "max(a, b)"),
    "magnitude": ("a", "abs(a)"),
    "without_fraction": ("a", "int(a)"),
    "rounded_down": ("a", "math.floor(a)"),
    "as_float": ("a", "float(a)"),
    "truth": ("a", "bool(a)"),
    "chosen": ("a, b, c", "a if c else b"),
    "is_nan": ("a", "math.isnan(a)"),
    "is_finite": ("a", "math.isfinite(a)"),
    "squared": ("a", "raised(a, 2.0)"),
    "cubed": ("a", "raised(a, 3.0)"),
}
"""Name, parameters and result of functions of one expression."""


def of_formulas() -> SimpleNamespace:
    """The functions, with a source from which they can be translated."""
    place, known = "<formulas>", {"math": math, "raised": raised}
    text = "".join(f"def {name}({given}):\n    return {result}\n" for name, (given, result) in FORMULAS.items())
    linecache.cache[place] = (len(text), None, text.splitlines(keepends=True), place)
    exec(compile(text, place, "exec"), known)
    return SimpleNamespace(**{name: known[name] for name in FORMULAS})


of = of_formulas()


def clamped_sum(a, b):
    value = a + b
    return numbers.clamp16(value)


def held_within(a, b):
    value = a * 3 + b
    value = min(value, 32767)
    return max(value, -32768)


SMALL, BITS, COUNT = whole(-100, 100), whole(0, 2**31 - 1), whole(0, 15)
HALF = whole(-(2**62), 2**62)
FINITE, REAL_OF_RACK = real(-1e308, 1e308), real(-9.3e18, 9.3e18)
IN_53_BITS = real(-(2.0**52), 2.0**52)
TWO = [
    *(
        Operation(function, (kind, kind))
        for function in (of.sum_of, of.difference_of, of.product)
        for kind in (WORD, LONG, BIG, ANY, FLAG)
    ),
    *(
        Operation(function, pair)
        for function in (of.sum_of, of.product, of.quotient)
        for pair in ((LONG, ANY), (ANY, EXACT))
    ),
    *(Operation(of.quotient, pair) for pair in ((WORD, WORD), (LONG, LONG), (EXACT, EXACT), (ANY, ANY), (FLAG, WORD))),
    *(
        Operation(function, pair)
        for function in (of.quotient_below, of.rest_of)
        for pair in (
            (WORD, WORD),
            (LONG, LONG),
            (HALF, LONG),
            (HALF, HALF),
            (BITS, BITS),
            (LONG, whole(-7, -1)),
            (LONG, whole(1, 9)),
            (BITS, whole(1, 2**31)),
            (FLAG, FLAG),
        )
    ),
    *(
        Operation(function, pair)
        for function in (of.both_bits, of.any_bits, of.other_bits)
        for pair in ((WORD, WORD), (LONG, WORD), (BIG, BIG), (BITS, LONG), (FLAG, FLAG), (FLAG, LONG))
    ),
    *(Operation(of.shifted_left, pair) for pair in ((WORD, COUNT), (LONG, whole(0, 31)), (HALF, whole(0, 40)))),
    *(Operation(of.shifted_right, pair) for pair in ((WORD, COUNT), (LONG, whole(0, 31)), (BIG, whole(0, 62)))),
    *(
        Operation(function, pair)
        for function in (of.less, of.at_most, of.equal, of.unequal, of.least, of.most)
        for pair in ((LONG, LONG), (BIG, BIG), (ANY, ANY), (FLAG, FLAG))
    ),
    *(
        Operation(function, pair)
        for function in (of.less, of.at_most, of.equal, of.unequal)
        for pair in ((LONG, ANY), (ANY, EXACT), (EXACT, ANY), (FLAG, ANY), (BIG, IN_53_BITS), (IN_53_BITS, BIG))
    ),
    Operation(clamped_sum, (WORD, WORD)),
    Operation(clamped_sum, (BIG, BIG)),
    Operation(held_within, (LONG, LONG)),
    Operation(functions.integer_power, (LONG, LONG)),
    Operation(functions.integer_power, (SMALL, SMALL)),
    Operation(functions.real_power, (ANY, ANY)),
    Operation(functions.real_power, (REAL_OF_RACK, real(-40.0, 40.0))),
    Operation(functions.integer_quotient, (LONG, LONG)),
    Operation(functions.integer_quotient, (WORD, LONG)),
    Operation(functions.real_quotient, (ANY, ANY)),
    Operation(functions.bit_set, (LONG, SMALL)),
    Operation(functions.bit_clear, (LONG, SMALL)),
    Operation(functions.bit_test, (LONG, SMALL)),
    Operation(functions.shift_left, (LONG, SMALL)),
    Operation(functions.shift_right, (LONG, SMALL)),
    Operation(functions.rotate_left, (LONG, SMALL)),
    Operation(functions.rotate_right, (LONG, SMALL)),
]
ONE = [
    *(Operation(of.negative, (kind,)) for kind in (WORD, LONG, BIG, ANY, FLAG)),
    *(Operation(of.inverted, (kind,)) for kind in (WORD, LONG, HALF)),
    *(Operation(of.magnitude, (kind,)) for kind in (WORD, LONG, BIG, ANY, FLAG)),
    *(Operation(of.as_float, (kind,)) for kind in (FLAG, LONG, BIG, ANY)),
    *(Operation(of.truth, (kind,)) for kind in (FLAG, LONG, BIG, ANY)),
    *(
        Operation(function, (kind,))
        for function in (of.without_fraction, of.rounded_down)
        for kind in (LONG, real(-4e18, 4e18), real(-1e30, 1e30), real(-(2.0**125), 2.0**125))
    ),
    *(Operation(function, (ANY,)) for function in (of.is_nan, of.is_finite)),
    *(Operation(function, (ANY,)) for function in (stored_real, functions.store_real)),
    *(Operation(function, (REAL_OF_RACK,)) for function in (of.squared, of.cubed)),
    *(Operation(function, (ANY,)) for function in (of.squared, of.cubed)),
    *(
        Operation(function, (ANY,))
        for function in (
            functions.whole, functions.sign, functions.square_root, functions.sine, functions.cosine, functions.tangent,
            functions.arc_tangent, functions.natural_logarithm, functions.exponential,
        )
    ),
    Operation(functions.sign, (LONG,)),
    Operation(numbers.round_count, (real(-1e15, 1e15),)),
    Operation(numbers.clamp32, (BIG,)),
]  # fmt: skip
THREE = [
    Operation(of.between, (WORD, ANY, LONG)),
    Operation(of.between, (LONG, LONG, LONG)),
    Operation(of.chosen, (ANY, ANY, FLAG)),
    Operation(of.chosen, (LONG, WORD, FLAG)),
]


@pytest.fixture(scope="module")
def built(tmp_path_factory) -> Built:
    return Built([*ONE, *TWO, *THREE], NativeCache(tmp_path_factory.mktemp("cache") / "native"))


@pytest.mark.parametrize(("count", "seed"), [(200, 1), *(in_soak(10_000, seed, timeout_s=900) for seed in (2, 3))])
def test_operations_give_python_s_bits(built, count, seed) -> None:
    found = [first_difference(item, built, rows(item, count, seed)) for item in (*ONE, *TWO, *THREE)]
    assert list(filter(None, found)) == []


@pytest.mark.parametrize(
    "operation",
    [
        Operation(of.quotient, (BIG, BIG)),
        Operation(of.less, (BIG, ANY)),
        Operation(of.equal, (ANY, BIG)),
        Operation(of.least, (ANY, BIG)),
        Operation(of.shifted_left, (LONG, LONG)),
        Operation(of.shifted_right, (LONG, whole(-1, 3))),
    ],
    ids=lambda operation: operation.name,
)
def test_what_c_would_do_otherwise_is_not_native(operation) -> None:
    with pytest.raises(NotNative):
        translated(operation, Unit())


def test_a_wrong_operation_would_be_found(built) -> None:
    """What C gives for one operation is not what Python gives for its neighbour."""
    kinds = (real(-4e18, 4e18),)
    down, toward_zero = Operation(of.rounded_down, kinds), Operation(of.without_fraction, kinds)
    both = Built([down], NativeCache(built.folder))
    both.translated[toward_zero] = both.translated[down]
    assert first_difference(down, both, [(-0.5,), (0.5,)]) == ""
    assert first_difference(toward_zero, both, [(-0.5,), (0.5,)]).endswith("(-0.5,): C gives -1, Python gives 0")
