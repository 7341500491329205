"""Executes the entries of a stimuli file at their times."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence

from automax_ros.rack.base.stop_cause import OperationRefused
from automax_ros.runtime.time.scheduler import EventClass, EventKey, Scheduler
from automax_ros.scenario.stimuli.wave_player import ENTRIES, Action, OperationRecord, Stimulus, WavePlayer, in_time

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
