"""Values in an engineer's unit that ROS writes: as counts, within their scale."""

from __future__ import annotations

import math

from automax_ros.nodes.module_node import ModuleNode
from automax_ros.rack.config import CommonVariable
from automax_ros.rack.scale import Scale
from automax_ros.running.views import MemoryValueError


class ScaledInput:
    """The counts of what one topic writes to a variable. Beyond the scale a value is clamped, and told once."""

    def __init__(self, node: ModuleNode, topic: str, variable: CommonVariable, scale: Scale, unit: str) -> None:
        """Begin with nothing told; ``unit`` stands in messages."""
        self._node, self._topic, self._variable = node, topic, variable
        self._scale, self._unit, self._is_told = scale, unit, False

    def counts(self, value: float) -> int:
        """Return the counts of a value.

        Raises:
            MemoryValueError: not a finite number.
        """
        if not math.isfinite(value):
            raise MemoryValueError(f"{value!r} is not a value for {self._variable.name}")
        counts, clamped = self._scale.counts_of(value)
        if clamped:
            text = f"{self._topic}: {value:.8g} {self._unit}".rstrip()
            text += f" lies beyond the scale: {self._variable.name} is {counts} counts"
            self._node.site.health.note("clamped value", self._variable.name, lambda: text)
            if not self._is_told:
                self._is_told = True
                self._node.get_logger().warning(text)
        return counts
