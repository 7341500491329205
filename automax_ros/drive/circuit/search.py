"""Finds the event that ends an interval: the first current that falls to zero, the first SCR that turns on."""

from __future__ import annotations

from math import cos, exp, inf, sin

from automax_ros.drive.circuit.bridge import Bridge
from automax_ros.drive.circuit.network import Network, Phases
from automax_ros.drive.circuit.waves import ZERO_A, first_zero

Start = tuple[float, float, float, float, float]
"""Values at the start of an interval: the line's angle, its sine and cosine, k and a of the armature current."""


def next_ending(net: Network, omega: float, state: Start, modes: Phases, limit: float) -> tuple[float, int]:
    """Return when (s from now, at most a limit) the first current ends, and its SCRs and arcs as a mask."""
    theta, sine, cosine, k, a = state
    decay, decay_s = net.decay, net.decay_s
    mode_a, mode_b, mode_c = modes
    first, out = limit, 0
    lowest = -ZERO_A
    end_sine = end_cosine = fall = 0.0
    for mask, c, d, share, part, wa, wb, wc, curve in net.guards:
        guard_k, guard_a = share * k + part, share * a
        value = c * cosine + d * sine + guard_k + guard_a
        slope = omega * (d * cosine - c * sine) - decay * guard_a
        bend = curve
        if guard_a < 0.0:
            bend -= decay * decay * guard_a
        guard_b = wa * mode_a + wb * mode_b + wc * mode_c
        if guard_b:
            value += guard_b
            slope -= decay_s * guard_b
            if guard_b < 0.0:
                bend -= decay_s * decay_s * guard_b
        if value < lowest:  # a loop of legs has shared its current again: the one with the largest reverse current ends
            lowest, first, out = value, 0.0, mask
        if lowest < -ZERO_A:
            continue
        # A parabola of this curvature stays below the current: positive at the end, it proves that there is no zero.
        if value > ZERO_A or (value >= -ZERO_A and slope >= 0.0):
            least = value if value > 0.0 else 0.0
            if least + first * (slope - 0.5 * bend * first) > 0.0:
                continue
            if not out and not guard_b:  # likewise from both ends
                if not fall:
                    angle = theta + omega * limit
                    end_sine, end_cosine, fall = sin(angle), cos(angle), exp(-decay * limit)
                final = c * end_cosine + d * end_sine + guard_k + guard_a * fall
                sag = 0.5 * bend * limit - (final - least) / limit
                if final > 0.0 and (sag <= 0.0 or 2.0 * bend * least > sag * sag):
                    continue
        if -ZERO_A <= value <= ZERO_A and abs(guard_k) + abs(guard_a) + abs(guard_b) + bend < 1e-9:
            zero = 0.0  # nothing drives it any longer
        else:
            zero = first_zero(c, d, guard_k, guard_a, guard_b, theta, omega, decay, decay_s, first, curve)
        if zero <= first:
            first, out = zero, mask
    if out and out != net.guards[0][0]:
        net.put_first(out)
    return first, out


def next_turn_on(
    net: Network,
    bridge: Bridge,
    omega: float,
    emf: float,
    now_ns: float,
    state: Start,
    limit: float,
) -> tuple[float, int]:
    """Return when (s from now) forward voltage first turns on SCRs, and their mask; inf if not before a limit.

    ``state`` is the line's angle, its sine and cosine, and k and a of the armature current. A time with an empty mask
    means that nothing is known beyond it: some SCR rests until then.
    """
    wanted = bridge.candidates(now_ns, net.mask)
    if not wanted:
        return inf, 0
    theta, sine, cosine, k, a = state
    decay = net.decay
    soonest, who = inf, 0
    most, now_on = 0.0, 0
    for mask, c, d, constant, by_k, by_a, by_emf, curve in net.watches.get(wanted) or net.watch(wanted):
        short = -constant - by_k * k - by_emf * emf
        fade = by_a * a
        value = c * cosine + d * sine + fade - short
        if value > 0.0:
            if mask & bridge.recovering and bridge.rest_end_ns(mask) > now_ns:
                rest = (bridge.rest_end_ns(mask) - now_ns) * 1e-9
                soonest, who = (rest, 0) if rest < soonest else (soonest, who)
            elif value > most:
                most, now_on = value, mask
            continue
        horizon = limit if limit < soonest else soonest
        if not mask & bridge.gated and horizon > bridge.turn_off_ns * 1e-9:
            horizon = bridge.turn_off_ns * 1e-9
        slope = omega * (d * cosine - c * sine) - decay * fade
        bend = curve
        if fade > 0.0:
            bend += decay * decay * fade
        # As for the currents: a parabola that stays above the voltage and is negative proves that nothing turns on.
        if value + horizon * (slope + 0.5 * bend * horizon) < 0.0:
            continue
        horizon = min(horizon, (bridge.window_end_ns(mask, now_ns) - now_ns) * 1e-9)
        zero = first_zero(-c, -d, short, -fade, 0.0, theta, omega, decay, 0.0, horizon, curve)
        if zero < soonest and mask & bridge.recovering:
            rest = (bridge.rest_end_ns(mask) - now_ns) * 1e-9
            if zero < rest:
                zero, mask = rest, 0  # noqa: PLW2901
        if zero < soonest:
            soonest, who = zero, mask
    return (0.0, now_on) if now_on else (soonest, who)
