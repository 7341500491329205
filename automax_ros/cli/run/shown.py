"""The panel of a rack that runs in this process: `automax run --panel`."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from typing import TYPE_CHECKING

from automax_ros.cli.options.panel import panel_served
from automax_ros.cli.run.plan import RunPlan
from automax_ros.messages.stream.stream import RackStream
from automax_ros.rack.rack import Rack

if TYPE_CHECKING:
    from automax_ros.panel.live_rack import RackSource


@contextmanager
def rack_shown(
    rack: Rack,
    plan: RunPlan,
    stream: RackStream,
    entrance: Callable[[], AbstractContextManager[None]],
    pace: object,
    message: Callable[[str], None],
    *,
    live: bool,
) -> Iterator[RackSource | None]:
    """Serve the panel that a plan asks for while the block lasts; None if it asks for none.

    Args:
        rack: a rack that was not started.
        plan: the plan of its run.
        stream: its messages, which have not begun.
        entrance: returns a context that holds off scans.
        pace: what can halt rack time.
        message: tells the address.
        live: on the wall clock and with nodes: execution times are measured.

    Raises:
        UsageError: the port is taken, or the host is none of this machine.
    """
    if plan.panel is None:
        yield None
        return
    from automax_ros.panel.live_rack import RackSource

    config = rack.config
    others = [f"operator node of /{config.namespace}"] if live and config.operator else []
    source = RackSource(rack, entrance, title=config.name, pace=pace, stream=stream, measured=live, operators=others)
    with panel_served(source, plan.panel, message):
        yield source
