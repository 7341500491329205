"""How the tasks of a recording run, from the rack file and the sources that are stored inside."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from automax_ros.bags.info import BagInfo
from automax_ros.core.diagnostics import SourceText
from automax_ros.rack.loader import load_stored
from automax_ros.rack.tasks_check import check_source, commons_of
from automax_ros.wire.rack_files import source_name

RACK_FILE = "rack.yaml"


@dataclass(frozen=True)
class TaskFacts:
    """A task as the rack file and its source have it; None where the source is missing or has errors.

    ``ticks`` is None too for a task without TICKS, ``period_ns`` for one without a scan period.
    """

    slot: int
    processor: str
    tick_ns: int
    priority: int
    target: str | None = None
    ticks: int | None = None
    period_ns: int | None = None


def task_facts(info: BagInfo) -> dict[str, TaskFacts]:
    """Return the tasks of the rack by name; none where the recording stores no rack file without errors."""
    text = info.texts.get(RACK_FILE)
    config = load_stored(SourceText(RACK_FILE, text), Path(RACK_FILE)).config if text is not None else None
    if config is None:
        return {}
    commons = commons_of(config)
    facts = {}
    for processor in config.task_modules:
        for task in processor.tasks:
            name = source_name(task.name, task.file.name)
            source = info.texts.get(name)
            program = None
            if source:
                text_of = SourceText(name, source)
                program = check_source(text_of, task.name, processor.tick_ns, commons, processor.times).program
            facts[task.name] = TaskFacts(
                processor.slot,
                processor.model,
                processor.tick_ns,
                task.priority,
                program.target if program else None,
                (program.ticks or None) if program else None,
                (program.period_ns or None) if program else None,
            )
    return facts
