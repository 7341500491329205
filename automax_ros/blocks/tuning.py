"""What the coefficients of a dynamic block mean at a scan period: corners, limits as numbers, range (41 to 51)."""

from __future__ import annotations

import enum
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import product

from automax_ros.blocks.coefficients import TWO_TO_MINUS_18, evaluate, integrator_range, is_within, limited
from automax_ros.blocks.declaration import Block, Bound, Coefficients, Limit
from automax_ros.blocks.filters import GREATEST_RATIO, LEAST_RATIO
from automax_ros.blocks.transfer import Transfer, mapped

NEAR = 0.1
"""A coefficient is close to a limit within this share of the limit, at most of the room between the two (decision)."""
RANGE_EDGES = (0.125, 0.25)
"""The coefficients Kx at which the range of an integrator changes (section 51)."""
Ends = tuple[float, float]


class Verdict(enum.Enum):
    """Where a value lies between its limits."""

    UNKNOWN = "unknown"
    WITHIN = "within"
    NEAR_LOW = "near_low"
    NEAR_HIGH = "near_high"
    BELOW = "below"
    ABOVE = "above"


@dataclass(frozen=True)
class LimitNow:
    """The limits of one parameter as numbers at a scan period, in its own unit; one that cannot be known is None.

    ``value`` is what the CALL gives or the default, before it is limited; ``given`` tells which of the two. A default
    is not limited. Where the limits cross the high one is both.
    """

    parameter: str
    low: float | None
    high: float | None
    low_text: str
    high_text: str
    value: float | None
    given: bool
    verdict: Verdict
    crossed: bool = False


@dataclass(frozen=True)
class Corner:
    """A frequency at which a transfer function bends: ``rad_s`` as the Laplace function has it.

    ``mapped_rad_s`` is where the discrete function has the value that Laplace's has at the corner; None where the
    block is not made by a mapping (PID). ``discrete`` is None at or above the Nyquist frequency. ``laplace`` and
    ``discrete`` are gains at ``rad_s``.
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
        """How far the mapping moves the corner, as a share of it; below 0 towards lower frequencies."""
        return None if self.mapped_rad_s is None else self.mapped_rad_s / self.rad_s - 1.0


@dataclass(frozen=True)
class IntegratorRange:
    """Section 51: the coefficient Kx with its formula, the range in counts, the edge of Kx that is close if one is."""

    kx: float
    formula: str
    counts: int
    near_edge: float | None


@dataclass(frozen=True)
class Ratio:
    """LEAD_LAG's ratio of the larger to the smaller of WLD and WLG (44.1)."""

    value: float
    low: float
    high: float
    verdict: Verdict


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
    def nyquist_rad_s(self) -> float:
        """Half the frequency of its executions, in rad/s."""
        return math.pi / self.period_s


def tuning(block: Block, scan_s: float, given: Mapping[str, float | None]) -> Tuning:
    """Return what the parameters of a block mean; the block has coefficients.

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
    ratio = _ratio(block, values)
    if declared.relation is not None and not declared.relation.holds(values):
        values.update(declared.relation.first(scan_s, values))
        moved = [*moved, *declared.relation.parameters]
    transfer = transfer_of(block, scan_s, values)
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
        corners=_corners(block, values, transfer),
        integrator=_integrator(block, values, transfer),
        ratio=ratio,
    )


def transfer_of(block: Block, scan_s: float, values: Mapping[str, float]) -> Transfer:
    """Return the transfer function of a block with coefficients, from parameters in force.

    That of THERMAL_OVERLOAD leads from the scaled square of the current to CALL_RISE; it maps with C = 2/T.
    """
    declared = block.coefficients
    assert declared is not None
    if declared.transfer is not None:
        return declared.transfer(scan_s, values)
    gain = dict(zip(declared.names, declared.compute(scan_s, values), strict=True))["gain"]
    lag = gain / (1.0 - gain) * 2.0 / scan_s
    return mapped((1.0,), (1.0 / lag, 1.0), 2.0 / scan_s, scan_s)


def rate_gain(counts_per_s: float, input_counts: float) -> float:
    """Return the KI of an INTEGRATE that gains ``counts_per_s`` at a constant INPUT, with WM not programmed (42.3).

    KI = Kx C with Kx = y T / (2 x) and C = (pi / 10 T) / tan(pi / 20): T drops out.
    """
    return RATE_FACTOR * counts_per_s / input_counts


RATE_FACTOR = (math.pi / 20.0) / math.tan(math.pi / 20.0)
"""KI x / y of section 42.3: 0.99176; the manual prints 0.99179."""


def verdict_of(value: float, low: float | None, high: float | None) -> Verdict:
    """Return where a value lies: near is within NEAR of a limit, on the limit's own scale; 0 has no scale.

    A side that is not known (None) is not judged; UNKNOWN is a value that is neither beyond nor near the other.
    """
    if not is_within(value, -math.inf if low is None else low, math.inf if high is None else high):
        return Verdict.ABOVE if high is not None and value > high else Verdict.BELOW
    room = NEAR * (high - low) if low is not None and high is not None else math.inf
    if low is not None and low != 0.0 and value <= low + min(NEAR * abs(low), room):
        return Verdict.NEAR_LOW
    if high is not None and value >= high - min(NEAR * abs(high), room):
        return Verdict.NEAR_HIGH
    return Verdict.UNKNOWN if low is None or high is None else Verdict.WITHIN


def loose_bounds(
    limit: Limit, period_s: float, values: Mapping[str, float], ranges: Mapping[str, tuple[float, float]]
) -> tuple[float | None, float | None]:
    """Return what no value of a parameter may pass, whatever those parameters are that only ``ranges`` tells of.

    A bound that reads one of these is taken at both ends of its range, and the loosest counts; every bound goes one way
    as a parameter rises. One that reads a parameter of which nothing is known is None.
    """
    open_ones = [name for name in limit.uses if name not in values and name in ranges]
    corners = [
        {**values, **dict(zip(open_ones, ends, strict=True))} for ends in product(*(ranges[name] for name in open_ones))
    ]
    lows = [_bound(limit.low, period_s, corner) for corner in corners]
    highs = [_bound(limit.high, period_s, corner) for corner in corners]
    low = min((value for value in lows if value is not None), default=None)
    return low, max((value for value in highs if value is not None), default=None)


def range_within(limit: Limit, period_s: float, values: Mapping[str, float], low: float, high: float) -> Ends | None:
    """Return the values in force of a parameter that moves between ``low`` and ``high``, None where none are known."""
    least, most = loose_bounds(limit, period_s, values, {})
    if least is None or most is None:
        return None
    return min(max(low, least), most), min(max(high, least), most)


def _limits(
    declared: Coefficients, scan_s: float, known: Mapping[str, float], given: Mapping[str, float | None]
) -> tuple[LimitNow, ...]:
    rows = []
    in_force = dict(known)
    ranges: dict[str, Ends] = {}
    for limit in declared.limits:
        low, high = _bound(limit.low, scan_s, in_force), _bound(limit.high, scan_s, in_force)
        crossed = low is not None and high is not None and low > high
        if crossed:
            low = high
        value = known.get(limit.parameter)
        is_given = limit.parameter in given
        verdict = Verdict.UNKNOWN
        if value is None:
            ends = range_within(limit, scan_s, in_force, -math.inf, math.inf)
            if ends is not None:
                ranges[limit.parameter] = ends
        else:
            verdict = verdict_of(value, low, high) if is_given else Verdict.WITHIN
            if verdict is Verdict.UNKNOWN:
                beyond = verdict_of(value, *loose_bounds(limit, scan_s, in_force, ranges))
                verdict = beyond if beyond in (Verdict.BELOW, Verdict.ABOVE) else verdict
        # A limit that reads a parameter sees its limited value.
        if verdict is Verdict.BELOW and low is not None:
            in_force[limit.parameter] = low
        elif verdict is Verdict.ABOVE and high is not None:
            in_force[limit.parameter] = high
        rows.append(
            LimitNow(
                limit.parameter, low, high, limit.low_text, limit.high_text, value, is_given, verdict, crossed=crossed
            )
        )
    return tuple(rows)


def _bound(bound: Bound, scan_s: float, values: Mapping[str, float]) -> float | None:
    """Return a limit as a number, None where it needs a parameter that is not known, or has no meaning."""
    try:
        return bound(scan_s, values)
    except (KeyError, ArithmeticError, ValueError):
        return None


def _ratio(block: Block, values: Mapping[str, float]) -> Ratio | None:
    if block.name != "LEAD_LAG":
        return None
    value = max(values["WLD"], values["WLG"]) / min(values["WLD"], values["WLG"])
    return Ratio(value, LEAST_RATIO, GREATEST_RATIO, verdict_of(value, LEAST_RATIO, GREATEST_RATIO))


_KX: dict[str, tuple[str, Callable[[Mapping[str, float]], float]]] = {
    "LAG": ("WLG / C", lambda values: values["WLG"]),
    "DIFF_LAG": ("WLG / C", lambda values: values["WLG"]),
    "INTEGRATE": ("KI / C", lambda values: values["KI"]),
    "PROP_INT": ("KP x WLD / C", lambda values: values["KP"] * values["WLD"]),
}
"""The coefficient of the integrators that section 51 limits."""


def _integrator(block: Block, values: Mapping[str, float], transfer: Transfer) -> IntegratorRange | None:
    if block.name not in _KX or transfer.mapping is None:
        return None
    formula, frequency = _KX[block.name]
    return range_of(frequency(values) / transfer.mapping, formula)


def range_of(kx: float, formula: str) -> IntegratorRange:
    """Return the range of an integrator by its coefficient, and whether an edge of section 51 is close."""
    near = next((edge for edge in RANGE_EDGES if abs(kx - edge) <= NEAR * edge), None)
    return IntegratorRange(kx, formula, int(integrator_range(kx)), near)


def _corners(block: Block, values: Mapping[str, float], transfer: Transfer) -> tuple[Corner, ...]:
    return tuple(_corner(name, rad_s, transfer) for name, rad_s in _bends(block, values, transfer))


def _bends(block: Block, values: Mapping[str, float], transfer: Transfer) -> list[tuple[str, float]]:
    """Return the names and frequencies of a block's corners, in rad/s."""
    if block.name == "INTEGRATE":
        return [("unity gain, KI", values["KI"])]
    if block.name == "PID":
        return _pid_bends(transfer, isa=bool(values["ISA"]))
    if "WN" in values:
        low, high = _notch_edges(values)
        return [("-3 dB below WN", low), ("WN", values["WN"]), ("-3 dB above WN", high)]
    if block.name == "THERMAL_OVERLOAD":
        return [("wlg", transfer.denominator[1] / transfer.denominator[0])]
    return [(name, values[name]) for name in ("WLD", "WLG") if name in values]


def _notch_edges(values: Mapping[str, float]) -> tuple[float, float]:
    """Return where a notch of one or two equal stages takes 3 dB: WN (sqrt(1 + u**2) -+ u)."""
    width = 0.5 / values["Q_FACTOR"]
    if values.get("ORDER") == 4.0:
        width /= math.sqrt(math.sqrt(2.0) - 1.0)
    middle = math.sqrt(1.0 + width * width)
    return values["WN"] * (middle - width), values["WN"] * (middle + width)


def _pid_bends(transfer: Transfer, *, isa: bool) -> list[tuple[str, float]]:
    """Return where the P term takes over from the I term, and the D term from it, as far as the gains are not 0."""
    derivative, proportional, integral = transfer.numerator
    bends = []
    if integral > 0.0 and proportional > 0.0:
        bends.append(("KI" if isa else "KI/KP", integral / proportional))
    elif integral > 0.0:
        bends.append(("unity gain, KI", integral))
    if derivative > 0.0 and proportional > 0.0:
        bends.append(("1/KD" if isa else "KP/KD", proportional / derivative))
    return bends


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


def rate_limits(period_s: float) -> tuple[float, float]:
    """Return the limits of INTEGRATE's KI with WM not programmed (42.2): 2**-18 C and 0.9 pi / T."""
    return TWO_TO_MINUS_18 * 2.0 * RATE_FACTOR / period_s, 0.9 * math.pi / period_s
