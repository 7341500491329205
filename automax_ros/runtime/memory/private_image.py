"""The private image of a module that works on copies of common memory, such as a UDC (S-3006 p. 4-2).

Its tasks latch, commit, read and write here; the module copies chosen views in and out at the instants of its own.

What the tasks of a UDC work on: the module's local memory for some registers, the dual port itself for all others.

The UDC copies its application registers between local memory and the dual port at instants of its own
(S-3056 p. 3-50). All other registers its tasks reach in the dual port: blocks through the latch, BASIC statements at
once (S-3006 p. 4-9).
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Sequence

from automax_ros.core.kinds import WriteKind
from automax_ros.core.types import Latched, Value
from automax_ros.runtime.memory.image import Image
from automax_ros.runtime.memory.memory import CommonMemory
from automax_ros.runtime.memory.views import LatchPlan, ViewSpec, latch_plan


class PrivateImage(Image):
    """Views of a rack as one module's tasks see them. Nothing is logged: only what is copied out is common memory."""

    def __init__(self, views: Sequence[ViewSpec], common: CommonMemory) -> None:
        """Make the image as it is at installation, over the memory that it copies from and to."""
        super().__init__(views)
        self._common = common

    def commit(self, changes: Sequence[tuple[int, Value]], writer: int) -> None:
        """Write what a scan's blocks changed."""
        for view, value in changes:
            self.write_now(view, value, writer)

    def write_now(
        self,
        view: int,
        value: Value,
        writer: int,  # noqa: ARG002
        element: int = 0,
        kind: WriteKind = WriteKind.BASIC,  # noqa: ARG002
    ) -> None:
        """Write the image, unless a force holds the view; words and bits of the same register change together."""
        if self._common.is_forced(view):
            return
        value = self.registers.keeping(view, element, value, self._common.forced, self.read_now)
        self._spread(view, element, value)

    def is_forced(self, view: int) -> bool:
        """Return whether a force holds a simple view."""
        return self._common.is_forced(view)

    def under_force(self, view: int) -> Value:
        """Return what a simple view holds: no task that asks works on an image (decision)."""
        return self.read_now(view)

    def watch_forces(self, changed: Callable[[], None]) -> None:
        """Call ``changed`` whenever a force begins or ends."""
        self._common.watch_forces(changed)

    def copy_in(self, views: Iterable[int]) -> None:
        """Take over views as common memory has them now."""
        self.take(self._elements(views))

    def copy_out(self, views: Iterable[int], writer: int) -> None:
        """Write to common memory what differs there, as commits of ``writer``."""
        self.give(self._elements(views), writer)

    def take(self, keys: Iterable[tuple[int, int]]) -> None:
        """Take over single values as common memory has them now; ``keys`` are views with elements."""
        for view, element in keys:
            self._put(view, element, self._common.read_now(view, element))

    def take_forced(self) -> None:
        """Take over what forces hold, with all that shows the same registers."""
        for view, element in sorted(self._common.forced):
            self._spread(view, element, self._common.read_now(view, element))

    def give(self, keys: Iterable[tuple[int, int]], writer: int) -> None:
        """Write single values to common memory where they differ there, as commits of ``writer``."""
        for view, element in keys:
            value = self.read_now(view, element)
            if value != self._common.read_now(view, element):
                self._common.write_now(view, value, writer, element, WriteKind.COMMIT)

    def clear(self, keys: Iterable[tuple[int, int]]) -> None:
        """Set values to 0."""
        for view, element in keys:
            self._put(view, element, self.specs[view].type.zero)

    def _elements(self, views: Iterable[int]) -> list[tuple[int, int]]:
        return [(view, element) for view in views for element in range(self.specs[view].elements)]

    def _spread(self, view: int, element: int, value: Value) -> None:
        """Put a value, and what else shows the same registers."""
        entries = list(self.registers.consequences(view, element, value, self.read_now)) if view in self._shared else []
        for entry in ((view, element, value), *entries):
            self._put(*entry)


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
