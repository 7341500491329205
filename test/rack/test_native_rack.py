"""A rack whose tasks scan natively: reloads, tunables, forces and states as in Python."""

from pathlib import Path

import pytest

from automax_ros.compile.native.run.cache import NativeCache
from automax_ros.compile.native.run.forms import IN_PYTHON, NativeForms, NativeMode
from automax_ros.core.diagnostics import SourceText
from automax_ros.rack.rack import Rack
from rack.helpers import rack_at, run_for

CONFIG = Path(__file__).parents[2] / "config" / "section_drive" / "rack.yaml"


@pytest.fixture(scope="module")
def native(tmp_path_factory):
    return NativeForms(NativeMode.ON, cache=NativeCache(tmp_path_factory.mktemp("cache") / "native"))


def rack_of(forms):
    return run_for(rack_at(CONFIG, native=forms))


def is_native(rack, name):
    rack.run(0.02)
    return type(rack.task(name)._scans).__module__ == "automax_host"


def reload(rack):
    source = rack.sources["MOTOR"]
    rack.operations.reload("MOTOR", SourceText(source.name, source.text + "\n"))


def lived(forms):
    """What a rack comes to that is tuned, forced, reloaded and loaded from a state."""
    rack = rack_of(forms)
    rack.run(0.5)
    rack.tune(rack.task("SPEED"), "KP_SPEED", 20.0)
    rack.run(0.5)
    rack.force("CUR_REF%", 300)
    rack.run(0.3)
    rack.unforce("CUR_REF%")
    reload(rack)
    rack.run(0.5)
    other = Rack(rack.config, native=forms)
    reload(other)
    other.load(rack.state())
    other.run(0.5)
    return rack, other


def test_a_native_rack_lives_as_one_in_python(native):
    rack, other = lived(native)
    expected, expected_other = lived(IN_PYTHON)
    assert rack.state() == expected.state()
    assert other.state() == expected_other.state()
    assert repr(other.state()) == repr(expected_other.state())
    assert all(is_native(other, name) for name in ("LINE", "SPEED", "MOTOR"))


def test_a_reloaded_task_is_native_too(native):
    rack = rack_of(native)
    reload(rack)
    assert is_native(rack, "MOTOR")


def test_without_being_asked_a_rack_scans_in_python():
    rack = rack_of(IN_PYTHON)
    assert not is_native(rack, "MOTOR")
    assert {outcome.why for outcome in rack.operations.installation.native.values()} == {"native scans are off"}
