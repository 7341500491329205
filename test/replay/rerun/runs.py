"""Runs of racks recorded and run again, for the tests of rerun."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from automax_ros.core.diagnostics import SourceText
from automax_ros.messages.stream.stream import RackStream
from automax_ros.rack.rack import Rack
from automax_ros.recordings.read.reader import BagReader
from automax_ros.recordings.write.recorder import Recorder
from automax_ros.replay.rerun.report import RerunReport
from automax_ros.replay.rerun.rerun import Rerun, RerunOptions
from automax_ros.runtime.time.scheduler import EventClass, EventKey
from automax_ros.scenario.stimuli.player import StimuliPlayer
from automax_ros.scenario.stimuli.reader import read_for_rack

_OUTSIDE = EventKey(EventClass.OUTSIDE, 0, "")


def data_of(bag: Path) -> bytes:
    return (bag / "scans_0.mcap").read_bytes()


def messages_of(bag: Path, kind: type) -> list:
    return [item.message for item in BagReader(bag).messages() if isinstance(item.message, kind)]


def run_again(bag: Path, after: Path | None, from_s: float = 0.0, *tunings: str, **new: str) -> RerunReport:
    """Run a recording again, with sources that replace its own."""
    sources = {name: SourceText(f"new/{name}.BLK", text) for name, text in new.items()}
    rerun = Rerun(bag, sources, RerunOptions(from_ns=round(from_s * 1e9)))
    rerun.tune(tunings)
    return rerun.run(after)


def recorded_run(
    rack: Rack,
    bag: Path,
    seconds: float,
    acts: dict[float, Callable[[], object]] | None = None,
    *,
    stimuli: Path | None = None,
    epoch_ns: int = 0,
    settings: tuple = (),
) -> Path:
    """Record a run; ``acts`` happen at their times (s), before all else of the instant. An epoch is that of a clock."""
    stream = RackStream(rack, rack.fingerprint)
    recorder = Recorder(rack, stream, bag)
    player = StimuliPlayer((), rack.scheduler)
    if stimuli is not None:
        file = read_for_rack(stimuli, rack)
        assert file.stimuli is not None, file.diagnostics
        player = StimuliPlayer(file.stimuli, rack.scheduler)
    stream.begin(epoch_ns)
    rack.start(settings, player.begin)
    for at_s, act in (acts or {}).items():
        rack.scheduler.at(round(at_s * 1e9), _OUTSIDE, lambda _, act=act: act())
    rack.run(seconds)
    stream.end()
    recorder.close()
    assert recorder.failure is None
    return bag
