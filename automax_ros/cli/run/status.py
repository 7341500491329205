"""The display of a running rack: a live line on a terminal, plain lines elsewhere, a summary at the end."""

from __future__ import annotations

import time
from collections import Counter, deque
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from automax_ros.cli.output.screen import StatusLine
from automax_ros.core.text import count_of, printable
from automax_ros.core.ticks import NS_PER_S, seconds_text
from automax_ros.core.types import Value
from automax_ros.core.values import value_text
from automax_ros.rack.modules.drive import DriveControllerModule
from automax_ros.rack.modules.module import Module
from automax_ros.rack.operator.web_news import WebNews
from automax_ros.rack.rack import Rack
from automax_ros.rackfile.model.config import CommonElement
from automax_ros.runtime.health import Health


@dataclass(frozen=True)
class Progress:
    """The progress of a run.

    ``standing`` is what keeps the tasks from running, such as ``power off``; ``scans_per_s`` counts since the last
    progress. ``loads`` of the Processors are in words. ``pace`` is how many times faster than real time the run is,
    None on the wall clock. ``trouble`` counts what went wrong by its kind; ``values`` are the watched variables.
    """

    now_ns: int
    standing: tuple[str, ...] = ()
    scans_per_s: float = 0.0
    loads: tuple[str, ...] = ()
    pace: float | None = None
    trouble: Mapping[str, int] = field(default_factory=dict)
    values: tuple[str, ...] = ()

    @property
    def parts(self) -> list[str]:
        """The parts of the status line."""
        pace = [] if self.pace is None else [f"{self.pace:.0f}x"]
        trouble = [count_of(number, kind) for kind, number in self.trouble.items() if number]
        head = [f"{self.now_ns / NS_PER_S:8.1f} s", *self.standing, f"{self.scans_per_s:.0f} scans/s"]
        return [*head, *self.loads, *pace, *trouble, *self.values]


def merged_progress(parts: Sequence[Progress]) -> Progress:
    """Return the progress of a distributed rack from that of its processes, that of common memory first."""
    trouble: Counter[str] = Counter()
    for part in parts:
        trouble.update(part.trouble)
    return Progress(
        now_ns=parts[0].now_ns,
        standing=tuple(dict.fromkeys(word for part in parts for word in part.standing)),
        scans_per_s=sum(part.scans_per_s for part in parts),
        loads=tuple(load for part in parts for load in part.loads),
        trouble=dict(trouble),
        values=parts[0].values,
    )


@dataclass(frozen=True)
class Summary:
    """The summary of a run.

    ``seconds`` is rack time; ``live``: execution times were measured. ``rows`` are those of the table of tasks,
    ``notes`` follow it, ``values`` are the watched variables. ``took_s`` is None for a run on the wall clock.
    """

    seconds: float
    live: bool
    rows: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    values: tuple[str, ...] = ()
    took_s: float | None = None

    @property
    def lines(self) -> list[str]:
        """The summary as lines of text."""
        took = self.took_s
        pace = "" if took is None else f" in {took:.2f} s ({self.seconds / took if took else 0:.0f} times real time)"
        head = f"  {'task':10}{'slot':>4}{'period ms':>11}{'scans':>10}{'late':>7}{'errors':>8}"
        head += f"{'mean us':>10}{'longest us':>12}" if self.live else ""
        values = ["  " + "  ".join(self.values)] if self.values else []
        return [f"ran {self.seconds:.3f} s{pace}", head, *self.rows, *self.notes, *values]


def merged_summary(parts: Sequence[Summary]) -> Summary:
    """Return the summary of a distributed rack from those of its processes, that of common memory first."""
    rows = tuple(row for part in parts for row in part.rows)
    return Summary(parts[0].seconds, True, rows, tuple(note for part in parts for note in part.notes), parts[0].values)


NO_SCAN = "  it holds no scan: nothing of it can be replayed; do the tasks run?"
"""The line about a recording without a scan."""


def recorded_size(folder: Path) -> str:
    """Return the size of a recording's folder in MB; its disk may have disappeared while the rack ran."""
    try:
        return f"{sum(item.stat().st_size for item in folder.iterdir()) / 1e6:.2f} MB"
    except OSError:
        return "cannot be read any more"


class TerminalOutput(StatusLine):
    """Shows a run on standard output."""

    def progress(self, progress: Progress) -> None:
        """Show the progress; on a terminal it replaces the last one."""
        self.show(progress.parts)

    def summary(self, summary: Summary) -> None:
        """Print the summary in place of the status line."""
        self.clear()
        print("\n".join(summary.lines), flush=True)


class StatusDisplay:
    """Shows a rack's progress on an output; ``live``: on the wall clock, so that loads can be measured.

    ``health`` counts what goes wrong in a rack on the wall clock; each kind is shown on a line when it first happens.
    A web that parts is shown on a line too.
    """

    def __init__(
        self,
        rack: Rack,
        watch: Sequence[CommonElement],
        *,
        live: bool,
        health: Health | None = None,
        screen: TerminalOutput | None = None,
    ) -> None:
        """Create the display; nothing is shown before the first update is due. ``screen`` None is standard output."""
        self._rack, self._watch, self._live, self._health = rack, watch, live, health
        self._screen = TerminalOutput() if screen is None else screen
        self.message = self._screen.message
        self._last_rack_ns = 0
        self._last_scans = 0
        self._last_busy: dict[int, int] = {}
        self._of_webs: deque[str] = deque()
        WebNews(rack, lambda at_ns, text: self._of_webs.append(f"{text} at {seconds_text(at_ns)} s"))

    def update(self, now_ns: int) -> None:
        """Show news, and the progress at a rack time if it is due."""
        self._show_news()
        passed = self._screen.due()
        if passed:
            self._screen.progress(self._progress(now_ns, passed))

    def printed(self) -> None:
        """Show the output of PRINT statements since the last call."""
        for task in self._rack.tasks:
            while task.printed:
                self.message(f"{task.name}: {printable(task.printed.popleft())}")

    def finish(self) -> None:
        """Show the last news and the summary."""
        self._show_news()
        took = None if self._live else (time.monotonic_ns() - self._screen.began_ns) / NS_PER_S
        rack = self._rack
        self._screen.summary(
            Summary(rack.now_ns / NS_PER_S, self._live, tuple(self._rows()), tuple(self._notes()), self._values(), took)
        )

    def _rows(self) -> Iterator[str]:
        for task in self._rack.tasks:
            statistics = self._rack.statistics[task.name]
            period = f"{task.period_ns / 1e6:g}" if task.period_ns else "-"
            row = f"  {task.name:10}{task.slot:>4}{period:>11}{statistics.scans:>10}"
            row += f"{statistics.skipped:>7}{task.errors.count:>8}"
            mean = statistics.total_ns / statistics.scans / 1000 if statistics.scans else 0.0
            yield row + (f"{mean:>10.1f}{statistics.longest_ns / 1000:>12.1f}" if self._live else "")

    def _notes(self) -> Iterator[str]:
        for module in self._rack.modules if self._live else ():
            if isinstance(module, DriveControllerModule) and module.timing.interrupts:
                yield f"  {module.config.name}: {module.timing.describe()}"
        for task in self._rack.tasks:
            for entry in task.errors.entries:
                yield f"  {task.name}: {entry.describe()}"

    def _show_news(self) -> None:
        for text in self._health.news() if self._health else ():
            self.message(printable(text))
        while self._of_webs:
            self.message(self._of_webs.popleft())

    def _progress(self, now_ns: int, passed_ns: int) -> Progress:
        scans = sum(item.scans for item in self._rack.statistics.values())
        rack_ns = now_ns - self._last_rack_ns
        rate = (scans - self._last_scans) * NS_PER_S / rack_ns if rack_ns else 0.0
        self._last_rack_ns, self._last_scans = now_ns, scans
        loads = [self._load(module, passed_ns) for module in self._rack.task_modules] if self._live else []
        pace = None if self._live else rack_ns / passed_ns
        return Progress(now_ns, self._standing(), rate, tuple(loads), pace, self._trouble(), self._values())

    def _standing(self) -> tuple[str, ...]:
        """Return what keeps the tasks from running: no power, or what stopped them all."""
        operations = self._rack.operations
        if not operations.powered:
            return ("power off",)
        return () if operations.stopped is None else (operations.stopped.title,)

    def _load(self, module: Module, passed_ns: int) -> str:
        slot = module.config.slot
        busy = sum(item.statistics.total_ns for item in module.tasks)
        share = (busy - self._last_busy.get(slot, 0)) / passed_ns
        self._last_busy[slot] = busy
        late = sum(item.statistics.skipped for item in module.tasks)
        return f"P{slot} {100 * share:.1f} % late {late}"

    def _trouble(self) -> dict[str, int]:
        errors = {"run-time error": sum(task.errors.count for task in self._rack.tasks)}
        return dict(self._health.counts) if self._health else errors

    def _values(self) -> tuple[str, ...]:
        return tuple(
            f"{item.label}={_shown_value(item, self._rack.value(item.name, item.index))}" for item in self._watch
        )


def _shown_value(item: CommonElement, value: Value) -> str:
    """Return a value as the rack file declares it: scaled, with its unit; the unit `counts` is not shown."""
    variable = item.variable
    text = value_text(value)
    if variable.scale is not None and isinstance(value, int):
        text = f"{variable.scale.value_of(value):.6g}"
    unit = "" if variable.unit.strip() == "counts" else variable.unit
    return printable(f"{text} {unit}".rstrip())
