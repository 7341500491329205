"""The loop as a whole: acceptance of drive.md's first numbers, and a state that goes on bit for bit."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from automax_ros.drive.base.state import Stateful
from automax_ros.drive.current_loop.minor_loop import NUMBERS, CurrentMinorLoop
from automax_ros.drive.current_loop.signals import EXTERNAL_TRIP, PERMISSIVE, RESET_SWITCH, SWITCH_A, SWITCH_B
from drive.current_loop.protected import LOCKED_S, Drive, inputs
from drive.support import repeatable


def test_line_period_is_the_lines():
    drive = Drive()
    drive.run(LOCKED_S)
    assert drive["LINE_PERIOD"] == 16667


@pytest.mark.parametrize("reference", [300, 1500, -1500, 3500])
def test_outputs_stay_in_their_ranges(reference):
    drive = Drive(reference=reference).start()
    drive.run(0.5)
    for _, row in drive.rows:
        assert 0 <= row["DC_TIME"] <= 2778
        assert 0 <= row["DELTA"] <= 8333
        assert row["FDBK_GAIN"] == 0 or 512 <= row["FDBK_GAIN"] <= 1280
        assert abs(row["I_FDBK"]) <= 10238
        assert 0 <= row["INTEGRAL_GAIN"] <= 32767
    assert drive["BRIDGE_POL"] == (reference < 0)


@pytest.mark.parametrize(("bit", "shown"), [(SWITCH_A, "INSWITCH_POSA"), (SWITCH_B, "INSWITCH_POSB"),
                                            (RESET_SWITCH, "INFAULT_RESET")])  # fmt: skip
def test_switches_are_shown_and_do_nothing(bit, shown):
    switches = ("INSWITCH_POSA", "INSWITCH_POSB", "INFAULT_RESET")
    drive = Drive(osv_fdbk=1)
    drive.run(0.1)
    drive.run(0.02, osv_fdbk=0)
    drive.status |= bit
    drive.run(0.02)
    assert {name for name in switches if drive[name]} == {shown}
    assert drive.faults == {"OSV_OUT"}
    drive.status = PERMISSIVE
    drive.run(0.02)
    assert not any(drive[name] for name in switches)


def test_the_first_scan_says_that_the_task_was_initialised():
    drive = Drive()
    assert [drive.scan().initialised for _ in range(3)] == [True, False, False]
    drive.loop.restart()
    assert [drive.scan().initialised for _ in range(2)] == [True, False]


def test_the_command_carries_the_ioc_level():
    drive = Drive(ioc_thresh=177)
    assert drive.scan().command.level == 177


STEPS = st.lists(
    st.sampled_from(
        [
            {"cml_run": True}, {"cml_run": False}, {"reference": 2500}, {"reference": -2500}, {"reference": 0},
            {"cml_coast_stop": True}, {"cml_coast_stop": False}, {"fault_reset": True}, {"fault_reset": False},
            {"kp": 7.0}, {"kp": 0.4}, {"ref_rate": 0.5}, {"ref_rate": -1.0}, {"cml_test": True}, {"test_alpha": 100},
            {"test_alpha": 999}, {"osv_fdbk": 4}, {"osv_fdbk": 0}, {"speed_fdbk": 0}, {"speed_fdbk": 4000},
            {"cc_thresh": -1}, {"test_brpol": True}, {"nonstand_phrot": True}, {"nonstand_phrot": False},
        ]
    ),
    min_size=4,
    max_size=30,
)  # fmt: skip


@repeatable
@given(
    steps=STEPS, statuses=st.lists(st.sampled_from([PERMISSIVE] * 6 + [0, PERMISSIVE | EXTERNAL_TRIP]), min_size=30,
                                   max_size=30),
    options=st.integers(0, 3), tests_scrs=st.booleans(), short=st.sampled_from([None, 3, 14]),
    length=st.integers(3, 60), cut=st.floats(0, 1),
)  # fmt: skip
def test_a_loop_that_took_over_goes_on_bit_for_bit(steps, statuses, options, tests_scrs, short, length, cut):
    drive = Drive(tests_scrs=tests_scrs)
    drive.registers = (109, 4, 2, options)
    drive.run(0.3)
    drive.run(0.12, cml_run=True, reference=1200)
    if short:
        drive.plant.circuit.short_scr(short)
    total, done, other = len(steps) * length, 0, None
    for step, status in zip(steps, statuses, strict=False):
        drive.inputs = drive.inputs._replace(**step)
        drive.status = status
        for _ in range(length):
            if done == int(cut * (total - 1)):
                other = CurrentMinorLoop(tests_scrs=tests_scrs)
                other.scan(7, drive.hardware.measure(drive.now_ns), inputs(cml_run=True, kp=-1.0))
                other.take(drive.loop.numbers())
            done += 1
            now_ns, status_now = drive.now_ns, drive.status
            measured = drive.hardware.measure(now_ns, status_now, drive.registers)
            outcome = drive.loop.scan(now_ns, measured, drive.inputs)
            if other is not None:
                assert other.scan(now_ns, measured, drive.inputs) == outcome
                assert other.numbers() == drive.loop.numbers()
            drive.hardware.command(outcome.command, now_ns)
            drive.now_ns += outcome.command.next_ns


def test_the_numbers_are_always_as_many_and_finite():
    drive = Drive(tests_scrs=True)
    for changes in ({}, {"cml_run": True}, {"reference": 3000}, {"osv_fdbk": 1}):
        drive.run(0.3, **changes)
        numbers = drive.loop.numbers()
        assert len(numbers) == NUMBERS
        assert all(type(number) is float and math.isfinite(number) for number in numbers)
    with pytest.raises(ValueError, match=f"has {NUMBERS} numbers, not {NUMBERS - 1}"):
        drive.loop.take(drive.loop.numbers()[1:])


def test_taking_over_does_not_change_types():
    """A number that was an int goes on as one: outputs are whole numbers, booleans stay booleans."""
    drive = Drive(reference=900).start()
    other = CurrentMinorLoop()
    other.take(drive.loop.numbers())
    for mine, its in zip(drive.loop.outputs.row(), other.outputs.row(), strict=True):
        assert type(mine) is type(its)
    assert type(other.sequence.phase) is type(drive.loop.sequence.phase)


def everything(thing):
    """All attributes of a loop and its parts, by type and name, as deep as they go."""
    found = {}
    names = vars(thing) if hasattr(thing, "__dict__") else type(thing).__mypyc_attrs__
    for name, value in ((name, getattr(thing, name)) for name in names):
        if isinstance(value, Stateful):
            found |= everything(value)
        elif not isinstance(value, tuple) or not any(isinstance(item, Stateful) for item in value):
            found[type(thing).__name__, name] = value
    return found


@pytest.mark.parametrize("short", [None, 3])
def test_nothing_that_a_scan_leaves_is_forgotten(short):
    """At every scan of a start with its test, a run, a trip and a reset: a loop that took over is the same inside."""
    drive = Drive(tests_scrs=True, kp=9.0, speed_fdbk=0, reference=1500)
    drive.plant.motor.speed_rad_s = 100.0
    drive.registers = (109, 4, 2, 3)
    if short:
        drive.plant.circuit.short_scr(short)
    steps = [{}, {"cml_run": True}, {"kp": 0.3, "ref_rate": 0.3}, {"osv_fdbk": 1}, {"osv_fdbk": 0, "fault_reset": True}]
    for step in steps:
        drive.inputs = drive.inputs._replace(**step)
        for _ in range(140):
            drive.scan()
            other = CurrentMinorLoop(tests_scrs=True)
            other.take(drive.loop.numbers())
            assert everything(other) == everything(drive.loop)
    assert "AMX7113" in drive.codes
