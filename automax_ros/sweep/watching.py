"""Watches what is measured during a run: commons by each change in the write log, signals at the rack's samples."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from automax_ros.core.types import Value
from automax_ros.rack.base.observers import Operation
from automax_ros.rack.rack import Rack
from automax_ros.runtime.memory.views import WriteGroup
from automax_ros.runtime.scan.scan_record import ScanRecord
from automax_ros.runtime.tasks.task import Task
from automax_ros.sweep.functions import Accumulator
from automax_ros.sweep.measures import Measure


@dataclass
class _Window:
    """A measure in progress; ``last`` is the latest value within its window, before that the one before it."""

    accumulator: Accumulator
    start_ns: int
    end_ns: int
    last: float
    has_begun: bool = False

    def hold(self, value: float, begin_ns: int, end_ns: int) -> None:
        begin, end = max(begin_ns, self.start_ns), min(end_ns, self.end_ns)
        if begin_ns < self.start_ns:
            self.last = value
        if begin < end:
            if not self.has_begun:
                self.has_begun = True
                self.accumulator.begin(self.last)
            self.last = value
            self.accumulator.hold(value, begin - self.start_ns, end - self.start_ns)

    def result(self) -> float | None:
        return self.accumulator.result(self.last, self.end_ns - self.start_ns)


@dataclass
class _Signal:
    """A common, an element or a signal with the windows on it; ``value`` holds since ``since_ns``."""

    value: float
    since_ns: int
    windows: list[_Window] = field(default_factory=list)

    def change(self, time_ns: int, value: Value) -> None:
        assert not isinstance(value, str)
        if value != self.value:
            self.flush(time_ns)
            self.value = value

    def flush(self, time_ns: int) -> None:
        if time_ns > self.since_ns:
            for window in self.windows:
                window.hold(self.value, self.since_ns, time_ns)
            self.since_ns = time_ns


class Watch:
    """Computes measures of a running rack, as an observer that needs no records of scans."""

    def __init__(self, rack: Rack, measures: Sequence[Measure], end_ns: int) -> None:
        """Watch a rack that was just started, until ``end_ns``: presets are the values before."""
        self._signals: dict[int, dict[int, _Signal]] = {}
        """By element, then by view: most writes are of simple commons that are not watched."""
        self._windows: dict[Measure, _Window] = {}
        self._sampled: dict[str, tuple[Callable[[], float], _Signal]] = {}
        for measure in measures:
            if measure.is_watched:
                self._add(rack, measure, end_ns)
        rack.observers.add(self)
        if self._sampled:
            rack.sampling.observe(self._sample)

    def results(self, end_ns: int) -> dict[Measure, float | None]:
        """Return the results of the measures of commons and signals."""
        for signals in self._signals.values():
            for signal in signals.values():
                signal.flush(end_ns)
        for _, signal in self._sampled.values():
            signal.flush(end_ns)
        return {measure: window.result() for measure, window in self._windows.items()}

    def written(self, writes: list[WriteGroup]) -> None:
        """Process writes, including those of scans if no records are kept."""
        elements = self._signals
        for group in writes:
            signals = elements.get(group.element)
            if signals is None:
                continue
            for view, value in group.changes:
                if view in signals:
                    signals[view].change(group.time_ns, value)

    def scanned(self, task: Task, record: ScanRecord, writes: list[WriteGroup]) -> None:  # noqa: ARG002
        """Process the writes of a scan."""
        self.written(writes)

    def tuned(self, task: Task, now_ns: int) -> None:
        """Ignore tunables."""

    def operated(self, operation: Operation) -> None:
        """Ignore operations."""

    def _sample(self, now_ns: int) -> None:
        for read, signal in self._sampled.values():
            signal.change(now_ns, read())

    def _add(self, rack: Rack, measure: Measure, end_ns: int) -> None:
        signal = self._sampled_signal(rack, measure.subject) if "/" in measure.subject else self._common(rack, measure)
        end = end_ns if measure.end_ns is None else measure.end_ns
        window = _Window(measure.accumulator(), measure.start_ns, end, signal.value)
        signal.windows.append(window)
        self._windows[measure] = window

    def _common(self, rack: Rack, measure: Measure) -> _Signal:
        meant = rack.config.common(measure.subject)
        view = rack.memory.view(meant.name)
        present = rack.memory.read_now(view, meant.index)
        assert not isinstance(present, str)
        return self._signals.setdefault(meant.index, {}).setdefault(view, _Signal(present, rack.now_ns))

    def _sampled_signal(self, rack: Rack, subject: str) -> _Signal:
        """Return a signal of a plant or web, which holds from sample to sample (decision)."""
        if subject not in self._sampled:
            owner, _, name = subject.partition("/")
            read = rack.plants.reader(owner, name)
            self._sampled[subject] = read, _Signal(read(), rack.now_ns)
        return self._sampled[subject][1]
