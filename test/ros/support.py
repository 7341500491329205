"""A live rack and a client that take turns in one thread."""

import time

from automax_ros.core.ticks import NS_PER_S

PATIENCE_NS = 240 * NS_PER_S
"""After this time a test gives up (``system.support.PATIENCE_S``)."""


def until(live, client, condition):
    """Let rack and client live until a condition is true."""
    end_ns = time.monotonic_ns() + PATIENCE_NS

    def on_idle(_: int) -> None:
        for _ in range(5):
            client.executor.spin_once(timeout_sec=0)
        live.stopping = bool(condition()) or time.monotonic_ns() > end_ns

    live.stopping = False
    live.run(live.rack.now_ns + PATIENCE_NS, on_idle)
    assert condition(), "it never came true"
