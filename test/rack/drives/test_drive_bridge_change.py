"""Bridge changes of a drive in a rack: ordinary, fast, fast without the voltage that it needs (52.6)."""

from __future__ import annotations

from pathlib import Path

import pytest

from automax_ros.rack.rack import Rack
from rack.helpers import run_for
from rack.modules.cml_racks import built


def at_speed(folder: Path, *, wired: bool, fast_in_standby: bool) -> Rack:
    """Return a rack whose motor has more than 200 V of EMF and 55 % of its current on bridge 1."""
    rack = run_for(built(folder, analog="57C405, drive: 7" if wired else "57C405"))
    rack.write("PERMIT@", True)
    rack.write("SPEED%", 2000)
    rack.run(0.6)
    rack.write("FAST@", fast_in_standby)
    rack.run(0.05)
    rack.write("RUN@", True)
    rack.run(0.5)
    rack.write("REF%", 2500)
    rack.run(0.9)
    rack.write("REF%", 1500)
    rack.run(0.1)
    assert rack.plants["UNWIND"].circuit.emf_v > 200
    return rack


def dead_time_ms(rack: Rack) -> float:
    """Reverse the reference and return how long no current flows between the two bridges, 0.1 ms exact."""
    rack.write("REF%", -1500)
    circuit, ended = rack.plants["UNWIND"].circuit, 0.0
    for _ in range(2000):
        rack.run(0.0001)
        rack.plants["UNWIND"].advance(rack.now_ns)
        if circuit.current_a > 1e-6:
            ended = rack.now_ns / 1e6
        if circuit.current_a < -1e-6:
            return rack.now_ns / 1e6 - ended
    raise AssertionError("no current on the other bridge")


def test_a_reversal_takes_longer_without_the_fast_change(tmp_path):
    """52.6: 3 to 70 ms of dead time, about 2 ms with the fast change, which is latched in standby."""
    slow = dead_time_ms(at_speed(tmp_path, wired=True, fast_in_standby=False))
    assert 3 <= slow <= 70
    rack = at_speed(tmp_path, wired=True, fast_in_standby=False)
    rack.write("FAST@", True)
    rack.run(0.1)
    assert dead_time_ms(rack) == pytest.approx(slow, abs=3)
    quick = at_speed(tmp_path, wired=True, fast_in_standby=True)
    assert 0.5 <= dead_time_ms(quick) <= 3
    quick.run(0.1)
    assert [quick.value(name) for name in ("IOC@", "STATE@", "BRIDGE@")] == [False, True, True]


def test_a_fast_change_without_the_armature_voltage_ends_in_an_overcurrent(tmp_path):
    """52.6.2: the application lacks the hardware that the fast change needs."""
    rack = at_speed(tmp_path, wired=False, fast_in_standby=True)
    rack.write("REF%", -1500)
    rack.run(0.1)
    assert [rack.value(name) for name in ("IOC@", "STATE@", "OK@")] == [True, False, False]
