"""From a YAML file to a rack: slots, modules, common variables and tasks, wired together.

- ``config`` says what a rack's file means, as frozen dataclasses;
- ``loader`` reads a file into them and finds everything wrong with it: ``load(path)``;
- ``sections`` and ``scalars`` check mappings and values of the tree that ``core/yaml_text`` reads;
- ``slots``, ``tasks``, ``commons``, ``points``, ``names``, ``presets`` check one part of the file each;
- ``modules/`` has a file for each kind of module, ``files`` reads files within bounds;
- ``rack`` is what runs, ``operations`` and ``adjusting`` what an operator can do with it, ``observers`` who is told;
- ``retention`` keeps in a folder what survives the power, from one process to the next;
- ``stimuli/`` lets happen what a file says by rack time, ``report`` says how a run ended;
- ``stepping/`` lets a rack go on by ticks, scans and BASIC lines;
- ``drafting`` makes a rack file from a folder of tasks;
- ``ros_names`` turns the rack's names into names of ROS 2.

docs/rack_yaml.md is the user's reference of the file.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from automax_ros.core.face import face

if TYPE_CHECKING:
    from automax_ros.rack.config import CommonVariable, RackConfig
    from automax_ros.rack.drafting import Draft, draft
    from automax_ros.rack.installation import RackError
    from automax_ros.rack.loader import LoadResult, load
    from automax_ros.rack.modules.configured import ModuleConfig
    from automax_ros.rack.modules.kind import ModuleKind
    from automax_ros.rack.modules.running import Module
    from automax_ros.rack.observers import Operation, RackObserver
    from automax_ros.rack.rack import Rack
    from automax_ros.rack.rack_state import RackState
    from automax_ros.rack.report import report_of
    from automax_ros.rack.standing import OperationRefused
    from automax_ros.rack.stepping.stepper import Halt, Stepper, Why
    from automax_ros.rack.stimuli.player import Stimulation
    from automax_ros.rack.stimuli.reader import read_for_rack
    from automax_ros.rack.tasks_check import check_tasks

__all__ = [
    "CommonVariable",
    "Draft",
    "Halt",
    "LoadResult",
    "Module",
    "ModuleConfig",
    "ModuleKind",
    "Operation",
    "OperationRefused",
    "Rack",
    "RackConfig",
    "RackError",
    "RackObserver",
    "RackState",
    "Stepper",
    "Stimulation",
    "Why",
    "check_tasks",
    "draft",
    "load",
    "read_for_rack",
    "report_of",
]

__getattr__ = face(
    __name__,
    "config",
    "loader",
    "tasks_check",
    "drafting",
    "installation",
    "modules.kind",
    "observers",
    "operations",
    "rack",
    "rack_state",
    "report",
    "stepping.stepper",
    "stimuli.player",
    "stimuli.reader",
)
