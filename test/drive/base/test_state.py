"""States of the drive's parts: what resumes from one is, bit for bit, what would have come."""

import json
from math import pi
from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from automax_ros.drive.base.errors import ParameterError
from automax_ros.drive.base.motor import FieldWinding, FixedLoad, Motor
from automax_ros.drive.base.nameplate import EXAMPLES, derive
from automax_ros.drive.base.sensors import Resolver, Tachometer
from automax_ros.drive.circuit.ac_line import AcLine
from automax_ros.drive.circuit.bridge import Bridge
from automax_ros.drive.circuit.circuit import Circuit
from automax_ros.drive.circuit.firing import ConstantAlpha
from automax_ros.drive.plant.coupling import Coupling
from drive.support import repeatable
from drive.switched import WAYS

PARAMETERS = derive(EXAMPLES["150hp"])
SLICE_NS = 700_000


def motor(random):
    load = random.choice([0.0, 300.0, lambda speed: 0.01 * speed * abs(speed)])
    field = random.choice([None, FieldWinding(tau_s=0.5, knee=0.5)])
    return Motor(PARAMETERS.motor, load=load, field=field, speed_rad_s=random.choice([0.0, 60.0, 150.0, -80.0]))


def made(seed):
    """A drive of random choices, made the same way each time."""
    random = Random(seed)
    line = AcLine(
        460.0, inductance_h=random.choice([60e-6, 140e-6]), resistance_ohm=0.005, missing=random.choice([(), (), (1,)])
    )
    machine = random.choice([FixedLoad(0.3, 2e-3, random.choice([-300.0, 0.0, 250.0])), motor(random)])
    bridge = Bridge(turn_off_s=random.choice([0.0, 150e-6]), drop_v=random.choice([0.0, 1.5]))
    return Circuit(line, bridge, machine, trace=random.choice([True, False]), energy=random.choice([True, False]))


def disturbances(seed):
    """What happens in each slice of time: gates, failures, a line that moves; many slices have none."""
    random = Random(seed + 1)
    for _ in range(60):
        yield random.choice(["fire"] * 12 + ["short", "mend", "gate", "phase", "close", "contactor", "closed",
                             "voltage", "drift", "generator", "lose", "restore", "sample", "events", "cancel"]
                            ), random.getrandbits(32)  # fmt: skip


def disturb(circuit, what, seed):
    random = Random(seed)
    now, line, number = circuit.now_ns, circuit.line, random.choice(sorted(WAYS))
    soon = now + random.randint(0, 3_000_000)
    actions = {
        "short": lambda: circuit.short_scr(number),
        "mend": lambda: circuit.short_scr(number, shorted=False),
        "gate": lambda: circuit.open_gate(number, is_open=random.random() < 0.5),
        "phase": lambda: circuit.open_phase(random.randrange(3)),
        "close": lambda: circuit.close_phase(random.randrange(3)),
        "contactor": circuit.open_contactor,
        "closed": circuit.close_contactor,
        "voltage": lambda: line.step_voltage(soon, random.choice([380.0, 480.0])),
        "drift": lambda: line.drift_frequency(soon, random.choice([57.0, 61.0]), 20.0),
        "generator": lambda: line.generator_transient(soon, 0.2, 2.0, 0.004, 0.01),
        "lose": lambda: line.lose_phase(soon, random.randrange(3)),
        "restore": lambda: line.restore_phase(soon, random.randrange(3)),
        "sample": circuit.sample,
        "events": circuit.take_events,
        "cancel": lambda: circuit.bridge.cancel(now),
    }
    if what in actions:
        actions[what]()
    else:
        for _ in range(4):
            on_ns = now + random.randint(0, 2_000_000)
            circuit.fire(on_ns, on_ns + random.choice([60_000, 2_777_778]), random.choice(sorted(WAYS)))


def seen(circuit):
    """All that an observer could tell two circuits apart by."""
    return json.dumps([circuit.state(), circuit.armature_v, circuit.phase_currents(), circuit.conducting])


@repeatable
@given(seed=st.integers(0, 10_000), kept=st.integers(0, 59))
def test_circuit_goes_on_bit_for_bit(seed, kept):
    """Run on, or make the circuit again and load what it was: everything that follows is the same, in every bit."""
    steps = list(disturbances(seed))
    first = made(seed)
    for number, (what, random) in enumerate(steps):
        if number == kept:
            text = json.dumps(first.state())
            break
        disturb(first, what, random)
        first.advance(first.now_ns + SLICE_NS)
    second = made(seed)
    second.restore(json.loads(text))
    assert seen(second) == seen(first)
    for what, random in steps[kept:]:
        for circuit in (first, second):
            disturb(circuit, what, random)
            circuit.advance(circuit.now_ns + SLICE_NS)
        assert seen(second) == seen(first)
    assert first.take_events() == second.take_events()
    assert [item.numbers() for item in first.pieces()] == [item.numbers() for item in second.pieces()]
    one, two = first.sample(), second.sample()
    assert (one.charge_c, one.volt_s, one.rms_current_a) == (two.charge_c, two.volt_s, two.rms_current_a)


def test_state_taken_in_the_middle_of_a_commutation_and_of_an_arc():
    def fresh():
        return Circuit(AcLine(460.0, inductance_h=140e-6, resistance_ohm=0.005), Bridge(), FixedLoad(0.3, 2e-3, 250.0))

    first = fresh()
    control = ConstantAlpha(first, 0.6)
    control.advance(40_000_000)
    modes = arcs = 0
    for number in range(400):
        first.advance(first.now_ns + 20_000) if number > 200 else control.advance(first.now_ns + 20_000)
        if number == 210:
            first.open_contactor()
        second = fresh()
        second.restore(first.state())
        modes += first._net.modes
        arcs += first.bridge.wiring.arcing
        for circuit in (first, second):
            circuit.advance(first.now_ns + 3_000 if circuit is first else first.now_ns)
        assert seen(second) == seen(first)
    assert modes > 10
    assert arcs


def test_controller_that_fires_goes_on():
    circuits = [Circuit(AcLine(460.0, inductance_h=60e-6), Bridge(), FixedLoad(0.3, 2e-3, 200.0)) for _ in range(2)]
    first = ConstantAlpha(circuits[0], 1.0)
    first.advance(33_333_333)
    first.alpha_rad = 0.7
    first.use_bridge(2)
    first.use_bridge(1)
    first.advance(51_234_567)
    circuits[1].restore(circuits[0].state())
    second = ConstantAlpha(circuits[1], 1.0)
    second.restore(json.loads(json.dumps(first.state())))
    for controller in (first, second):
        controller.advance(120_000_000)
    assert seen(circuits[0]) == seen(circuits[1])


@pytest.mark.parametrize("stiffness", [None, 5000.0])
def test_coupled_motors_go_on(stiffness):
    def pair():
        circuits = [
            Circuit(AcLine(460.0, inductance_h=60e-6), Bridge(), Motor(PARAMETERS.motor, speed_rad_s=speed))
            for speed in (100.0, 120.0)
        ]
        return circuits, Coupling(*circuits, stiffness_n_m_rad=stiffness, damping_n_m_s=10.0)

    def run(circuits, coupling, windows):
        for _ in range(windows):
            now = circuits[0].now_ns
            for circuit, numbers in zip(circuits, ((1, 6), (2, 3)), strict=True):
                circuit.fire(now, now + 60_000, *numbers)
            coupling.advance(now + 2_777_778)

    first, shaft = pair()
    run(first, shaft, 40)
    second, other = pair()
    for before, after in zip((*first, shaft), (*second, other), strict=True):
        after.restore(json.loads(json.dumps(before.state())))
    for circuits, coupling in ((first, shaft), (second, other)):
        run(circuits, coupling, 40)
    assert [seen(circuit) for circuit in first] == [seen(circuit) for circuit in second]
    assert shaft.state() == other.state()


@pytest.mark.parametrize(
    "make", [lambda: Tachometer(50.0, noise_v=0.1, seed=5), lambda: Resolver(noise_rad=0.01, seed=5)]
)
@pytest.mark.parametrize("readings", [0, 1, 7])
def test_noise_goes_on(make, readings):
    """An odd count too: gaussian noise comes in pairs, of which the second is kept."""
    first = make()
    for number in range(readings):
        first.read(number * 0.1)
    second = make()
    second.restore(json.loads(json.dumps(first.state())))
    assert [first.read(number * pi) for number in range(20)] == [second.read(number * pi) for number in range(20)]
    first.lost = True
    second.restore(first.state())
    assert second.lost
    assert first.read(2.0) == second.read(2.0)


def test_state_of_something_else_is_refused():
    circuit = made(1)
    state = circuit.state()
    with pytest.raises(ParameterError, match="not the state of a circuit"):
        circuit.restore({})
    with pytest.raises(ParameterError, match="not the state of a line"):
        circuit.restore(state | {"line": {}})
    with pytest.raises(ParameterError, match="not the state of a bridge"):
        circuit.restore(state | {"bridge": state["line"]})
    with pytest.raises(ParameterError, match="not the state of a sensor"):
        Tachometer(50.0).restore(Resolver().state())
    with pytest.raises(ParameterError, match="another choice of energy"):
        circuit.restore(state | {"energy": None if state["energy"] else {}})
    with pytest.raises(ParameterError, match="another field or another kind of load"):
        Motor(PARAMETERS.motor).restore(Motor(PARAMETERS.motor, field=FieldWinding()).state())
