"""Services that answer later: rclpy answers when a callback returns, and EventsExecutor awaits none.

A callback returns ``Later``; its ``begin`` is called with what sends the response, at any later time, once.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

Respond = Callable[[Any], None]
"""Sends a response."""


@dataclass(frozen=True)
class Later:
    """Stands for a response that is not known yet."""

    begin: Callable[[Respond], None]


def allow_later(service: Any) -> None:
    """Let the callback of a service of rclpy's return ``Later``."""
    send = service.send_response

    def send_response(response: Any, header: Any) -> None:
        if isinstance(response, Later):
            response.begin(lambda found: send(found, header))
        else:
            send(response, header)

    service.send_response = send_response
