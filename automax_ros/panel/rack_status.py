"""How a rack stands, as the panel shows it: from what its operator answers, wherever it runs."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from functools import lru_cache
from typing import Any

from automax_ros.core.problems.pages import page_text, problems_called
from automax_ros.core.ticks import NS_PER_S
from automax_ros.panel.rack_facts import module_title
from automax_ros.panel.source import Facts
from automax_ros.rack.base.stop_cause import StopCause
from automax_ros.rack.operator.faults import meaning_of
from automax_ros.rack.operator.fronts import Fronts, Register
from automax_ros.rackfile.model.config import RackConfig
from automax_ros.rackfile.model.module import ModuleConfig


@dataclass(frozen=True)
class Answers:
    """What a rack answers its operator.

    ``status``, ``tasks`` and ``errors`` are fields of ReadStatus, TaskInfo and ReadErrors; ``words`` are the registers
    of ``Fronts``; ``times`` are mean and longest execution time of tasks (us), ``loads`` of modules by slot (%), as far
    as they are measured.
    """

    status: Facts
    words: Mapping[Register, int]
    tasks: Sequence[Facts] = ()
    errors: Sequence[Facts] = ()
    forced: Iterable[tuple[str, str]] = ()
    drives: Sequence[Facts] = ()
    webs: Sequence[Facts] = ()
    times: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    loads: Mapping[int, float] = field(default_factory=dict)


class RackStatus:
    """Makes the status of one rack; ``operators`` are those who may operate it, in words."""

    def __init__(self, config: RackConfig, operators: Sequence[str]) -> None:
        self._config, self._operators, self._fronts = config, list(operators), Fronts(config)
        self.registers = self._fronts.registers

    def facts(self, answers: Answers, over: str) -> dict[str, Any]:
        """Return all keys of the status; ``over`` is why the rack is not followed any more, or empty."""
        status = answers.status
        shown = zip(status["display_modules"], status["display_codes"], status["display_meanings"], strict=False)
        displays = {module: {"code": code, "meaning": meaning} for module, code, meaning in shown}
        return {
            "time_ns": round(status["time_s"] * NS_PER_S),
            "powered": status["powered"],
            "halted": status["halted"],
            "over": over,
            "stopped": _stop(answers) if status["stopped"] else None,
            "slots": [self._slot(module, answers, displays) for module in self._config.modules],
            "tasks": [_task(item, answers) for item in answers.tasks],
            "forced": [{"name": name, "value": value} for name, value in answers.forced],
            "drives": answers.drives,
            "webs": answers.webs,
            "operators": self._operators,
        }

    def _slot(self, module: ModuleConfig, answers: Answers, displays: Facts) -> Facts:
        powered, battery_good = answers.status["powered"], answers.status.get("battery_good", True)
        lamps = self._fronts.lamps(module, answers.words, powered=powered, battery_good=battery_good)
        return {
            "slot": module.slot,
            "model": module.model,
            "name": module.name,
            "title": module_title(module),
            "lamps": list(map(asdict, lamps)),
            "display": displays.get(module.name),
            "load_percent": answers.loads.get(module.slot),
            "late": sum(item["skipped"] for item in answers.tasks if item["slot"] == module.slot),
            "tasks": [task.name for task in module.tasks],
            "plant": " ".join(plant.name for plant in module.plants.values()),
        }


def _task(item: Facts, answers: Answers) -> Facts:
    mean_us, longest_us = answers.times.get(item["task"], (None, None))
    entries = [entry for entry in answers.errors if entry["task"] == item["task"]]
    return {
        "name": item["task"],
        **{key: item[key] for key in ("status", "scans", "skipped")},
        "mean_us": mean_us,
        "longest_us": longest_us,
        "errors": {"count": item["errors"], "entries": entries},
    }


def _stop(answers: Answers) -> Facts:
    status = answers.status
    task, code = status["stopped_task"], status["stopped_code"]
    cause = StopCause(round(status["stopped_at_s"] * NS_PER_S), status["stopped_reason"], code or None, task)
    last = [entry["code"] for entry in answers.errors if entry["task"] == task]
    explanation = _explanation(last[-1] if last else code)
    own = {"t": cause.time_ns, "code": code, "task": task, "title": cause.title, "reason": cause.reason}
    return {**own, "explain": explanation}


@lru_cache(maxsize=64)
def _explanation(code: str) -> str:
    """Return the pages of a problem's or of the hardware's code; what it means, if it has none."""
    found = problems_called(code) if code else []
    return "\n".join(map(page_text, found)) or (meaning_of(code) if code else "")


def web_facts(name: str, signals: Any) -> Facts:
    """Return a web from its signals (``WebState``, ``WebSignals``)."""
    return {"name": name, **{key: getattr(signals, key) for key in ("tension_n", "slack_m", "dancer_m", "broken")}}


def drive_facts(plant: str, slot: int, signals: Any, roll: Any = None, **more: object) -> dict[str, Any]:
    """Return a drive from the signals of its plant (``PlantState``, ``PlantSignals``) and what ``more`` is known.

    ``roll`` are those of its roll or roller (``RollState``, ``EndSignals``), None without one.
    """
    return {
        "plant": plant,
        "slot": slot,
        "speed_rpm": signals.speed_rpm,
        "armature_a": signals.current_a,
        "armature_v": signals.voltage_v,
        "delta_deg": None,
        "bridge": ("", "forward", "reverse")[signals.bridge],
        "conducting": (),
        "gates": (),
        "contactors": [{"name": "M", "on": signals.contactor}],
        "faults": (),
        "broken": signals.faults,
        "load_torque_nm": signals.load_nm,
        "state": "",
        "roll": None if roll is None else {key: getattr(roll, key) for key in ("diameter_m", "web_mps")},
        **more,
    }
