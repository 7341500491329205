"""A dynamic block driven by a signal: its real step, scan by scan, with its coefficients computed once."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from contextlib import closing
from itertools import repeat

from automax_ros.blocks.declare.declaration import Block, Form
from automax_ros.blocks.declare.dynamics import Integrator
from automax_ros.blocks.declare.instance import Instance
from automax_ros.core.numbers import INT16_MAX, INT16_MIN
from automax_ros.core.types import DataType, Value

_ANY_CHANGE = INT16_MAX - INT16_MIN
STANDING = "MAX_CHANGE 0"
"""The limit that is reported for a block that may not move at all."""
MOST_SCANS_TO_REST = 1 << 16
"""Most scans in which a block comes to rest: MAX_CHANGE = 1 takes as many as there are counts."""


class DrivenBlock:
    """A block that one signal of whole counts drives, from rest: the state to which it settles with the signal at 0.

    The block's declaration names the input that carries the signal; the others that could are 0. ``integrator`` is the
    one inside the block, None if it has none.
    """

    def __init__(self, block: Block, period_ns: int, parameters: Mapping[str, Value]) -> None:
        """Create from the scan period and the values of inputs but the signal, by keyword; others have their defaults.

        ``block`` must have measurable dynamics.
        """
        assert block.coefficients is not None
        dynamics = block.coefficients.dynamics
        inputs: dict[str, Value] = {
            item.name: item.type.zero if item.default is None else item.default
            for item in block.inputs
            if isinstance(item.type, DataType)
        }
        inputs.update(parameters)
        carrier, self._sign = dynamics.carrier(inputs)
        self._carrier = carrier.lower()
        fixed, self._standing = _divide(block, carrier, parameters)
        self._instance = Instance(block, period_ns, **fixed)
        self._output = self._instance.results.index(dynamics.output.lower())
        self._rest = self._come_to_rest()
        self._start = dict(self._instance.state)
        inner = self.integrator = dynamics.integrator
        self._bounds = _Bounds(inner, inputs, self._instance.coefficients)
        self._inner = None if inner is None else self._instance.results.index(inner.state)
        self.begin()

    def begin(self) -> None:
        """Put the block to rest and forget the limits that it reached."""
        self._instance.state = dict(self._start)
        self._last = self._rest
        self._touched: set[str] = set()

    def _come_to_rest(self) -> int:
        """Set the states, and return the output, to which the block settles with a signal of 0."""
        block, output = self._instance.block, 0
        states = slice(len(block.outputs), len(block.outputs) + len(block.states))
        before = tuple(state.initial for state in block.states)
        with closing(self._instance.drive(self._carrier, repeat(0, MOST_SCANS_TO_REST), **self._standing)) as results:
            for result in results:
                output = result[self._output]
                if result[states] == before:
                    break
                before = result[states]
        return output

    @property
    def room(self) -> int:
        """Counts by which OUTPUT may move to either side of rest."""
        return max(0, min(self._bounds.high - self._rest, self._rest - self._bounds.low))

    @property
    def rest(self) -> int:
        """The output while the signal is 0: the sum of the inputs added to it, within the limits."""
        return self._rest

    @property
    def most_change(self) -> int:
        """Counts by which OUTPUT may move in a scan."""
        return self._bounds.most_change

    @property
    def inner_room(self) -> float | None:
        """Counts by which the integrator may move to either side of 0; None for a block without a limited one."""
        inner = self._bounds.inner
        return None if inner is None else max(0.0, min(inner[1], -inner[0]))

    @property
    def touched(self) -> tuple[str, ...]:
        """Limits that the block reached since ``forget``: limits, the range of section 51, MAX_CHANGE, 16 bits."""
        return tuple(sorted(self._touched))

    def forget(self) -> None:
        """Forget the limits that it reached, without a reset."""
        self._touched.clear()

    def run(self, signal: Iterable[int]) -> list[int]:
        """Run one scan for each value of the signal and return OUTPUT after each."""
        output, inner = self._output, self._inner
        found: list[int] = []
        least = most = 0.0
        driving = signal if self._sign == 1 else (-counts for counts in signal)
        for result in self._instance.drive(self._carrier, driving, **self._standing):
            found.append(result[output])
            if inner is not None:
                held = result[inner]
                if held > most:
                    most = held
                elif held < least:
                    least = held
        self._notice(found, least, most)
        return found

    def _notice(self, found: list[int], least: float, most: float) -> None:
        if not found:
            return
        bounds = self._bounds
        if max(found) >= bounds.high:
            self._touched.add(bounds.high_name)
        if min(found) <= bounds.low:
            self._touched.add(bounds.low_name)
        if bounds.inner is not None and least <= bounds.inner[0]:
            self._touched.add(bounds.inner_names[0])
        if bounds.inner is not None and most >= bounds.inner[1]:
            self._touched.add(bounds.inner_names[1])
        if bounds.most_change <= INT16_MAX:
            before = [self._last, *found]
            if any(abs(after - then) >= bounds.most_change for then, after in zip(before, found, strict=False)):
                self._touched.add(f"MAX_CHANGE {bounds.most_change}")
        self._last = found[-1]


class _Bounds:
    """The limits of a block: of its output, and of its integrator if that is limited."""

    def __init__(
        self, integrator: Integrator | None, inputs: Mapping[str, Value], coefficients: Mapping[str, float]
    ) -> None:
        self.high = int(inputs.get("LIMIT_PLUS", INT16_MAX))
        self.low = int(inputs.get("LIMIT_MINUS", INT16_MIN))
        self.high_name = f"LIMIT_PLUS {self.high}" if self.high < INT16_MAX else "16 bits"
        self.low_name = f"LIMIT_MINUS {self.low}" if self.low > -INT16_MAX else "16 bits"
        self.inner: tuple[float, float] | None = None
        self.inner_names = ("", "")
        self.most_change = max(0, int(inputs.get("MAX_CHANGE", _ANY_CHANGE)))
        if integrator is not None:
            span = coefficients["span"] if integrator.rate is not None else math.inf
            self.inner = (max(-span, float(self.low)), min(span, float(self.high)))
            name = f"the integrator's range +-{span:.0f} (section 51)"
            short = span < INT16_MAX
            self.inner_names = (
                name if short and self.low < -span else self.low_name,
                name if short and self.high > span else self.high_name,
            )


def _divide(block: Block, carrier: str, parameters: Mapping[str, Value]) -> tuple[dict[str, Value], dict[str, Value]]:
    """Return the literals of a block and its other inputs, in lower case; signals other than the driving one are 0."""
    fixed: dict[str, Value] = {}
    standing: dict[str, Value] = {}
    for item in block.inputs:
        if item.name == carrier or not isinstance(item.type, DataType):
            continue
        if item.name in parameters:
            (fixed if item.form is Form.LITERAL else standing)[item.variable] = parameters[item.name]
        elif item.required:
            standing[item.variable] = item.type.zero
    return fixed, standing
