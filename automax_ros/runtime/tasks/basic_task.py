"""A BASIC task: it runs from one suspension to the next, a burst, and each burst counts as a scan.

Reads and writes access actual memory at once. What a burst receives from channels and sends is among the reads of its
record (``CHANNEL_VIEWS``), so that the burst can be executed again.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import cast

from automax_ros.compile.base.scan_io import Suspension, Wish
from automax_ros.compile.compiler import CompiledTask, ScanSteps
from automax_ros.core.types import DataType
from automax_ros.language.program import OpenedFile
from automax_ros.runtime.scan.channels import CHANNEL_VIEWS, Message
from automax_ros.runtime.scan.task_io import OutcomeOf, RecordingIo, ScanMemory, TaskIo, at_once
from automax_ros.runtime.tasks.task import ScanRecord, Status, Task

BURSTS_AT_ONCE = 100
"""Most bursts of one task at one instant; then it continues at the next tick (decision: so tasks that wake each other
cannot stop time)."""
_TIMED = (Suspension.END, Suspension.DELAY, Suspension.BUSY)
_READY, _GOING = -1, -2
"""A task that continues at a known instant, and one that a Processor is executing."""


class BasicIo(TaskIo):
    """Access of a burst to memory and channels."""

    def __init__(self, task: BasicTask, memory: ScanMemory, outcome_of: OutcomeOf = at_once) -> None:
        super().__init__(task, memory, outcome_of)
        self._basic = task
        self._channels = task.channels

    def start_every(self, period_ns: int) -> None:
        """Restart the task each period from now on (START EVERY)."""
        self._outcome_of(lambda: self._basic.start_every(period_ns, self._memory.now_ns))

    def open_reader(self, number: int, types: str, depth: int) -> int:
        """Make the task the reader of a channel; return the problem or 0."""
        name, open_reader, memory = self._basic.name, self._channels.open_reader, self._memory
        return self._note(number, self._outcome_of(lambda: open_reader(number, types, depth, name, memory.now_ns)))

    def open_writer(self, number: int, types: str) -> int:
        """Find a channel; return 0, the problem, or MUST_WAIT while no task reads it."""
        return self._note(number, self._outcome_of(lambda: self._channels.open_writer(number, types)))

    def receive(self, number: int) -> tuple[Message, int]:
        """Receive the oldest message of a channel; return it and 0, or nothing and the problem or MUST_WAIT."""
        types, name, memory = self._basic.types(number), self._basic.name, self._memory
        message, outcome = self._outcome_of(lambda: self._channels.receive(number, types, name, memory.now_ns))
        return message, self._note(number, outcome, message)

    def send(self, number: int, message: Message) -> int:
        """Send a message to a channel; return 0, the problem, or MUST_WAIT if it is full."""
        types, memory = self._basic.types(number), self._memory
        outcome = self._outcome_of(lambda: self._channels.send(number, types, message, memory.now_ns))
        return self._note(number, outcome, () if outcome else message)

    def _note(self, number: int, outcome: int, items: Message = ()) -> int:  # noqa: ARG002
        return outcome


class RecordingBasicIo(BasicIo, RecordingIo):
    """The same, with everything noted, the outcomes of channels and the items among the reads."""

    def _note(self, number: int, outcome: int, items: Message = ()) -> int:
        reads = self.record.reads
        reads.append((CHANNEL_VIEWS[DataType.INTEGER], number, outcome))
        if items:
            kinds = self._basic.file(number).types
            reads.extend((CHANNEL_VIEWS[kind], number, item) for kind, item in zip(kinds, items, strict=False))
        return outcome


class BasicTask(Task):
    """A ``Task`` whose scans are bursts.

    ``wish`` is what it waits for since the last burst; a timed wait ends at ``wake_ns``, one for an event began there.
    ``suspended`` is called then. ``every`` is period, start and number of the last instant of its START EVERY.
    """

    wish: Wish
    every: tuple[int, int, int] | None

    def install(self, compiled: CompiledTask) -> None:
        """Install this or another program, as at the beginning."""
        self.suspended: Callable[[], None] = _nothing
        self._files = {item.number: item for item in compiled.program.files}
        self._types = {
            number: "".join(kind.value or "." for kind in item.types) for number, item in self._files.items()
        }
        self._fresh()
        super().install(compiled)
        _ = self.compiled.burst  # compiled here: the first burst of a live rack would be late

    def file(self, number: int) -> OpenedFile:
        """Return the file with a number after #."""
        return self._files[number]

    def types(self, number: int) -> str:
        """Return the types of a channel's items, as this task declares them."""
        return self._types[number]

    @property
    def is_done(self) -> bool:
        """Whether it has reached its END, and does not start again."""
        return self.status is Status.ENDED and self.wish[0] == Suspension.END

    @property
    def ready(self) -> bool:
        """Whether it continues at a known instant: it waits for nothing."""
        return self.wish[0] == _READY

    @property
    def timed(self) -> bool:
        """Whether it waits for ``wake_ns`` alone."""
        return self.wish[0] in _TIMED

    def make_ready(self) -> None:
        """End its wait."""
        self.wish = (_READY, 0)

    def go(self) -> None:
        """Note that a burst is handed to the Processor."""
        self.wish = (_GOING, 0)

    def not_before(self, now_ns: int) -> int:
        """Return when a burst that is due now may begin: at the next tick after too many at one instant."""
        if now_ns == self._instant and self._bursts >= BURSTS_AT_ONCE:
            return self._next_tick(now_ns)
        return now_ns

    def run(self, now_ns: int = 0) -> ScanRecord | None:
        """Put the task into RUN, at its first statement (J2-3106-1 p. 12-4); return scan 0, empty, if recorded."""
        self.heed_forces()
        self.compiled.layout.restart(self.state)
        self.status, self.scan_number = Status.RUNNING, 0
        self._fresh()
        self.memory.now_ns = now_ns
        return self._begin_record(now_ns, 0, self._io)

    def scan(self, now_ns: int, skipped: int = 0) -> ScanRecord | None:
        """Execute one burst at an instant. Returns its record, if kept."""
        if self.status is not Status.RUNNING:
            return None
        self.scan_number += 1
        self._begins(now_ns)
        record = self._begin_record(now_ns, skipped, self._io) if self._recording else None
        self._over(self.compiled.burst(self.state, cast(BasicIo, self._io)), now_ns)
        return record

    def start_every(self, period_ns: int, now_ns: int) -> None:
        """Restart it each period from now on (START EVERY)."""
        self.every = (period_ns, now_ns, 0)

    def pass_over(self, now_ns: int) -> None:
        """Skip the instants of START EVERY up to the present: a burst that is due begins there instead."""
        if self.wish[0] == Suspension.END and self.every is not None:
            period, begin, last = self.every
            self.every = period, begin, max(last, (now_ns - begin) // period)

    def waiting(self) -> list[int]:
        """Return, as numbers, its wait and its START EVERY."""
        return [*self.wish, self.wake_ns, *(self.every or (0, 0, 0)), self._instant, self._bursts]

    def wait_again(self, numbers: Sequence[int]) -> None:
        """Restore what ``waiting`` returned; ValueError if a BASIC task cannot wait for that."""
        if len(numbers) != len(self.waiting()) or not all(isinstance(number, int) for number in numbers):
            raise ValueError(f"task {self.name} cannot wait for {list(numbers)[:9]!r}")
        kind, argument, self.wake_ns, period, begin, count, self._instant, self._bursts = numbers
        events = len(self.compiled.program.events)
        if kind not in (_READY, _GOING, *Suspension) or (kind == Suspension.EVENT and not 0 <= argument < events):
            raise ValueError(f"task {self.name} cannot wait for {kind} {argument}")
        self.wish, self.every = (kind, argument), (period, begin, count) if period else None

    def _fresh(self) -> None:
        self.wish = (_READY, 0)
        self.wake_ns = 0
        self.every = None
        self._instant, self._bursts = -1, 0

    def _begins(self, now_ns: int) -> None:
        super()._begins(now_ns)
        self._bursts = self._bursts + 1 if now_ns == self._instant else 1
        self._instant = now_ns

    def _form_in_steps(self) -> ScanSteps:
        return cast(ScanSteps, self.compiled.burst_steps)

    def _over(self, outcome: Wish, began_ns: int) -> None:
        self.wish, (kind, number), now_ns = outcome, outcome, self.memory.now_ns
        if kind == Suspension.STOP or outcome == (Suspension.END, 0):
            self.status = Status.ENDED
        elif kind == Suspension.END:
            self.wake_ns = self._next_start(now_ns)
        elif kind == Suspension.DELAY:
            self.wake_ns = now_ns + number
        elif kind == Suspension.EVENT:
            self.wake_ns = now_ns
        elif kind == Suspension.BUSY:
            self.wake_ns = now_ns if now_ns > began_ns else self._next_tick(now_ns)
        self.suspended()

    def _next_start(self, now_ns: int) -> int:
        """Return the next instant of START EVERY; instants that passed during a longer run are skipped (decision)."""
        if self.every is None:
            return now_ns  # a burst in a replay has no clock
        period, begin, last = self.every
        number = max(last + 1, -((begin - now_ns) // period))
        self.every = period, begin, number
        return begin + number * period

    def _next_tick(self, now_ns: int) -> int:
        tick = self.compiled.program.tick_ns
        return (now_ns // tick + 1) * tick

    def _make_io(self, memory: ScanMemory, outcome_of: OutcomeOf) -> TaskIo:
        return RecordingBasicIo(self, memory, outcome_of) if self._recording else BasicIo(self, memory, outcome_of)


def awaits(task: Task, event: str) -> bool:
    """Return whether a task in RUN waits for an event: SCAN_LOOP names it (4.0), or a BASIC task waits on it now."""
    if not isinstance(task, BasicTask):
        return task.compiled.program.event == event
    kind, number = task.wish
    return kind == Suspension.EVENT and task.compiled.program.events[number].name == event


def _nothing() -> None:
    """Do nothing."""
