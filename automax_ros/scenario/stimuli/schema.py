"""The JSON schema of a stimuli file, for editors: the form of entries. It does not know the rack's names."""

from __future__ import annotations

from automax_ros.core.json_schema import (
    Keys,
    Schema,
    document,
    either,
    entries,
    flag,
    line,
    listed,
    number,
    scalar,
    section,
    words,
)
from automax_ros.core.ticks import MOST_SECONDS
from automax_ros.drive.plant.faults import VERBS, PlantVerb
from automax_ros.scenario.stimuli.values import LEAST_HZ
from automax_ros.scenario.stimuli.waves import MOST_HZ

MOST_ENTRIES = 50_000
_NAME = r"^\s*[A-Za-z_][^{}]*$"
_SLOT = r"^(0|[1-9]|1[0-5])$"
_NAMED = scalar("A name.")


def schema() -> Schema:
    """Return the JSON schema of a stimuli file."""
    entry = {
        **section("What happens at a time.", {"at": _seconds("Rack time, s."), **VERB_SCHEMAS}, ("at",)),
        "minProperties": 2,
        "maxProperties": 2,
    }
    return document("AutoMax stimuli", listed("Entries: each a time and one verb.", entry, least=1, most=MOST_ENTRIES))


def _seconds(text: str) -> Schema:
    return number(text, 0, MOST_SECONDS)


def _values(text: str) -> Schema:
    return _map_schema(text, scalar("The value."))


def _map_schema(text: str, value: Schema) -> Schema:
    return {**entries(text, _NAME, value), "minProperties": 1}


def _names(text: str, *more: Schema) -> Schema:
    return either(text, listed("Several names.", _NAMED, least=1), _NAMED, *more)


def _always(text: str) -> Schema:
    return words(text, (True, "on", "On", "ON", 1))


def _wave(text: str, keys: Keys, *required: str) -> Schema:
    return _map_schema(text, section(text, keys, required))


def _square(text: str) -> Schema:
    boolean = {r"@\s*(\(|$)": section(text, _SQUARE, ("hz",))}
    number_of = {r"^\s*[A-Za-z_][^{}@]*$": section(text, _SQUARE, ("hz", "low", "high"))}
    return {**entries(text, _NAME, {}), "patternProperties": {**boolean, **number_of}, "minProperties": 1}


def _of_plant(verb: PlantVerb) -> Schema:
    text = f"{verb.wants[:1].upper()}{verb.wants[1:]}."
    if not verb.keys:
        return scalar(text)
    keys = {key: {"type": "number"} for key in verb.keys}
    first = "The first alone" if verb.needed == 1 else f"The first {verb.needed}"
    plain = scalar(f"{first}, or more of them, with blanks between them.")
    return either(text, plain, section(text, keys, verb.keys[: verb.needed]))


_HZ = number("Periods per second.", LEAST_HZ, MOST_HZ)
_FOR = _seconds("How long, s; without it there is no end.")
_RAMP: Keys = {"to": scalar("The last value."), "over": _seconds("In this time, s.")}
_SINE: Keys = {
    "mean": {"type": "number", "description": "What it swings around.", "default": 0},
    "amplitude": {"type": "number", "description": "Half of its height."},
    "hz": _HZ,
    "for": _FOR,
}
_SQUARE: Keys = {"low": scalar("The low level."), "high": scalar("The high level."), "hz": _HZ, "for": _FOR}
_RELOAD: Keys = {
    "file": line("The source, below the folder of the stimuli file or of the rack file.", 200),
    "keep_state": flag("Carry values over by name.", False),
}
_POWER: Keys = {
    "off_for": _seconds("How long the power is off, s."),
    "battery": flag("Whether non-volatile memory is kept.", True),
}
VERB_SCHEMAS: Keys = {
    "set": _values("Writes commons, I/O points and elements of arrays; names with several subscripts in quotes."),
    "ramp": _wave("From the present value to `to` in `over` seconds.", _RAMP, "to", "over"),
    "sine": _wave("A sine: a sample each millisecond.", _SINE, "amplitude", "hz"),
    "square": _square("Half a period high, half a period low; a BOOLEAN needs no levels."),
    "force": _values("Holds simple variables, commons or TASK.NAME, at a value."),
    "unforce": _names("Releases what is forced; `all` for everything."),
    "tune": _values("Sets tunables, TASK.NAME."),
    "run": _names("Puts tasks into RUN."),
    "stop": _names("Stops tasks."),
    "delete": _names("Deletes tasks."),
    "reload": _map_schema(
        "Installs other sources of tasks.",
        either("The source.", _RELOAD["file"], section("The source, and how.", _RELOAD, ("file",))),
    ),
    "run_all": _always("Puts all tasks into RUN."),
    "stop_all": _always("STOP ALL."),
    "clear_errors": _names("Clears error logs of tasks; `all` for all."),
    "power": section("Power off, and on again.", _POWER, ("off_for",)),
    "module": entries(
        "Moves switches of modules, by slots.",
        _SLOT,
        {**entries("Switches with their positions.", "^[a-z_]+$", scalar("A position.")), "minProperties": 1},
    ),
    "plant": _map_schema(
        "Breaks, mends or loads plants.",
        {
            **section("What happens to the plant.", {name: _of_plant(verb) for name, verb in VERBS.items()}),
            "minProperties": 1,
        },
    ),
}
"""The values that each verb accepts."""
