"""Identifies the installation of the package: machines that share work need the same one, and equal results."""

from __future__ import annotations

import hashlib
import math
import platform
import struct
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import lru_cache, partial
from pathlib import Path

import numpy as np

import automax_ros

_ARGUMENTS = tuple(number * scale / 7 for scale in (0.01, 1.0, 100.0) for number in range(-60, 61))
"""The arguments of the functions: small and large, of both signs, most without a finite binary form."""
_MATH: tuple[Callable[[float], float], ...] = (
    *(math.sin, math.cos, math.tan, math.asin, math.acos, math.atan, math.sinh, math.cosh, math.tanh),
    *(math.exp, math.expm1, math.log, math.log1p, math.log2, math.log10, math.sqrt),
)
_PAIRS: tuple[Callable[[float, float], float], ...] = (math.pow, math.atan2, math.fmod, math.hypot)
_NUMPY = (np.sin, np.cos, np.tan, np.arctan, np.exp, np.log, np.sqrt, np.cumsum, np.add.reduce)


@dataclass(frozen=True)
class Installation:
    """The version of the package, a SHA-256 of all its sources, the interpreter and NumPy, and their results.

    ``results`` is a SHA-256 of values of functions of the C library and of NumPy, bit for bit: they differ in their
    last bits from one C library or processor to the next (decision: a machine with others is refused, be it that the
    work at hand asks for none). The defaults are those of an older version of the package.
    """

    version: str
    sources: str
    python: str = ""
    numpy: str = ""
    results: str = ""

    def __str__(self) -> str:
        return f"{self.version} (sources {self.sources[:12]})"


@lru_cache(maxsize=1)
def installation() -> Installation:
    """Return the installation of this machine."""
    folder = Path(automax_ros.__file__).parent
    found = hashlib.sha256()
    for path in sorted(folder.rglob("*.py")):
        content = path.read_bytes()
        found.update(f"{path.relative_to(folder).as_posix()} {len(content)}\n".encode())
        found.update(content)
    python = f"{platform.python_implementation()} {platform.python_version()}"
    return Installation(automax_ros.__version__, found.hexdigest(), python, np.__version__, results_digest())


def results_digest() -> str:
    """Return a SHA-256 of the results of functions for a fixed set of arguments."""
    found = hashlib.sha256(b"".join(struct.pack("<d", value) for value in _results()))
    arguments = np.array(_ARGUMENTS)
    with np.errstate(all="ignore"):
        for function in _NUMPY:
            values = np.asarray(function(arguments), "<f8")
            found.update(np.where(np.isnan(values), 0.0, values).tobytes())  # a NaN has many forms
    return found.hexdigest()


def _results() -> Iterator[float]:
    for argument in _ARGUMENTS:
        for function in _MATH:
            yield _value(partial(function, argument))
        for pair in _PAIRS:
            yield _value(partial(pair, abs(argument), argument / 3))


def _value(get: Callable[[], float]) -> float:
    try:
        return get()
    except (ValueError, OverflowError):
        return 0.0
