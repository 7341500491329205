"""What the tests of the drive share: circuits, firing plans, and an independent integration to compare with."""

from math import pi, radians

from hypothesis import settings

from automax_ros.drive.base.motor import FixedLoad
from automax_ros.drive.circuit.ac_line import AcLine
from automax_ros.drive.circuit.bridge import Bridge
from automax_ros.drive.circuit.circuit import Circuit
from drive.switched import LATER, WAYS, Switched

repeatable = settings(deadline=None, derandomize=True, database=None)
V_LL = 460.0


def circuit_of(ls=60e-6, rs=0.005, r=0.3, l=2e-3, emf=0.0, *, v_ll=V_LL, turn_off_s=0.0, drop_v=0.0, **options):  # noqa: E741
    line = AcLine(v_ll, inductance_h=ls, resistance_ohm=rs)
    return Circuit(line, Bridge(turn_off_s=turn_off_s, drop_v=drop_v), FixedLoad(r, l, emf), **options)


def natural(number):
    """The line angle of natural commutation of an SCR on a line that rotates a, b, c, from the oracle's own table."""
    start, end = WAYS[number]
    return LATER[start] - pi / 3 if start in LATER else LATER[end] - pi / 3 + pi


def plan(alphas_deg, *, bridge=1, first_window=6, hertz=60.0, width_deg=60.0):
    """Double pulses, one in each window of 60 degrees from a number of windows after time 0: (on, off, SCR), ns."""
    gates = []
    for window, alpha in enumerate(alphas_deg, first_window):
        number = window % 6 + 1
        angle = window * pi / 3 - pi / 3 + radians(alpha)
        assert abs((natural(number) - (window * pi / 3 - pi / 3) + pi) % (2 * pi) - pi) < 1e-9
        on = round(angle / (2 * pi * hertz) * 1e9)
        off = on + round(radians(width_deg) / (2 * pi * hertz) * 1e9)
        shift = 0 if bridge == 1 else 10
        gates += [(on, off, number + shift), (on, off, (number - 2) % 6 + 1 + shift)]
    return gates


def fire_all(circuit, gates):
    for on, off, number in gates:
        circuit.fire(on, off, number)


def oracle_of(circuit, **options):
    """The independent integration of the same circuit."""
    z = circuit.machine
    line = circuit.line
    return Switched(line.v_ll_v, line.inductance_h, line.resistance_ohm, z.resistance_ohm, z.inductance_h,
                    z.emf_v, **options)  # fmt: skip


def oracle_gates(gates):
    return [(on * 1e-9, off * 1e-9, number) for on, off, number in gates]


def currents_at(circuit, times_ns):
    """Advance and return the armature current at instants."""
    found = []
    for time in times_ns:
        circuit.advance(time)
        found.append(circuit.current_a)
    return found
