"""What a run was asked for, and what both kinds of run tell."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path

from automax_ros.bags.recorder import RecordingOptions
from automax_ros.cli.terminal import print_diagnostics
from automax_ros.core.types import Value
from automax_ros.rack.config import RackConfig
from automax_ros.rack.rack import Rack
from automax_ros.rack.settings import CommonElement


@dataclass(frozen=True)
class RunPlan:
    """A run.

    ``duration_ns`` None runs until it is stopped, ``record`` is the folder of a recording, ``state`` the one that was
    named for values that outlive the run, if any.
    """

    config: RackConfig
    duration_ns: int | None
    record: Path | None
    recording: RecordingOptions
    settings: tuple[tuple[str, Value], ...]
    watch: tuple[CommonElement, ...]
    state: Path | None = None


def warn(rack: Rack) -> None:
    """Print the warnings that the tasks' checks gave."""
    for source, diagnostics in rack.warnings:
        print_diagnostics(diagnostics, source, sys.stderr)


def report_end(rack: Rack, *, failed: bool) -> int:
    """Print what stopped the rack and return the exit code: 1 after a fault or a recording that ``failed``."""
    if rack.stop_reason is not None:
        print(f"automax run: STOP ALL: {rack.stop_reason}", file=sys.stderr)
        return 1
    return 1 if failed else 0
