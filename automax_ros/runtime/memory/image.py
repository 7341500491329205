"""An image of common memory: a value for every view and element, with words and bits of registers kept consistent."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

from automax_ros.core.machine_code import mypyc_attr
from automax_ros.core.types import Latched, Value
from automax_ros.runtime.memory.registers import RegisterMap
from automax_ros.runtime.memory.views import CellLatch, LatchPlan, ViewSpec, latch_plan


@mypyc_attr(allow_interpreted_subclasses=True)
class Image:
    """The values of all views. Writes, and their effects, are defined by subclasses."""

    def __init__(self, views: Sequence[ViewSpec]) -> None:
        """Create the image as at installation: everything 0 (2.4.5)."""
        self.specs = tuple(views)
        self.now_ns = 0
        self.registers = RegisterMap(self.specs)
        self._shared = self.registers.views
        self._cells: list[Value] = [spec.type.zero for spec in self.specs]
        self._arrays: list[list[Value] | None] = [
            [spec.type.zero] * spec.elements if spec.is_array else None for spec in self.specs
        ]
        self._index = {spec.name: number for number, spec in enumerate(self.specs)}

    def view(self, name: str) -> int:
        """Return the view of a variable by its full name; KeyError if the rack has none."""
        return self._index[name]

    def plan(self, views: Sequence[int]) -> LatchPlan:
        """Return the prepared list of simple views that a task latches."""
        return latch_plan(views)

    def latch(self, plan: LatchPlan) -> Latched:
        """Return copies of the planned views, in their order (3.3)."""
        return plan(self._cells)

    def latching(self, plan: LatchPlan) -> Callable[[], Latched]:
        """Return a function that does the same as ``latch`` of a plan: ``_cells`` stays the same list."""
        return CellLatch(plan, self._cells)

    def read_now(self, view: int, element: int = 0) -> Value:
        """Return the actual value of a simple variable or of an array's element (flat index, in range)."""
        array = self._arrays[view]
        return self._cells[view] if array is None else array[element]

    def present(self, view: int) -> Value | list[Value]:
        """Return the actual value of a simple variable, or a copy of an array's values."""
        array = self._arrays[view]
        return self._cells[view] if array is None else array[:]

    def image(self) -> list[tuple[int, int, Value]]:
        """Return all of memory as (view, element, value), in the order of the table of variables."""
        entries: list[tuple[int, int, Value]] = []
        for view, array in enumerate(self._arrays):
            values = [self._cells[view]] if array is None else array
            entries.extend((view, element, value) for element, value in enumerate(values))
        return entries

    def load_image(self, entries: Iterable[tuple[int, int, Value]]) -> None:
        """Load an image without logging it, as at the start of a replay or of a late joiner."""
        for view, element, value in entries:
            self._put(view, element, value)

    def _put(self, view: int, element: int, value: Value) -> None:
        array = self._arrays[view]
        if array is None:
            self._cells[view] = value
        else:
            array[element] = value
