import pytest

from automax_ros.blocks.catalogue import CATALOGUE


def faults(name, *given):
    return [fault for rule in CATALOGUE[name].rules if (fault := rule.fault(dict.fromkeys(given)))]


@pytest.mark.parametrize("name", ["AND", "OR"])
def test_channels_must_follow_on(name):
    assert faults(name, "INPUT1", "OUTPUT") == []
    assert faults(name, *(f"INPUT{n}" for n in range(1, 9))) == []
    assert faults(name, "INPUT3", "INPUT1", "INPUT2") == []
    (fault,) = faults(name, "INPUT1", "INPUT4")
    assert fault.keyword == "INPUT4"
    assert "without INPUT2" in fault.message
    (fault,) = faults(name, "INPUT2")
    assert "without INPUT1" in fault.message


@pytest.mark.parametrize("given", [(), ("SET",), ("CLOCK", "OUTPUT")])
def test_latch_needs_two_inputs(given):
    (fault,) = faults("LATCH", *given)
    assert fault.keyword is None
    assert "at least 2 of RESET, SET, CLOCK, INPUT" in fault.message


def test_latch_with_any_two():
    assert faults("LATCH", "SET", "RESET") == []
    assert faults("LATCH", "INPUT", "CLOCK", "OUTPUT") == []
