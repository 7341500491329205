"""The memory of a UDC's tasks: an image for its application registers, common memory for all others (S-3006 p. 4-2).

The UDC copies the image from and to the dual port at its own instants (S-3056 p. 3-50). Other registers are in the dual
port: blocks access them through the latch, BASIC statements at once (S-3006 p. 4-9).
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence

from automax_ros.core.kinds import WriteKind
from automax_ros.core.types import Latched, Value
from automax_ros.runtime.memory.image import Image
from automax_ros.runtime.memory.memory import CommonMemory
from automax_ros.runtime.memory.views import LatchPlan, ViewSpec, latch_plan


class PrivateImage(Image):
    """A rack's views as one module's tasks see them. Nothing is logged: only views copied out change common memory."""

    def __init__(self, views: Sequence[ViewSpec], common: CommonMemory) -> None:
        super().__init__(views)
        self._common = common

    def commit(self, changes: Sequence[tuple[int, Value]], writer: int) -> None:
        """Write the values that a scan's blocks changed."""
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

    def take(self, keys: Iterable[tuple[int, int]]) -> None:
        """Copy single values from common memory; ``keys`` are views with elements."""
        for view, element in keys:
            self._put(view, element, self._common.read_now(view, element))

    def take_forced(self) -> None:
        """Copy forced values, and update all views of the same registers."""
        for view, element in sorted(self._common.forced):
            self._spread(view, element, self._common.read_now(view, element))

    def give(self, keys: Iterable[tuple[int, int]], writer: int) -> None:
        """Write single values that differ to common memory, as commits of ``writer``."""
        for view, element in keys:
            value = self.read_now(view, element)
            if value != self._common.read_now(view, element):
                self._common.write_now(view, value, writer, element, WriteKind.COMMIT)

    def clear(self, keys: Iterable[tuple[int, int]]) -> None:
        """Set values to 0."""
        for view, element in keys:
            self._put(view, element, self.specs[view].type.zero)

    def _spread(self, view: int, element: int, value: Value) -> None:
        entries = list(self.registers.consequences(view, element, value, self.read_now)) if view in self._shared else []
        for entry in ((view, element, value), *entries):
            self._put(*entry)


class LocalMemory:
    """The memory of a module's tasks: ``image`` for the views in ``local``, common memory for the others."""

    def __init__(self, common: CommonMemory, local: Collection[int]) -> None:
        self.image = PrivateImage(common.specs, common)
        self._common, self._local = common, frozenset(local)
        self.view, self.is_forced, self.under_force = common.view, common.is_forced, common.under_force
        self.watch_forces, self.latch = common.watch_forces, self.image.latch

    @property
    def now_ns(self) -> int:
        """The time of the next access."""
        return self._common.now_ns

    @now_ns.setter
    def now_ns(self, now_ns: int) -> None:
        self._common.now_ns = now_ns

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

    def commit(self, changes: Iterable[tuple[int, Value]], writer: int) -> None:
        """Write the values that a scan's blocks changed, at END."""
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
