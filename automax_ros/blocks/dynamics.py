"""What a dynamic block is as a function of frequency (sections 36 and 41 to 51): a part of its declaration.

The step function executes it; this says what it stands for, so that tuning tools can show it, drive it and measure it
without knowing the block.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from automax_ros.blocks.transfer import Transfer
from automax_ros.core.types import Value

Parameters = Mapping[str, float]
"""The parameters of coefficients that are in force, by keyword."""
Inputs = Mapping[str, Value]
"""The values of inputs, by keyword."""


@dataclass(frozen=True)
class Integrator:
    """The integrator inside a block: the REAL ``state`` that holds it; ``what`` it is called in a sentence.

    ``rate`` in 1/s is Kx x C, and ``formula`` is Kx as text: by Kx section 51 limits its range, in counts, which the
    block has as its coefficient ``span``. Without a rate only LIMIT_PLUS and LIMIT_MINUS bound it. One that is
    ``in_feedback`` follows the signal and is taken from it, so that beyond its range the rest stays in the output.
    """

    state: str
    rate: Callable[[Parameters], float] | None = None
    formula: str = ""
    what: str = "the integrator"
    in_feedback: bool = False


def input_carries(_inputs: Inputs) -> tuple[str, int]:
    """Return INPUT, not inverted, as the input that carries the signal."""
    return "INPUT", 1


def no_remarks(_inputs: Inputs) -> list[str]:
    """Return nothing to be said about a measurement."""
    return []


def corners_at(*names: str) -> Callable[[Parameters], Sequence[tuple[str, float]]]:
    """Return what gives the corners of a function that bends at parameters which are frequencies."""
    return lambda values: [(name, values[name]) for name in names]


@dataclass(frozen=True)
class Dynamics:
    """A block as a function of frequency.

    ``transfer(period_s, values)`` is its transfer function at a scan period; ``laplace`` its Laplace function with the
    numbers put in, ``equation`` what it executes in the terms of its coefficients, and ``corners`` the names of the
    frequencies in rad/s at which it bends, each from the parameters in force. The corners of a band
    have no ``time_constants``. ``exact_at`` names the parameter at whose frequency the discrete function is the
    Laplace function itself, empty where the mapping is plain bilinear; ``steps`` says how a block without a mapping
    is made.

    ``signals`` are the inputs that carry a signal through it; ``carrier(inputs)`` is the one to drive, and 1 or -1 for
    its sign. It comes out at ``output``. ``stopped_by`` are inputs that, while TRUE, let nothing through, with
    what the output does then. ``remarks(inputs)`` is what a reader of a measurement must know. ``not_measured`` says
    why the block has no frequency response, empty where it has one.
    """

    transfer: Callable[[float, Parameters], Transfer]
    laplace: Callable[[Parameters], str]
    equation: Callable[[Parameters], str]
    corners: Callable[[Parameters], Sequence[tuple[str, float]]]
    time_constants: bool = True
    exact_at: str = "WM"
    steps: str = ""
    integrator: Integrator | None = None
    signals: tuple[str, ...] = ("INPUT",)
    carrier: Callable[[Inputs], tuple[str, int]] = input_carries
    output: str = "OUTPUT"
    stopped_by: tuple[tuple[str, str], ...] = (("RESET", "OUTPUT stays where it is"),)
    remarks: Callable[[Inputs], list[str]] = no_remarks
    not_measured: str = ""
