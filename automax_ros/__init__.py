"""A Reliance Electric AutoMax rack emulated as ROS 2 nodes.

The rooms of the package, ground floor first; each imports only from those before it:
core, parallel, blocks, logix, language, compile, drive, rackfile, runtime, tuning, rack, scenario, messages,
recordings, replay, sweep, ros, cli.
Only `ros` and `cli` know ROS 2; without them this is a plain Python library. What programs need most is imported from
here, and loaded when it is asked for: `from automax_ros import Rack, load`.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from automax_ros.core import compiled

if TYPE_CHECKING:
    from automax_ros.parallel.job import Workers as Workers
    from automax_ros.rack.base.observers import RackObserver as RackObserver
    from automax_ros.rack.base.stop_cause import OperationRefused as OperationRefused
    from automax_ros.rack.rack import Rack as Rack
    from automax_ros.rackfile.loader import load as load
    from automax_ros.ros.rack_nodes import RackNodes as RackNodes
    from automax_ros.ros.setup.environment import prepare as prepare
    from automax_ros.scenario.report import report_of as report_of
    from automax_ros.scenario.stepping.stepper import Stepper as Stepper
    from automax_ros.scenario.stimuli.player import StimuliPlayer as StimuliPlayer
    from automax_ros.scenario.stimuli.reader import read_for_rack as read_for_rack

__version__ = "0.1.0"

_HOMES = {
    "OperationRefused": "rack.base.stop_cause",
    "Rack": "rack.rack",
    "RackNodes": "ros.rack_nodes",
    "RackObserver": "rack.base.observers",
    "Stepper": "scenario.stepping.stepper",
    "StimuliPlayer": "scenario.stimuli.player",
    "Workers": "parallel.job",
    "load": "rackfile.loader",
    "prepare": "ros.setup.environment",
    "read_for_rack": "scenario.stimuli.reader",
    "report_of": "scenario.report",
}
"""The modules of the names that are imported from the package itself."""

compiled.install(__path__[0])


def __getattr__(name: str) -> Any:
    """Return one of the names in ``_HOMES``: its module is loaded when the name is asked for."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    found = globals()[name] = getattr(importlib.import_module(f"{__name__}.{_HOMES[name]}"), name)
    return found
