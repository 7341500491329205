"""Many simulated runs of one rack: what varies, what is measured, the runs, their tables.

- ``quantities`` and ``points`` say which values the runs have;
- ``measures``, ``functions`` and ``watching`` compute numbers while a run goes;
- ``blueprint`` and ``run`` make one run, ``sweeping`` all of them, ``tables`` their files.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from automax_ros.core.face import face

if TYPE_CHECKING:
    from automax_ros.sweep.blueprint import Blueprint
    from automax_ros.sweep.measures import Measure, read_measures
    from automax_ros.sweep.points import Varied, grid, read_varied, sample
    from automax_ros.sweep.run import Outcome, Plan, Stimuli, run_point
    from automax_ros.sweep.sweeping import Row, best_rows, run_sweep
    from automax_ros.sweep.tables import records, write_csv, write_npz

__all__ = [
    "Blueprint",
    "Measure",
    "Outcome",
    "Plan",
    "Row",
    "Stimuli",
    "Varied",
    "best_rows",
    "grid",
    "read_measures",
    "read_varied",
    "records",
    "run_point",
    "run_sweep",
    "sample",
    "write_csv",
    "write_npz",
]

__getattr__ = face(__name__, "blueprint", "measures", "points", "run", "sweeping", "tables")
