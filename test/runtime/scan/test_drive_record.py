"""What a record keeps of a drive: it comes back as it was, and takes few numbers."""

from __future__ import annotations

from compile.support import repeatable
from hypothesis import given
from hypothesis import strategies as st

from automax_ros.core.types import DataType
from automax_ros.drive.current_loop.signals import Command, Measured, Pulse
from automax_ros.runtime.scan.channels import CHANNEL_VIEWS
from automax_ros.runtime.scan.drive_record import (
    COMMAND_NUMBERS,
    COMMAND_VIEW,
    MEASURED_NUMBERS,
    MEASURED_VIEW,
    MOST_PULSES,
    command_of,
    measured_of,
    noted_command,
    noted_measured,
    noted_time,
    time_of,
)

NUMBER = st.integers(*DataType.DOUBLE.range)
USUAL = st.sampled_from([0, 2, 4, 109, 400]) | NUMBER
PULSES = st.lists(st.builds(Pulse, NUMBER, NUMBER, st.integers(0, 0x3F3F)), max_size=MOST_PULSES).map(tuple)


@given(st.tuples(*[USUAL] * len(Measured._fields)).map(lambda numbers: Measured(*numbers)))
@repeatable(200)
def test_measurement_comes_back(measured):
    noted = noted_measured(measured)
    assert measured_of([(COMMAND_VIEW, 0, 5), *noted, (3, 0, 1)]) == measured
    assert all(
        view == MEASURED_VIEW and 0 <= element < len(Measured._fields) < MEASURED_NUMBERS for view, element, _ in noted
    )


@given(NUMBER, st.integers(0, 3), PULSES, USUAL, st.booleans())
@repeatable(200)
def test_command_comes_back(next_ns, relays, pulses, level, block):
    command = Command(next_ns, relays, pulses, level, block)
    noted = noted_command(command)
    found = command_of([(MEASURED_VIEW, 0, 5), *noted])
    # A last pulse of nothing but zeros is none: it neither begins nor ends.
    kept = pulses[:-1] if pulses and pulses[-1] == (0, 0, 0) else pulses
    while kept and kept[-1] == (0, 0, 0):
        kept = kept[:-1]
    assert found == command._replace(pulses=kept)
    assert [type(item) for item in found] == [type(item) for item in command]
    assert all(0 <= element < COMMAND_NUMBERS for _, element, _ in noted)


@given(st.integers(0, 10**18))
@repeatable(100)
def test_time_comes_back(now_ns):
    noted = noted_time(now_ns)
    assert time_of([*noted_measured(Measured(9)), *noted]) == now_ns
    assert measured_of(noted) is None
    assert all(value in range(-(2**31), 2**31) for *_, value in noted)


def test_usual_numbers_are_left_out():
    assert noted_measured(Measured(9)) == [(MEASURED_VIEW, 0, 9)]
    assert noted_measured(Measured(0, 7, options=1)) == [
        (MEASURED_VIEW, 0, 0),
        (MEASURED_VIEW, 1, 7),
        (MEASURED_VIEW, 9, 1),
    ]
    assert noted_command(Command(2_777_778)) == [(COMMAND_VIEW, 0, 2_777_778)]
    assert measured_of([]) is None
    assert command_of([]) is None
    assert time_of([]) is None


def test_views_are_nobody_elses():
    assert len({MEASURED_VIEW, COMMAND_VIEW, *CHANNEL_VIEWS.values()}) == 2 + len(CHANNEL_VIEWS)
