"""A dynamic block driven by a signal: its real step, scan after scan, with its coefficients computed once."""

from __future__ import annotations

import inspect
from collections.abc import Iterable, Mapping

from automax_ros.blocks.coefficients import evaluate
from automax_ros.blocks.declaration import Block
from automax_ros.core.numbers import INT16_MAX, INT16_MIN
from automax_ros.core.types import DataType, Value

_NS_PER_S = 1e9
_ANY_CHANGE = INT16_MAX - INT16_MIN
STANDING = "MAX_CHANGE 0"
"""What a block is told to have run into that may not move at all."""
MOST_SCANS_TO_REST = 1 << 16
"""Scans in which a block comes to rest: MAX_CHANGE = 1 takes as many as there are counts."""


class DrivenBlock:
    """A block that one signal of whole counts drives, from rest: where it comes to stand while the signal is 0.

    The signal is INPUT. Of a PID it is ERROR: INPUT carries it and FEEDBACK is 0; where the D term takes FEEDBACK
    (DERIVATIVE), FEEDBACK carries it and INPUT is 0, which is the same for all three terms.
    """

    def __init__(self, block: Block, period_ns: int, parameters: Mapping[str, Value]) -> None:
        """Take the scan period and the values of all inputs but the signal, by keyword; others have their defaults.

        ``block`` is one with a transfer function.
        """
        assert block.step is not None
        assert block.coefficients is not None
        values: dict[str, Value] = {
            item.variable: item.type.zero if item.default is None else item.default
            for item in block.inputs
            if isinstance(item.type, DataType)
        }
        values.update((name.lower(), value) for name, value in parameters.items())
        given = {
            name: float(parameters[name])
            for name in block.coefficients.parameters
            if isinstance(parameters.get(name), (int, float))
        }
        coefficients, _ = evaluate(block, period_ns / _NS_PER_S, given)
        values.update(zip(block.coefficients.names, coefficients, strict=True))
        values.update((state.name, state.initial) for state in block.states)
        self._step = block.step
        names = list(inspect.signature(block.step).parameters)
        self._start = [values[name] for name in names]
        carrier, self._sign = _carrier(block, values)
        self._place = names.index(carrier)
        self._start[self._place] = 0
        outputs = [item.name for item in block.outputs]
        self._output = outputs.index("OUTPUT")
        self._states = [(names.index(state.name), len(outputs) + number) for number, state in enumerate(block.states)]
        self._bounds = _bounds(block, values)
        inner = next((n for n, state in enumerate(block.states) if state.name in ("integrator", "y1")), None)
        self._inner = None if self._bounds.inner is None or inner is None else len(outputs) + inner
        self._start, self._rest = self._at_rest()
        self.begin()

    def begin(self) -> None:
        """Put the block to rest and forget what it ran into."""
        self._arguments = list(self._start)
        self._last = self._rest
        self._touched: set[str] = set()

    def _at_rest(self) -> tuple[list[Value], int]:
        """Return the arguments with the states, and OUTPUT, at which a signal of 0 leaves the block."""
        arguments = list(self._start)
        output = 0
        for _ in range(MOST_SCANS_TO_REST):
            result = self._step(*arguments)
            before = [arguments[argument] for argument, _ in self._states]
            after = [result[position] for _, position in self._states]
            for (argument, _), value in zip(self._states, after, strict=True):
                arguments[argument] = value
            output = result[self._output]
            if after == before:
                break
        return arguments, output

    @property
    def room(self) -> int:
        """How many counts OUTPUT may move to either side of rest."""
        return max(0, min(self._bounds.high - self._rest, self._rest - self._bounds.low))

    @property
    def rest(self) -> int:
        """OUTPUT while the signal is 0: of a PID FEED_FORWARD, within its limits."""
        return self._rest

    @property
    def most_change(self) -> int:
        """How many counts OUTPUT may move in a scan."""
        return self._bounds.most_change

    @property
    def inner_room(self) -> float | None:
        """How many counts the integrator may move to either side of 0; None for a block without one that is limited."""
        inner = self._bounds.inner
        return None if inner is None else max(0.0, min(inner[1], -inner[0]))

    @property
    def touched(self) -> tuple[str, ...]:
        """What the block ran into since ``forget``: limits, the range of section 51, MAX_CHANGE, 16 bits."""
        return tuple(sorted(self._touched))

    def forget(self) -> None:
        """Forget what it ran into, and go on."""
        self._touched.clear()

    def run(self, signal: Iterable[int]) -> list[int]:
        """Run one scan for each value of the signal and return OUTPUT after each."""
        step, arguments, states = self._step, self._arguments, self._states
        place, sign, output, inner = self._place, self._sign, self._output, self._inner
        found: list[int] = []
        least = most = 0.0
        for counts in signal:
            arguments[place] = sign * counts
            result = step(*arguments)
            for argument, position in states:
                arguments[argument] = result[position]
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
        """Note what a run went into."""
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
    """What limits a block: its output, and its integrator where it has one that is limited."""

    def __init__(self, values: Mapping[str, Value]) -> None:
        self.high = int(values.get("limit_plus", INT16_MAX))
        self.low = int(values.get("limit_minus", INT16_MIN))
        self.high_name = f"LIMIT_PLUS {self.high}" if self.high < INT16_MAX else "16 bits"
        self.low_name = f"LIMIT_MINUS {self.low}" if self.low > -INT16_MAX else "16 bits"
        self.inner: tuple[float, float] | None = None
        self.inner_names = ("", "")
        self.most_change = max(0, int(values.get("max_change", _ANY_CHANGE)))


def _bounds(block: Block, values: Mapping[str, Value]) -> _Bounds:
    bounds = _Bounds(values)
    if "span" in values:
        span = float(values["span"])
        bounds.inner = (max(-span, float(bounds.low)), min(span, float(bounds.high)))
        name = f"the integrator's range +-{span:.0f} (section 51)"
        short = span < INT16_MAX
        bounds.inner_names = (
            name if short and bounds.low < -span else bounds.low_name,
            name if short and bounds.high > span else bounds.high_name,
        )
    elif block.name == "PID":
        bounds.inner = (float(bounds.low), float(bounds.high))
        bounds.inner_names = (bounds.low_name, bounds.high_name)
    return bounds


def _carrier(block: Block, values: Mapping[str, Value]) -> tuple[str, int]:
    """Return the input that carries the signal, and its sign."""
    if block.name != "PID":
        return "input", 1
    if values["derivative"]:
        return "feedback", 1 if values["action"] else -1
    return "input", -1 if values["action"] else 1
