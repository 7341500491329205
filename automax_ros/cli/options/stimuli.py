"""Stimuli files on the command line: read, diagnosed, and made ready to be played."""

from __future__ import annotations

import sys
from pathlib import Path

from automax_ros.cli.output.screen import print_diagnostics
from automax_ros.core.user_error import UsageError
from automax_ros.rack.rack import Rack
from automax_ros.scenario.stimuli.player import StimuliPlayer, Stimulus
from automax_ros.scenario.stimuli.reader import StimuliFile, read_for_rack


class StimuliRefused(Exception):
    """A stimuli file has errors, which were printed."""


def stimulation(rack: Rack, path: Path | None, *, allow_outside: bool) -> StimuliPlayer:
    """Return the player of a stimuli file, an empty one without a file; its warnings are printed.

    Raises:
        StimuliRefused: the file has errors.
        UsageError: it cannot be read.
    """
    if path is None:
        return StimuliPlayer((), rack.scheduler)
    return StimuliPlayer(entries_of(read_for_rack(path, rack, allow_outside=allow_outside)), rack.scheduler)


def entries_of(file: StimuliFile) -> tuple[Stimulus, ...]:
    """Return the entries of a file that was read; its diagnostics are printed.

    Raises:
        StimuliRefused: the file has errors.
        UsageError: it cannot be read.
    """
    print_diagnostics(file.diagnostics, file.source, sys.stderr)
    if not file.is_text:
        raise UsageError(f"{file.source.name} cannot be used")
    if file.stimuli is None:
        raise StimuliRefused
    return file.stimuli
