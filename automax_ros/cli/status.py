"""What a person sees of a running rack: a live line on a terminal, plain lines elsewhere, a summary at the end."""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from pathlib import Path

from automax_ros.cli.status_line import StatusLine
from automax_ros.core.text import count_of, printable
from automax_ros.core.ticks import NS_PER_S
from automax_ros.core.values import value_text
from automax_ros.rack.modules.drive_interrupts import Timed
from automax_ros.rack.modules.kind import Module
from automax_ros.rack.rack import Rack
from automax_ros.rack.settings import CommonElement
from automax_ros.running.health import Health


class StatusDisplay:
    """Shows a rack's progress on standard output; ``live``: on the wall clock, so loads can be measured.

    ``health`` is what a rack on the wall clock has trouble with; each thing is a line when it first happens.
    """

    def __init__(self, rack: Rack, watch: Sequence[CommonElement], *, live: bool, health: Health | None = None) -> None:
        """Begin; nothing is printed before the first update is due."""
        self._rack, self._watch, self._live, self._health = rack, watch, live, health
        self._line = StatusLine()
        self._last_rack_ns = 0
        self._last_scans = 0
        self._last_busy: dict[int, int] = {}

    def update(self, now_ns: int) -> None:
        """Show news, and the state at a rack time if it is time to."""
        self._tell_news()
        passed = self._line.due()
        if passed:
            self._show(now_ns, passed)

    def message(self, text: str) -> None:
        """Print a line of its own."""
        self._line.message(text)

    def printed(self) -> None:
        """Show what PRINT statements have written since the last call."""
        for task in self._rack.tasks:
            while task.printed:
                self.message(f"{task.name}: {printable(task.printed.popleft())}")

    def finish(self, bag: Path | None, *, complete: bool = True) -> None:
        """Print the last state and the summary; ``complete`` says whether all of the run is in the recording."""
        self._tell_news()
        self._line.clear()
        rack = self._rack
        seconds, took = rack.now_ns / NS_PER_S, (time.monotonic_ns() - self._line.began_ns) / NS_PER_S
        pace = "" if self._live else f" in {took:.2f} s ({seconds / took if took else 0:.0f} times real time)"
        print(f"ran {seconds:.3f} s{pace}")
        print(f"  {'task':10}{'slot':>4}{'period ms':>11}{'scans':>10}{'late':>7}{'errors':>8}", end="")
        print(f"{'mean us':>10}{'longest us':>12}" if self._live else "")
        for task in rack.tasks:
            statistics = rack.statistics[task.name]
            period = f"{task.period_ns / 1e6:g}" if task.period_ns else "-"
            print(
                f"  {task.name:10}{task.slot:>4}{period:>11}{statistics.scans:>10}"
                f"{statistics.skipped:>7}{task.errors.count:>8}",
                end="",
            )
            mean = statistics.total_ns / statistics.scans / 1000 if statistics.scans else 0.0
            print(f"{mean:>10.1f}{statistics.longest_ns / 1000:>12.1f}" if self._live else "")
        for module in rack.modules if self._live else ():
            if isinstance(module, Timed) and module.timing.interrupts:
                print(f"  {module.config.name}: {module.timing.describe()}")
        for task in rack.tasks:
            for entry in task.errors.entries:
                print(f"  {task.name}: {entry.describe()}")
        if self._watch:
            print("  " + "  ".join(self._values()))
        if bag is not None:
            size = sum(item.stat().st_size for item in bag.iterdir())
            rest = "" if complete else f", not to the end of the run; to complete the file: automax bag repair {bag}"
            print(f"recorded {bag}: {size / 1e6:.2f} MB{rest}")
        sys.stdout.flush()

    def _tell_news(self) -> None:
        for text in self._health.news() if self._health else ():
            self.message(printable(text))

    def _show(self, now_ns: int, passed_ns: int) -> None:
        scans = sum(item.scans for item in self._rack.statistics.values())
        elapsed = (now_ns - self._last_rack_ns) / NS_PER_S
        rate = (scans - self._last_scans) / elapsed if elapsed else 0.0
        parts = [f"{now_ns / NS_PER_S:8.1f} s", *self._standing(), f"{rate:.0f} scans/s"]
        if self._live:
            parts += [self._load(module, passed_ns) for module in self._rack.task_modules]
        else:
            parts.append(f"{(now_ns - self._last_rack_ns) / passed_ns:.0f}x")
        parts += self._trouble()
        parts += self._values()
        self._last_rack_ns, self._last_scans = now_ns, scans
        self._line.show(parts)

    def _standing(self) -> list[str]:
        """Return what stands in the way of the tasks: no power, or what stopped them all."""
        operations = self._rack.operations
        if not operations.powered:
            return ["power off"]
        return [] if operations.stopped is None else [operations.stopped.title]

    def _load(self, module: Module, passed_ns: int) -> str:
        """Return a Processor's share of the time since the last line, and the deadlines it has missed."""
        slot = module.config.slot
        busy = sum(item.statistics.total_ns for item in module.tasks)
        share = (busy - self._last_busy.get(slot, 0)) / passed_ns
        self._last_busy[slot] = busy
        late = sum(item.statistics.skipped for item in module.tasks)
        return f"P{slot} {100 * share:.1f} % late {late}"

    def _trouble(self) -> list[str]:
        """Return the counts of what went wrong."""
        errors = {"run-time error": sum(task.errors.count for task in self._rack.tasks)}
        counts = self._health.counts if self._health else errors
        return [count_of(number, kind) for kind, number in counts.items() if number]

    def _values(self) -> list[str]:
        values = [value_text(self._rack.value(item.name, item.index)) for item in self._watch]
        return [f"{item.label}={printable(value)}" for item, value in zip(self._watch, values, strict=True)]
