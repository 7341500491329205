"""Each replay of these tests runs both ways, by columns and scan by scan: reports and errors are the same.

By columns it runs with the library of ``columns.c``; without a compiler both ways are scan by scan.
"""

from dataclasses import replace
from pathlib import Path

import pytest

from automax_ros.compile.base.native_source import NotNative
from automax_ros.compile.native.run.build import library
from automax_ros.compile.native.run.cache import NativeCache
from automax_ros.recordings.mcap.errors import BagError
from automax_ros.replay.columns.forms import ColumnForms
from automax_ros.replay.columns.library import ColumnLibrary, library_text
from automax_ros.replay.engine import Replay
from automax_ros.replay.scans.report import ReplayReport


def outcome(run, *arguments, **named) -> ReplayReport | BagError:
    try:
        return run(*arguments, **named)
    except BagError as error:
        return error


def told(found: ReplayReport | BagError) -> object:
    return (found.code, str(found)) if isinstance(found, BagError) else found


@pytest.fixture(scope="session")
def column_library(tmp_path_factory: pytest.TempPathFactory) -> ColumnLibrary | None:
    """The functions of ``columns.c``, built once; None where there is no compiler."""
    folder: Path = tmp_path_factory.mktemp("columns")
    folder.chmod(0o700)
    try:
        return ColumnLibrary(library(library_text(), NativeCache(folder)))
    except NotNative:
        return None


@pytest.fixture(autouse=True)
def both_ways(monkeypatch: pytest.MonkeyPatch, column_library: ColumnLibrary | None) -> None:
    run = Replay.run

    def run_both(self, on_progress=None, watcher=None, to_ns=None) -> ReplayReport:
        if watcher is not None or not self.options.by_columns:
            return run(self, on_progress, watcher, to_ns)
        options, quick = self.options, outcome(run, self, on_progress, None, to_ns)
        self.options = replace(options, by_columns=False)
        slow = outcome(run, self, None, None, to_ns)
        self.options = options
        assert told(quick) == told(slow)
        if isinstance(quick, BagError):
            raise quick
        return quick

    monkeypatch.setattr(Replay, "run", run_both)
    monkeypatch.setattr(ColumnForms, "library", column_library)
