"""Work that takes long: on a thread of its own, and back to the node's executor with what came of it."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

from rclpy.node import Node


class Background:
    """Does long work for one node while the rack scans.

    The thread keeps no program from ending: what it works at then is lost.
    """

    def __init__(self, node: Node) -> None:
        """Take the node whose executor is to go on."""
        self._node, self._closed = node, False

    def do(self, work: Callable[[], Any], finish: Callable[[Any, Exception | None], None]) -> None:
        """Let a thread do ``work``; then the executor calls ``finish`` with what it returned, and what it raised."""
        executor = self._node.executor

        def finished(result: Any, error: Exception | None) -> None:
            if not self._closed:
                finish(result, error)

        def run() -> None:
            result, error = None, None
            try:
                result = work()
            except Exception as raised:
                error = raised
            if not self._closed:
                executor.create_task(finished, result, error)

        threading.Thread(target=run, name=f"{self._node.get_name()} work", daemon=True).start()

    def close(self) -> None:
        """Forget what is under way."""
        self._closed = True
