"""A Reliance Electric AutoMax rack emulated as ROS 2 nodes.

The rooms of the package, ground floor first; each imports only from those before it:
core, parallel, blocks, logix, language, compile, drive, rackfile, runtime, tuning, rack, scenario, messages,
recordings, replay, sweep, ros, cli.
Only `ros` and `cli` know ROS 2; without them this is a plain Python library. What programs need most is imported from
here, and loaded when it is asked for: `from automax_ros import Rack, load`.
"""

from __future__ import annotations

import importlib
from typing import Any

from automax_ros.core import compiled

__version__ = "0.1.0"

_HOMES = {
    "OperationRefused": "rack.base.stop_cause",
    "Rack": "rack.rack",
    "RackNodes": "ros.rack_nodes",
    "RackObserver": "rack.base.observers",
    "Stepper": "scenario.stepper",
    "StimuliPlayer": "scenario.stimuli.player",
    "Workers": "parallel.job",
    "load": "rackfile.loader",
    "prepare": "ros.setup.environment",
    "read_for_rack": "scenario.stimuli.reader",
    "report_of": "scenario.report",
}
"""The modules of the names that are imported from the package itself; without their types, or each edit of a node would
make what was compiled ahead of time stale."""

compiled.install(__path__[0])


def __getattr__(name: str) -> Any:
    """Return one of the names in ``_HOMES``: its module is loaded when the name is asked for."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    found = globals()[name] = getattr(importlib.import_module(f"{__name__}.{_HOMES[name]}"), name)
    return found
