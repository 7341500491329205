"""What the panel says of a rack from its file and its checked tasks alone, whether it runs or was recorded."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import automax_ros
from automax_ros.core.kinds import Direction
from automax_ros.core.problems.pages import page_text, problems_called
from automax_ros.core.text import quoted
from automax_ros.core.ticks import NS_PER_MS
from automax_ros.core.types import DataType
from automax_ros.drive.circuit.scr import BIT
from automax_ros.drive.web.data import SurfaceData
from automax_ros.language.program import Program, Symbol, lines_that_write
from automax_ros.panel.source import Facts, RequestRefused
from automax_ros.rack.modules.drive import CONTROLS
from automax_ros.rack.operator.plant_verbs import PLANT_VERBS, WEB_VERBS, WorkVerb
from automax_ros.rackfile.checks.common_use import reads_of
from automax_ros.rackfile.model.config import CommonVariable, RackConfig, driven_plants
from automax_ros.rackfile.model.module import ModuleConfig
from automax_ros.rackfile.model.plant_signals import ALL_UNITS
from automax_ros.rackfile.model.rack_names import RackNames
from automax_ros.rackfile.model.value_names import watched
from automax_ros.rackfile.modules.drive import DriveConfig
from automax_ros.rackfile.modules.registry import SUPPORTED

_TYPES = {kind: kind.word.lower().split()[0] for kind in DataType}
_WORDS = ("T1", "T2", "T3", *map(str, sorted(BIT)), "true", "all")
"""The words that verbs on plants take."""
NOT_OPERABLE = "its rack file does not say operator: true"


def hello_of(
    names: RackNames, kind: str, *, title: str, operate: Facts, span: Facts | None = None, other: Facts | None = None
) -> dict[str, Any]:
    """Return what a source says of its rack. ``kind`` is ``rack``, ``joined`` or ``recording``; the rest is as it is.

    ``operate`` has ``allowed`` and, if not, ``why``; ``span`` and ``other`` belong to recordings (docs/panel.md).
    """
    config, programs = names.config, names.programs
    return {
        "rack": config.name,
        "kind": kind,
        "title": title,
        "version": automax_ros.__version__,
        "operate": operate,
        "watch": [item.label for item in watched(config, None, programs.values())],
        "names": [*_commons(names), *_locals(names)],
        "tasks": [
            {
                "name": task.name,
                "slot": module.slot,
                "priority": task.priority,
                "period_ms": programs[task.name].period_ns / NS_PER_MS if task.name in programs else 0.0,
                "file": task.file.name,
            }
            for module, task in config.placed_tasks
        ],
        "plants": list(_plants(names)),
        "webs": [
            {
                "name": web.name,
                "from": web.start,
                "to": web.end,
                "signals": _signals(names, web.name),
                "controls": _controls(WEB_VERBS),
            }
            for web in config.webs
        ],
        "switches": [
            {"slot": module.slot, "control": control, "values": list(values)}
            for module in config.modules
            if isinstance(module, DriveConfig)
            for control, values in CONTROLS.items()
        ],
        "span": span,
        "other": other,
    }


def operable(config: RackConfig) -> Facts:
    """Return whether a rack's file lets it be operated, for ``hello_of``."""
    return {"allowed": config.operator, "why": "" if config.operator else NOT_OPERABLE}


def module_title(module: ModuleConfig) -> str:
    """Return what a module is: ``AutoMax 7010``, ``common memory module``."""
    title = SUPPORTED[module.model].models[module.model]
    return f"AutoMax {title}" if title.isdecimal() else title


def explained(code: str) -> dict[str, str]:
    """Return title and text of a problem's page, or of all pages of a code that the hardware shows.

    Raises:
        RequestRefused: there is none.
    """
    found = problems_called(code)
    if not found:
        raise RequestRefused(f"no problem code {quoted(code)}", "such as AMX7001, or the hardware's 14")
    title = "; ".join(f"{problem.code}: {problem.title}" for problem in found)
    return {"title": title, "text": "\n".join(map(page_text, found))}


def _commons(names: RackNames) -> Iterator[Facts]:
    writers, readers = uses_of(names.programs)
    feeds = {feed.common: f"{feed.plant}/{feed.signal}" for feed in names.config.feeds}
    for variable in names.config.declared:
        scale = variable.scale
        yield {
            **_variable(variable, variable.name),
            "unit": variable.unit,
            "scale": None if scale is None else {"counts": list(scale.counts), "value": list(scale.value)},
            "text": variable.description,
            "place": ", ".join(_places(variable, feeds)),
            "writers": writers.get(variable.name, []),
            "readers": readers.get(variable.name, []),
        }


def _locals(names: RackNames) -> Iterator[Facts]:
    for task in names.programs:
        for name, symbol in names.locals_of(task).items():
            limits = symbol.tuning
            tunable = None if limits is None else {"low": limits.low, "high": limits.high, "step": limits.step}
            own = {"task": task, "tunable": tunable, "writers": [task], "readers": [task]}
            yield {**_variable(symbol, f"{task}.{name}"), **own}


def _variable(variable: CommonVariable | Symbol, name: str) -> dict[str, Any]:
    kind = {"name": name, "type": _TYPES[variable.type], "dims": list(variable.dimensions)}
    return {**kind, "unit": "", "scale": None, "text": "", "place": "", "task": "", "tunable": None}


def uses_of(programs: Mapping[str, Program]) -> tuple[dict[str, list[str]], dict[str, list[str]]]:
    """Return the tasks that write, and those that read, each common."""
    writers: dict[str, list[str]] = {}
    readers: dict[str, list[str]] = {}
    for task, program in programs.items():
        for name in lines_that_write(program):
            writers.setdefault(name, []).append(task)
        for name in dict.fromkeys(name for name, _ in reads_of(program)):
            readers.setdefault(name, []).append(task)
    return writers, readers


def _places(variable: CommonVariable, feeds: Mapping[str, str]) -> Iterator[str]:
    point = variable.point
    if point is not None:
        yield f"slot {point.slot}, register {point.register}" + ("" if point.bit is None else f", bit {point.bit}")
    if variable.name in feeds:
        yield f"shows {feeds[variable.name]}"
    if variable.direction is Direction.IN:
        yield "from ROS 2"


def _plants(names: RackNames) -> Iterator[Facts]:
    """Yield the plants that drives turn, then others with a roll or roller, which have no slot."""
    driven = {item.name: item for item in driven_plants(names.config)}
    surfaces = {item.name: item.surface for item in names.config.plants}
    for name in dict.fromkeys((*driven, *names.ends)):
        verbs = {control: verb for control, verb in PLANT_VERBS.items() if _concerns(verb, surfaces[name])}
        own = {"signals": _signals(names, name), "controls": _controls(verbs)}
        slot, drive = (driven[name].slot, driven[name].drive) if name in driven else (None, "")
        yield {"name": name, "module_slot": slot, "drive": drive, **own}


def _concerns(verb: WorkVerb, surface: SurfaceData | None) -> bool:
    """Return whether a verb can do something to a plant with this roll or roller, or without one."""
    return verb.of is None or (surface is not None and isinstance(surface.surface, verb.of))


def _signals(names: RackNames, owner: str) -> list[Facts]:
    return [{"name": f"{owner}/{signal}", "unit": ALL_UNITS.get(signal, "")} for signal in names.signals_of(owner)]


def _controls(verbs: Mapping[str, WorkVerb]) -> list[Facts]:
    return [{"control": control, "values": _choices(verb), "text": verb.wants} for control, verb in verbs.items()]


def _choices(verb: WorkVerb) -> list[str]:
    """Return the words that a verb takes, one for each meaning: an empty one if it takes none; none for numbers."""
    if verb.is_alone:
        return [""]
    found: dict[object, str] = {}
    for word in () if verb.keys or _meaning(verb, "0.5") is not None else _WORDS:
        if (meaning := _meaning(verb, word)) is not None:
            found.setdefault(meaning, word)
    return list(found.values())


def _meaning(verb: WorkVerb, word: str) -> object:
    try:
        return verb.read(word)
    except ValueError:
        return None
