"""The common clock of a backplane (CCLK): which modules drive it, and since when it runs.

A module drives it while the enable bit of one of its registers is set. Exactly one may (S-3056 p. 4-4): a second one is
the fault of code 38. Without it UDC tasks do not pass SCAN_LOOP, and modules do not interrupt. The clock of the UDCs
and that of the other modules are the same (decision: the manuals say so of neither).
"""

from __future__ import annotations

from collections.abc import Callable

from automax_ros.core.ticks import CLOCK_PERIOD_NS
from automax_ros.runtime.memory.memory import CommonMemory
from automax_ros.runtime.time.scheduler import EventClass, EventKey, Scheduler

ENABLE_BIT = 6
"""The bit that drives the clock, in a UDC's register 2000 as in the ISCR of I/O modules (decision): 57C411 p. 4-1."""
SECOND_DRIVER = "38"
"""The hardware's code where two modules drive the clock (S-3056 p. 4-4)."""

Fault = Callable[[str, str], None]
"""Stops all tasks, given the reason and the hardware's code."""


class CommonClock:
    """The clock of one rack. It changes at the instant of the write that turns it on or off, before scans."""

    def __init__(self, scheduler: Scheduler, memory: CommonMemory, fault: Fault) -> None:
        """Create a clock that no module drives."""
        self._scheduler, self._memory, self._fault = scheduler, memory, fault
        self._enables: list[tuple[str, int, int]] = []
        self._watchers: list[Callable[[], None]] = []
        self._posted = False
        self.since_ns: int | None = None

    @property
    def runs(self) -> bool:
        """Whether exactly one module drives it."""
        return self.since_ns is not None

    @property
    def next_ns(self) -> int:
        """End of the present interval; the first begins when the clock is turned on. ValueError if it does not run."""
        if self.since_ns is None:
            raise ValueError("the common clock does not run")
        passed = (self._scheduler.now_ns - self.since_ns) // CLOCK_PERIOD_NS
        return self.since_ns + (passed + 1) * CLOCK_PERIOD_NS

    def add_enable(self, module: str, view: int, register: int) -> None:
        """Register a module that drives the clock by ``ENABLE_BIT`` of a register of its bank ``view``."""
        self._enables.append((module, view, register))
        self._memory.watch(view, register, self._check_soon)

    def watch(self, changed: Callable[[], None]) -> None:
        """Call ``changed`` when the clock has started or stopped."""
        self._watchers.append(changed)

    def resume(self, since_ns: int | None) -> None:
        """Restore the time since which the clock runs, to match restored memory; no watcher is called."""
        self.since_ns = since_ns
        if bool(self._drivers()) is not self.runs:
            self._check_soon()

    def _drivers(self) -> list[str]:
        read = self._memory.read_now
        set_bits = (name for name, view, register in self._enables if int(read(view, register)) >> ENABLE_BIT & 1)
        return list(dict.fromkeys(set_bits))

    def _check_soon(self) -> None:
        if not self._posted:
            self._posted = True
            self._scheduler.at(self._scheduler.now_ns, EventKey(EventClass.IO, 0, ""), self._check)

    def _check(self, now_ns: int) -> None:
        self._posted = False
        drivers = self._drivers()
        if len(drivers) > 1:
            self._fault(f"{drivers[0]} and {drivers[1]} both drive the common clock (AMX7072)", SECOND_DRIVER)
            drivers = []
        if bool(drivers) is not self.runs:
            self.since_ns = now_ns if drivers else None
            for changed in self._watchers:
                changed()
