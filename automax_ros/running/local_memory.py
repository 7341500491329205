"""What the tasks of a UDC work on: the module's local memory for some registers, the dual port itself for all others.

The UDC copies its application registers between local memory and the dual port at instants of its own
(S-3056 p. 3-50). All other registers its tasks reach in the dual port: blocks through the latch, BASIC statements at
once (S-3006 p. 4-9).
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Sequence

from automax_ros.core.kinds import WriteKind
from automax_ros.core.types import Latched, Value
from automax_ros.running.memory import CommonMemory
from automax_ros.running.private_image import PrivateImage
from automax_ros.running.views import LatchPlan, latch_plan


class LocalMemory:
    """The memory of a module's tasks: ``image`` for the views in ``local``, common memory for the others."""

    def __init__(self, common: CommonMemory, local: Collection[int]) -> None:
        """Make the local memory as it is at installation."""
        self.image = PrivateImage(common.specs, common)
        self._common, self._local = common, frozenset(local)

    @property
    def now_ns(self) -> int:
        """The time of what happens next."""
        return self._common.now_ns

    @now_ns.setter
    def now_ns(self, now_ns: int) -> None:
        self._common.now_ns = now_ns

    def view(self, name: str) -> int:
        """Return the view of a variable by its full name; KeyError if there is none."""
        return self._common.view(name)

    def plan(self, views: Sequence[int]) -> LatchPlan:
        """Return the prepared list of simple views that a task latches."""
        pick = latch_plan(views)
        direct = [view for view in views if view not in self._local]
        read = self._common.read_now

        def latched(cells: list[Value]) -> Latched:
            for view in direct:
                cells[view] = read(view)
            return pick(cells)

        return latched

    def latch(self, plan: LatchPlan) -> Latched:
        """Return copies of the planned views, in their order (3.3)."""
        return self.image.latch(plan)

    def commit(self, changes: Iterable[tuple[int, Value]], writer: int) -> None:
        """Write what a scan's blocks changed, at END."""
        for change in changes:
            memory = self.image if change[0] in self._local else self._common
            memory.commit([change], writer)

    def read_now(self, view: int, element: int = 0) -> Value:
        """Return an actual value."""
        return (self.image if view in self._local else self._common).read_now(view, element)

    def write_now(
        self, view: int, value: Value, writer: int, element: int = 0, kind: WriteKind = WriteKind.BASIC
    ) -> None:
        """Write an actual value, already within the view's type."""
        (self.image if view in self._local else self._common).write_now(view, value, writer, element, kind)

    def is_forced(self, view: int) -> bool:
        """Return whether a force holds a simple view."""
        return self._common.is_forced(view)

    def under_force(self, view: int) -> Value:
        """Return what a simple view would hold if no force held it."""
        return self._common.under_force(view)

    def watch_forces(self, changed: Callable[[], None]) -> None:
        """Call ``changed`` whenever a force begins or ends."""
        self._common.watch_forces(changed)
