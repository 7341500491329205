"""Tasks that are compiled once and run in many racks."""

from pathlib import Path

from automax_ros.core.diagnostics import SourceText
from automax_ros.rack.rack import Rack
from automax_ros.rack.tasks.installation import Installation
from automax_ros.rackfile.loader import load_stored
from automax_ros.rackfile.model.config import RackConfig
from rack.helpers import config_at, run_for

CONFIG = Path(__file__).parents[3] / "config" / "section_drive" / "rack.yaml"


def config() -> RackConfig:
    return config_at(CONFIG)


def image_after(rack: Rack, seconds: float) -> list[object]:
    rack.start()
    rack.run(seconds)
    return [*rack.memory.image(), *(task.snapshot() for task in rack.tasks)]


def test_racks_of_one_installation_know_nothing_of_each_other():
    found = config()
    template = Installation(found)
    first = Rack(found, installation=template.again(found))
    first.tune(first.task("SPEED"), "KP_SPEED", 6.0)
    expected = image_after(Rack(found), 3.0)
    assert image_after(first, 3.0) != expected
    assert image_after(Rack(found, installation=template.again(found)), 3.0) == expected


def test_a_source_that_one_rack_reloads_is_not_that_of_the_next():
    found = config()
    template = Installation(found)
    rack = run_for(Rack(found, installation=template.again(found)))
    source = template.sources["LINE"]
    other = SourceText(source.name, source.text + "\n")
    rack.operations.stop("LINE")
    rack.operations.reload("LINE", other)
    assert rack.operations.installation.programs["LINE"] is not template.programs["LINE"]
    assert Rack(found, installation=template.again(found)).sources["LINE"] == source
    assert template.again(found).programs["LINE"] is template.programs["LINE"]


def test_sources_stand_for_files():
    found = config()
    sources = Installation(found).sources
    stored = load_stored(SourceText("rack.yaml", found.text), Path("nowhere") / "rack.yaml").config
    assert stored is not None
    rack = Rack(stored, installation=Installation(stored, sources=sources))
    assert image_after(rack, 2.0) == image_after(Rack(found), 2.0)
    assert rack.fingerprint == Rack(found).fingerprint
