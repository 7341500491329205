"""The coefficients of a dynamic block at a scan period: corners, limits as numbers, range (41 to 51)."""

from __future__ import annotations

import enum
import math
from collections.abc import Mapping
from dataclasses import dataclass

from automax_ros.blocks.declare.coefficients import (
    Ends,
    bound_now,
    evaluate,
    integrator_range,
    is_within,
    limited,
    loose_bounds,
    range_within,
)
from automax_ros.blocks.declare.declaration import Block, Coefficients, Relation
from automax_ros.blocks.declare.dynamics import Integrator, Transfer

NEAR = 0.1
"""A coefficient is close to a limit within this share of the limit, at most of the room between the two (decision)."""
RANGE_EDGES = (0.125, 0.25)
"""The coefficients Kx at which the range of an integrator changes (section 51)."""


class LimitVerdict(enum.Enum):
    """Position of a value between its limits."""

    UNKNOWN = "unknown"
    WITHIN = "within"
    NEAR_LOW = "near_low"
    NEAR_HIGH = "near_high"
    BELOW = "below"
    ABOVE = "above"


@dataclass(frozen=True)
class LimitNow:
    """The limits of one parameter as numbers at a scan period, in its own unit; one that cannot be known is None.

    ``value`` is from the CALL or the default, before it is limited; ``given`` is TRUE if it is from the CALL. A default
    is not limited. If the limits cross, both are the high one.
    """

    parameter: str
    low: float | None
    high: float | None
    low_text: str
    high_text: str
    value: float | None
    given: bool
    verdict: LimitVerdict
    crossed: bool = False


@dataclass(frozen=True)
class Corner:
    """A frequency at which a transfer function bends: ``rad_s`` is that of the Laplace function.

    At ``mapped_rad_s`` the discrete function has the value of the Laplace function at the corner; None if the block is
    not made by a mapping (PID). ``discrete`` is None at or above the Nyquist frequency. ``laplace`` and ``discrete``
    are gains at ``rad_s``.
    """

    name: str
    rad_s: float
    laplace: complex
    discrete: complex | None
    mapped_rad_s: float | None

    @property
    def hz(self) -> float:
        """The frequency in Hz."""
        return self.rad_s / (2.0 * math.pi)

    @property
    def time_constant_s(self) -> float:
        """1 / frequency, in s."""
        return 1.0 / self.rad_s

    @property
    def warping(self) -> float | None:
        """Shift of the corner by the mapping, as a share of it; below 0 towards lower frequencies."""
        return None if self.mapped_rad_s is None else self.mapped_rad_s / self.rad_s - 1.0


@dataclass(frozen=True)
class IntegratorRange:
    """Section 51: the coefficient Kx with its formula, the range in counts, and a near edge of Kx if any."""

    kx: float
    formula: str
    counts: int
    near_edge: float | None


@dataclass(frozen=True)
class Ratio:
    """The ratio of the larger to the smaller of two parameters that a rule bounds (44.1)."""

    parameters: tuple[str, ...]
    value: float
    low: float
    high: float
    verdict: LimitVerdict


@dataclass(frozen=True)
class Tuning:
    """A block's coefficients at a scan period of ``scan_s``; ``period_s`` is the time between its executions.

    ``values`` are the parameters in force, ``moved`` those that had to be limited; ``missing`` those without a value:
    as long as there are any, there are neither ``transfer`` nor what follows from it, ``coefficients`` included.
    """

    block: Block
    scan_s: float
    period_s: float
    values: Mapping[str, float]
    moved: tuple[str, ...]
    missing: tuple[str, ...]
    limits: tuple[LimitNow, ...]
    transfer: Transfer | None
    coefficients: Mapping[str, float]
    corners: tuple[Corner, ...]
    integrator: IntegratorRange | None
    ratio: Ratio | None

    @property
    def declared(self) -> Coefficients:
        """The block's declaration of its coefficients."""
        assert self.block.coefficients is not None
        return self.block.coefficients

    @property
    def laplace(self) -> str:
        """The Laplace function with its numbers, such as ``1 / (1 + s/10)``; nothing may be missing."""
        return self.declared.dynamics.laplace(self.values)

    @property
    def equation(self) -> str:
        """The equation that the block executes, in the terms of its coefficients; nothing may be missing."""
        return self.declared.dynamics.equation(self.values)

    @property
    def period_text(self) -> str:
        """The time between executions, such as ``T = 22 ms``."""
        return f"{self.declared.period_name} = {self.period_s * 1e3:g} ms"

    @property
    def nyquist_rad_s(self) -> float:
        """Half the frequency of its executions, in rad/s."""
        return math.pi / self.period_s


def tuning(block: Block, scan_s: float, given: Mapping[str, float | None]) -> Tuning:
    """Return the tuning of a block with coefficients from its parameters.

    ``given`` has the parameters that the CALL programs, None for one whose value is not known.
    """
    declared = block.coefficients
    assert declared is not None
    known = {name: value for name, value in given.items() if value is not None}
    missing = tuple(name for name in declared.parameters if name in given and name not in known)
    every = {**declared.defaults(scan_s), **known}
    for name in missing:
        every.pop(name, None)
    limits = _limits(declared, scan_s, every, given)
    if missing:
        period = every.get(declared.executed_every, scan_s)
        return Tuning(block, scan_s, period, every, (), missing, limits, None, {}, (), None, None)
    values, moved = limited(declared, scan_s, known)
    ratio = _ratio(declared.relation, values)
    if declared.relation is not None and not declared.relation.holds(values):
        values.update(declared.relation.first(scan_s, values))
        moved = [*moved, *declared.relation.parameters]
    transfer = declared.dynamics.transfer(scan_s, values)
    results, _ = evaluate(block, scan_s, known)
    return Tuning(
        block=block,
        scan_s=scan_s,
        period_s=transfer.period_s,
        values=values,
        moved=tuple(moved),
        missing=(),
        limits=limits,
        transfer=transfer,
        coefficients=dict(zip(declared.names, results, strict=True)),
        corners=tuple(_corner(name, rad_s, transfer) for name, rad_s in declared.dynamics.corners(values)),
        integrator=_integrator(declared.dynamics.integrator, values, transfer),
        ratio=ratio,
    )


def verdict_of(value: float, low: float | None, high: float | None) -> LimitVerdict:
    """Return the position of a value: near is within NEAR of a limit, on the limit's own scale; 0 has no scale.

    A limit that is not known (None) is not judged; UNKNOWN is a value that is neither beyond nor near the other.
    """
    if not is_within(value, -math.inf if low is None else low, math.inf if high is None else high):
        return LimitVerdict.ABOVE if high is not None and value > high else LimitVerdict.BELOW
    room = NEAR * (high - low) if low is not None and high is not None else math.inf
    if low is not None and low != 0.0 and value <= low + min(NEAR * abs(low), room):
        return LimitVerdict.NEAR_LOW
    if high is not None and value >= high - min(NEAR * abs(high), room):
        return LimitVerdict.NEAR_HIGH
    return LimitVerdict.UNKNOWN if low is None or high is None else LimitVerdict.WITHIN


def _limits(
    declared: Coefficients, scan_s: float, known: Mapping[str, float], given: Mapping[str, float | None]
) -> tuple[LimitNow, ...]:
    rows = []
    in_force = dict(known)
    ranges: dict[str, Ends] = {}
    for limit in declared.limits:
        low, high = bound_now(limit.low, scan_s, in_force), bound_now(limit.high, scan_s, in_force)
        crossed = low is not None and high is not None and low > high
        if crossed:
            low = high
        value = known.get(limit.parameter)
        is_given = limit.parameter in given
        verdict = LimitVerdict.UNKNOWN
        if value is None:
            ends = range_within(limit, scan_s, in_force, -math.inf, math.inf)
            if ends is not None:
                ranges[limit.parameter] = ends
        else:
            verdict = verdict_of(value, low, high) if is_given else LimitVerdict.WITHIN
            if verdict is LimitVerdict.UNKNOWN:
                beyond = verdict_of(value, *loose_bounds(limit, scan_s, in_force, ranges))
                verdict = beyond if beyond in (LimitVerdict.BELOW, LimitVerdict.ABOVE) else verdict
        # A limit that reads a parameter sees its limited value.
        if verdict is LimitVerdict.BELOW and low is not None:
            in_force[limit.parameter] = low
        elif verdict is LimitVerdict.ABOVE and high is not None:
            in_force[limit.parameter] = high
        rows.append(
            LimitNow(
                limit.parameter, low, high, limit.low_text, limit.high_text, value, is_given, verdict, crossed=crossed
            )
        )
    return tuple(rows)


def _ratio(relation: Relation | None, values: Mapping[str, float]) -> Ratio | None:
    if relation is None or relation.ratio is None:
        return None
    related = [values[name] for name in relation.parameters]
    value = max(related) / min(related)
    return Ratio(relation.parameters, value, *relation.ratio, verdict_of(value, *relation.ratio))


def _integrator(
    integrator: Integrator | None, values: Mapping[str, float], transfer: Transfer
) -> IntegratorRange | None:
    if integrator is None or integrator.rate is None or transfer.mapping is None:
        return None
    return range_of(integrator.rate(values) / transfer.mapping, integrator.formula)


def range_of(kx: float, formula: str) -> IntegratorRange:
    """Return the range of an integrator by its coefficient, and whether an edge of section 51 is close."""
    near = next((edge for edge in RANGE_EDGES if abs(kx - edge) <= NEAR * edge), None)
    return IntegratorRange(kx, formula, int(integrator_range(kx)), near)


def _corner(name: str, rad_s: float, transfer: Transfer) -> Corner:
    below_nyquist = rad_s * transfer.period_s < math.pi
    c = transfer.mapping
    return Corner(
        name=name,
        rad_s=rad_s,
        laplace=transfer.laplace_response(rad_s),
        discrete=transfer.discrete_response(rad_s) if below_nyquist else None,
        mapped_rad_s=None if c is None else 2.0 / transfer.period_s * math.atan(rad_s / c),
    )
