"""The signals of webs and of their ends at an instant: single ones, as instruments show them, and all at once."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final

from automax_ros.core.types import DataType
from automax_ros.drive.web.end import WebEnd
from automax_ros.drive.web.span import WebSpan

FPM_PER_MPS: Final = 60.0 / 0.3048
"""Feet per minute in one meter per second."""

WEB_SIGNALS: Mapping[str, Callable[[WebSpan], float]] = {
    "tension_n": lambda span: span.tension_n,
    "strain_percent": lambda span: 100.0 * span.strain,
    "draw_percent": lambda span: 100.0 * span.draw,
    "slack_m": lambda span: span.slack_m,
    "dancer_m": lambda span: span.dancer_m,
    "broken": lambda span: 1.0 if span.broken else 0.0,
}
"""Values of a web at the present of its ends: ``WebSpan.advance`` brings them to an instant."""
WEB_UNITS: Mapping[str, str] = {
    "tension_n": "N",
    "strain_percent": "%",
    "draw_percent": "%",
    "slack_m": "m",
    "dancer_m": "m",
}
"""Units of the signals of a web that are REALs; ``broken`` is a BOOLEAN."""
WEB_KINDS: Mapping[str, DataType] = {**dict.fromkeys(WEB_UNITS, DataType.REAL), "broken": DataType.BOOLEAN}
"""The types of all signals of a web."""

END_SIGNALS: Mapping[str, Callable[[WebEnd], float]] = {
    "web_mps": lambda end: end.speed_mps,
    "web_fpm": lambda end: end.speed_mps * FPM_PER_MPS,
    "diameter_m": lambda end: end.diameter_m,
    "web_m": lambda end: end.present_web_m,
    "roll_turns": lambda end: end.present_turns,
}
"""Values of a plant's roll or roller at the plant's present."""
END_UNITS: Mapping[str, str] = {
    "web_mps": "m/s",
    "web_fpm": "ft/min",
    "diameter_m": "m",
    "web_m": "m",
    "roll_turns": "",
}
"""Units of the signals of an end; all are REALs."""
END_KINDS: Mapping[str, DataType] = dict.fromkeys(END_UNITS, DataType.REAL)
"""The types of all signals of an end."""


@dataclass(frozen=True)
class WebSignals:
    """A web at an instant; the names are those of ``WEB_SIGNALS``."""

    tension_n: float
    strain_percent: float
    draw_percent: float
    slack_m: float
    dancer_m: float
    broken: bool


@dataclass(frozen=True)
class EndSignals:
    """A roll or roller at an instant; the names are those of ``END_SIGNALS``."""

    web_mps: float
    web_fpm: float
    diameter_m: float
    web_m: float
    roll_turns: float


def web_signals_of(span: WebSpan) -> WebSignals:
    """Return the signals of a web at the present of its ends."""
    strain, draw = 100.0 * span.strain, 100.0 * span.draw
    return WebSignals(span.tension_n, strain, draw, span.slack_m, span.dancer_m, span.broken)


def end_signals_of(end: WebEnd) -> EndSignals:
    """Return the signals of a roll or roller at its plant's present."""
    speed = end.speed_mps
    return EndSignals(speed, speed * FPM_PER_MPS, end.diameter_m, end.present_web_m, end.present_turns)
