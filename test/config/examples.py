"""The racks of the examples in config/, built and stimulated."""

from pathlib import Path

from automax_ros.rack.rack import Rack
from automax_ros.rackfile.loader import load
from automax_ros.rackfile.model.config import RackConfig
from automax_ros.scenario.stimuli.player import StimuliPlayer
from automax_ros.scenario.stimuli.reader import read_for_rack

CONFIG = Path(__file__).parents[2] / "config"


def loaded(folder: Path) -> RackConfig:
    """The configuration of a rack without a problem."""
    result = load(folder / "rack.yaml")
    assert result.diagnostics == []
    assert result.config is not None
    return result.config


def built(folder: Path) -> Rack:
    rack = Rack(loaded(folder))
    assert rack.warnings == []
    return rack


def play(rack: Rack, stimuli: Path) -> StimuliPlayer:
    """Start a rack with stimuli about to happen."""
    read = read_for_rack(stimuli, rack)
    assert read.stimuli is not None
    played = StimuliPlayer(read.stimuli, rack.scheduler)
    rack.start()
    played.begin()
    return played
