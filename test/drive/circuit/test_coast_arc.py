"""A contactor that opens under current: the arc holds it, then it ends (drive.md, decisions on the drive)."""

from __future__ import annotations

import pytest

from automax_ros.drive.circuit.conduction import EventKind
from automax_ros.drive.plant.plant import DROP_OUT_NS
from drive.current_loop.support import Bench


@pytest.mark.parametrize("late_us", [0, 1400])
def test_a_coast_stop_in_braking_opens_the_contactor_under_current(late_us):
    """Braking at speed the EMF drives the current on: without gates it does not end in the line, but in the arc."""
    bench = Bench("150hp", late_ns=late_us * 1000)
    bench.emf(450.0)
    bench.start()
    bench.set(reference=-3000)
    bench.run(0.4)
    plant = bench.plant
    assert plant.circuit.current_a < -200.0
    plant.circuit.take_events()
    stopped_ns = bench.now_ns
    bench.set(cml_coast_stop=True)
    current, touching = [], []
    while bench.now_ns < stopped_ns + 2 * DROP_OUT_NS:
        bench.scan()
        for step in range(1, 10):
            plant.advance(bench.scans[-1].now_ns + bench.late_ns + step * 100_000)
            current.append(plant.circuit.current_a)
            touching.append(plant.is_closed)
    under_arc = [amps for amps, closed in zip(current, touching, strict=True) if not closed and amps]
    assert under_arc, "the contacts have parted and current flows on"
    # A long arc would need more voltage than the line and the EMF have together: the current only falls in it.
    assert [abs(amps) for amps in under_arc] == sorted((abs(amps) for amps in under_arc), reverse=True)
    (opened,) = [event for event in plant.circuit.take_events() if event.kind is EventKind.ARMATURE_OPEN]
    assert DROP_OUT_NS < opened.time_s * 1e9 - stopped_ns < DROP_OUT_NS + 20_000_000
    assert (current[-1], touching[-1]) == (0.0, False)
    assert not bench.loop.sequence.running
