"""The keys of a feed, and what they take."""

from __future__ import annotations

from automax_ros.core.json_schema import Keys, Schema, entries, may_be_empty, number, section, words
from automax_ros.drive.plant_signals import SIGNALS
from automax_ros.rack.scale import SCHEMA as SCALE

LEAST_MS, MOST_MS, USUAL_MS = 0.1, 10_000.0, 1.0
"""Range of ``every_ms``, and what it is without the key (decision: an instrument is quicker than most scans)."""
FEED_KEYS: Keys = {
    "signal": words("What the instrument shows.", SIGNALS),
    "every_ms": number("How often it is written, ms.", LEAST_MS, MOST_MS, USUAL_MS),
    "scale": SCALE,
}
_FED = r"^[A-Za-z_][A-Za-z0-9_]{0,15}[%!]?\s*([(\[][0-9, ]*[)\]])?$"
FEED_SCHEMA: Schema = may_be_empty(
    entries("Signals of the plant into commons.", _FED, section("A feed.", FEED_KEYS, ("signal",)))
)
