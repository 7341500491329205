"""Executes the entries of a stimuli file at their times, and plays the waves that drive signals."""

from __future__ import annotations

from bisect import bisect_right
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

from automax_ros.core.types import Value
from automax_ros.rack.base.stop_cause import OperationRefused
from automax_ros.runtime.time.scheduler import EventClass, EventKey, ScheduledEvent, Scheduler
from automax_ros.scenario.stimuli.signals import Signal
from automax_ros.scenario.stimuli.waves import SAMPLE_NS, Wave


class Action(Protocol):
    """One action of an entry. ``of`` is its variable, task or slot; "" for the whole rack."""

    @property
    def of(self) -> str: ...  # noqa: D102

    def do(self, stage: WavePlayer, /) -> None:
        """Execute it, at the scheduler's present time.

        Raises:
            OperationRefused: it is not possible now; the text says why.
        """
        ...


@dataclass(frozen=True)
class Stimulus:
    """An entry of a stimuli file: at a rack time, a verb with its actions. ``line`` is its line in the file.

    ``is_value`` is TRUE for verbs that only write values, as the process does; the others operate the rack.
    ``everywhere`` is TRUE if it writes the same in every process of a distributed rack.
    """

    at_ns: int
    verb: str
    line: int
    actions: tuple[Action, ...]
    is_value: bool
    everywhere: bool = False


@dataclass(frozen=True)
class Operate:
    """One operation on the task, variable, module, plant or web ``of``, "" for the whole rack."""

    of: str
    operation: Callable[[], object]

    def do(self, _: WavePlayer, /) -> None:
        """Execute it."""
        self.operation()


class WavePlayer:
    """Plays waves on signals by rack time: at most one on each, the latest.

    ``is_sampling`` is TRUE while a wave writes a value.
    """

    def __init__(self, scheduler: Scheduler) -> None:
        self.scheduler = scheduler
        self.is_sampling = False
        self._driven: dict[str, list[ScheduledEvent]] = {}
        self._count = 0

    @property
    def is_driving(self) -> bool:
        """Whether a wave still runs."""
        return bool(self._driven)

    def set(self, signal: Signal, value: Value) -> None:
        """Write a value; a wave that drove the signal ends.

        Raises:
            OperationRefused: it cannot be written now.
        """
        self.rest(signal)
        signal.set(value)

    def drive(self, signal: Signal, wave: Wave) -> None:
        """Drive a signal with a wave from now on, in place of an earlier wave.

        A sample is written if it differs from the present value, so a write by a task does not last.
        """
        self.rest(signal)
        scheduler = self.scheduler
        began, start = scheduler.now_ns, signal.read()
        self._sample(signal, wave.value(0, start))
        if wave.for_ns == 0:
            return
        self._count += 1  # waves that started earlier come first
        key = EventKey(EventClass.OUTSIDE, _BEGUN, f"{self._count:09d}")

        def end(_: int) -> None:
            self.rest(signal)
            last = wave.last()
            if last is not None:
                self._sample(signal, last)

        def sample(now_ns: int, _: int) -> None:
            self._sample(signal, wave.value(now_ns - began, start))

        events = [] if wave.for_ns is None else [scheduler.at(began + wave.for_ns, key, end)]
        events.append(scheduler.every(SAMPLE_NS, began + SAMPLE_NS, key, sample))
        self._driven[signal.label] = events

    def follow(self, signal: Signal, times_ns: Sequence[int], values: Sequence[Value]) -> None:
        """Write each value at its time, counted from now on and ascending; it holds until the next one.

        A value is written once: what a task writes meanwhile stays until the next one's time.
        """
        self.rest(signal)
        began = self.scheduler.now_ns
        self._count += 1
        key = EventKey(EventClass.OUTSIDE, _BEGUN, f"{self._count:09d}")
        events: list[ScheduledEvent] = []

        def write_from(place: int) -> None:
            now_ns = self.scheduler.now_ns
            last = bisect_right(times_ns, now_ns - began)
            if last > place:
                self._sample(signal, values[last - 1])
            if last == len(times_ns):
                self.rest(signal)
            else:
                events[:] = [self.scheduler.at(began + times_ns[last], key, lambda _: write_from(last))]

        self._driven[signal.label] = events
        write_from(0)

    def rest(self, signal: Signal) -> None:
        """End the wave that drives a signal, if any; the signal's value stays."""
        for event in self._driven.pop(signal.label, ()):
            event.cancel()

    def _sample(self, signal: Signal, value: Value) -> None:
        if signal.read() != value:
            self.is_sampling = True
            try:
                signal.write(value)
            finally:
                self.is_sampling = False


_BEGUN = 0
"""Priority, among outside events of one instant, of samples of waves that earlier entries started."""
ENTRIES = 1
"""Priority of entries: after what earlier entries began (decision), before all else."""


@dataclass(frozen=True)
class OperationRecord:
    """Result of an action: ``what`` is the verb, ``why`` the reason of a refusal, if ``ok`` is FALSE."""

    at_ns: int
    what: str
    of: str
    ok: bool = True
    why: str = ""


def in_time(stimuli: Sequence[Stimulus]) -> list[Stimulus]:
    """Return entries in the order of time; those of one instant keep the order of the file."""
    return sorted(stimuli, key=lambda item: item.at_ns)


_KEY = EventKey(EventClass.OUTSIDE, ENTRIES, "stimuli")


class StimuliPlayer:
    """Schedules one event at a time: that of the next instant with entries.

    ``happened`` are the operations so far, refused ones too, and values that were refused; ``refused`` counts those.
    ``is_acting`` is TRUE while an entry is executed, ``is_common`` while every process of a distributed rack writes the
    same.
    """

    def __init__(self, stimuli: Sequence[Stimulus], scheduler: Scheduler) -> None:
        """Create from entries in any order; nothing is scheduled yet."""
        self._waiting = deque(in_time(stimuli))
        self._stage = WavePlayer(scheduler)
        self.happened: list[OperationRecord] = []
        self.refused = 0
        self.is_acting = False
        self._everywhere = False
        self._reported = 0

    def begin(self, *, joining: bool = False) -> None:
        """Start; entries of now and of times that have passed are executed now, in their order.

        ``Rack.start`` calls it before it puts tasks into RUN. With ``joining`` the rack's other processes have executed
        them already, and know the results.
        """
        now_ns = self._stage.scheduler.now_ns
        while joining and self._waiting and self._waiting[0].at_ns <= now_ns:
            self._waiting.popleft()
        self._happen(now_ns)

    @property
    def is_common(self) -> bool:
        """See the class."""
        return self._everywhere or self._stage.is_sampling

    @property
    def is_over(self) -> bool:
        """Whether no entry and no sample is left."""
        return not self._waiting and not self._stage.is_driving

    def news(self) -> list[str]:
        """Return a line for each refusal since the last call."""
        first, self._reported = self._reported, len(self.happened)
        return [_line(item) for item in self.happened[first:] if not item.ok]

    def _post(self) -> None:
        if self._waiting:
            scheduler = self._stage.scheduler
            scheduler.at(max(self._waiting[0].at_ns, scheduler.now_ns), _KEY, self._happen)

    def _happen(self, now_ns: int) -> None:
        while self._waiting and self._waiting[0].at_ns <= now_ns:
            entry = self._waiting.popleft()
            for action in entry.actions:
                self._do(entry, action)
        self._post()

    def _do(self, entry: Stimulus, action: Action) -> None:
        now_ns, self.is_acting = self._stage.scheduler.now_ns, True
        self._everywhere = entry.everywhere
        try:
            action.do(self._stage)
        except OperationRefused as refused:
            self.refused += 1
            self.happened.append(OperationRecord(now_ns, entry.verb, action.of, ok=False, why=str(refused)))
        else:
            if not entry.is_value:
                self.happened.append(OperationRecord(now_ns, entry.verb, action.of))
        finally:
            self.is_acting = self._everywhere = False


def _line(item: OperationRecord) -> str:
    of = f" {item.of}" if item.of else ""
    return f"stimuli: {item.what}{of} was refused: {item.why}"
