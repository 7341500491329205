"""The JSON schema of a stimuli file, for editors: the form of entries. It does not know the rack's names."""

from __future__ import annotations

from collections.abc import Mapping

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
from automax_ros.rack.operator.plant_verbs import PLANT_VERBS, WEB_VERBS, WorkVerb
from automax_ros.scenario.stimuli.table import LINEAR, VALUES
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


def _work(text: str, verbs: Mapping[str, WorkVerb]) -> Schema:
    return {**section(text, {name: _of_plant(verb) for name, verb in verbs.items()}), "minProperties": 1}


def _of_plant(verb: WorkVerb) -> Schema:
    if verb.is_alone:
        return _always("It takes no value.")
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
_TABLE: Keys = {
    "file": line("The CSV table, below the folder of the stimuli file or of the rack file.", 200),
    "time": line("The column with the times of rows, s; `time_s` without it.", 200),
    "columns": _map_schema("Variables, each with the name of its column.", scalar("The column's name.")),
    "hold": words(
        "`true`: a row holds until the next one; `linear`: numbers go from row to row in straight lines.",
        (True, "on", "On", "ON", 1, LINEAR),
        True,
    ),
    "values": words("`counts`, as those of `set`, or `unit`: by the `scale` of variables.", VALUES, VALUES[0]),
}
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
    "table": section("Columns of a CSV table drive variables, by the times of its rows.", _TABLE, ("file", "columns")),
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
        "Breaks, mends or loads plants, splices their rolls.", _work("What happens to the plant.", PLANT_VERBS)
    ),
    "web": _map_schema(
        "Breaks, threads or changes webs.",
        either(
            "What happens to the web.",
            words("It takes no value.", [name for name, verb in WEB_VERBS.items() if verb.is_alone]),
            _work("What happens to the web, with its value.", WEB_VERBS),
        ),
    ),
}
"""The values that each verb accepts."""
