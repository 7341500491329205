"""One rack over several processes: versioned writes of common memory, and how the rack stands. No ROS 2.

Each process has an image of its own; what one writes the others take if it is newer than what they hold, so all come to
hold the same without anybody who puts writes in order.
"""

from __future__ import annotations
