"""What happens to webs: break, thread, another stiffness, a splice, lost traction. Each acts at the present."""

from __future__ import annotations

from typing import Final

from automax_ros.drive.base.errors import ParameterError, require
from automax_ros.drive.plant.faults import forget, note
from automax_ros.drive.web.data import LEAST_STIFFNESS_N, MOST_STIFFNESS_N, Roll
from automax_ros.drive.web.end import SLIP, WebEnd
from automax_ros.drive.web.span import WebSpan

THREAD_MPS: Final = 0.5
"""The fastest at which a web can be threaded, m/s."""


def break_web(span: WebSpan) -> None:
    """Break a web: it has no tension until it is threaded, and rolls keep what they have."""
    settle(span.source)
    span.part()
    begin(span.source)


def thread_web(span: WebSpan, what: str = "the web") -> None:
    """Thread a web again, without tension and without slack; its dancer rests where it is. ``what`` names the web.

    Raises:
        ParameterError: it is not broken, an end runs faster than ``THREAD_MPS``, or a roll is empty; nothing has
            changed then.
    """
    if not span.broken:
        raise ParameterError(f"{what} is not broken: there is nothing to thread")
    for end in (span.source, span.sink):
        if abs(end.speed_mps) > THREAD_MPS:
            raise ParameterError(
                f"a web cannot be threaded while an end runs at {end.speed_mps:.3g} m/s: "
                f"slow both down to {THREAD_MPS:g} m/s at most"
            )
    if span.source.roll is not None and span.source.wound_m <= 0.0:
        raise ParameterError("a web cannot be threaded from an empty roll: splice a new one first")
    settle(span.source)
    span.thread()
    begin(span.source)


def set_stiffness(span: WebSpan, stiffness_n: float) -> None:
    """Give a web another stiffness (tension at 100 % strain, N), at the strain that it has.

    Raises:
        ParameterError: it is outside its range.
    """
    require("stiffness of the web in N", stiffness_n, LEAST_STIFFNESS_N, MOST_STIFFNESS_N)
    settle(span.source)
    span.stiffness_n = stiffness_n
    begin(span.source)


def splice(end: WebEnd, diameter_m: float) -> None:
    """Put a new roll of a diameter (m) in place of the one that runs, at the same speed of the web.

    The motor's speed jumps to that of the new roll, as if another drive had brought it there; a shaft that is held at a
    speed keeps it (decision).

    Raises:
        ParameterError: there is no roll, or the diameter is outside its range.
    """
    roll = roll_for(end, diameter_m)
    settle(end)
    speed = end.speed_mps
    end.wind(roll.wound_m(diameter_m))
    if end.time is not None:
        end.time.carry()
        end.time.turn_at(end, speed)
    begin(end)


def roll_for(end: WebEnd, diameter_m: float) -> Roll:
    """Return the roll that a splice to a diameter (m) is of; whether it can be spliced never changes.

    Raises:
        ParameterError: there is no roll, or the diameter is outside its range.
    """
    if end.roll is None:
        raise ParameterError("only a roll can be spliced, and this plant has a roller")
    end.roll.check(diameter_m)
    return end.roll


def slip(end: WebEnd, fraction: float) -> None:
    """Let a roller lose its traction: it carries at most this part (0 to 1) of the tension that arrives.

    The repair of its plant ends it.

    Raises:
        ParameterError: it is a roll, or the part is outside its range.
    """
    require_slip(end, fraction)
    settle(end)
    end.slip = fraction
    forget(end.plant, SLIP)
    note(end.plant, f"{SLIP} {fraction:g}")
    begin(end)


def require_slip(end: WebEnd, fraction: float) -> None:
    """Check that an end can slip so; this never changes.

    Raises:
        ParameterError: it is a roll, or the part is outside its range.
    """
    if end.roll is not None:
        raise ParameterError("only a roller can slip, and this plant has a roll")
    require("part of the tension that the roller carries", fraction, 0.0, 1.0)


def settle(end: WebEnd) -> None:
    """End the slice of an end's chain at the present."""
    if end.time is not None:
        end.time.settle()


def begin(end: WebEnd) -> None:
    """Begin a slice of an end's chain."""
    if end.time is not None:
        end.time.begin()
