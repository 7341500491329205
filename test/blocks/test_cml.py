"""DC_DRIVE_CML: what its declaration says, against table 1 of the manual and what the loop takes and gives."""

from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from automax_ros.blocks.catalogue import CATALOGUE
from automax_ros.blocks.cml import LIMITS, ioc_is_possible, is_good, ref_lag_limits, ref_rate_limits
from automax_ros.core.numbers import stored_real
from automax_ros.core.types import DataType
from automax_ros.drive.current_loop.inputs import INPUTS
from automax_ros.drive.current_loop.outputs import OUTPUTS
from blocks.support import repeatable

BLOCK = CATALOGUE["DC_DRIVE_CML"]
TABLE_1 = """\
IO_CNTL_SLOT     %  0        15     None
DIG_IO_SLOT      %  0        15     None
AC_LINE_FREQ     %  48       62     60
REFERENCE        %  -        -      None
REF_RATE         .  -        -      0.0
REF_LAG          .  -        -      200.0
KP               .  0.0      4.0    None
PI_W_LEAD        .  10.0     500.0  None
AG_FACTOR        %  1        300    1
CC_THRESH        %  0        32767  0
CML_RUN          @  -        -      None
MAX_M_DROPOUT    .  0.1      1.0    0.1
CML_COAST_STOP   @  -        -      False
MCR_SELECT       @  -        -      False
CML_TEST         @  -        -      False
TEST_BRPOL       @  -        -      False
TEST_ALPHA       %  0        180    180
IOC_THRESH       %  100      400    None
LIM_BAR          %  100      400    None
SPEED_FDBK       %  -        -      absent
DIGITAL_TACH     @  -        -      True
TACH_LOSS_STOP   @  -        -      True
OSV_FDBK         %  -        -      absent
OSV_THRESH       %  0        32767  0
NONSTAND_PHROT   @  -        -      False
AUTO_PHROT       @  -        -      False
FAULT_RESET      @  -        -      None
"""
"""As printed: name, type, lowest and highest value, default. Those of REFERENCE are not enforced, by 52.1.2; the two
that follow the line have a test of their own."""
TYPES = {"%": DataType.INTEGER, "@": DataType.BOOLEAN, ".": DataType.REAL}
ROWS = [row.split() for row in TABLE_1.splitlines()]


def test_inputs_and_outputs_are_those_of_the_loop_in_its_order():
    assert tuple(item.name for item in BLOCK.inputs) == INPUTS
    assert tuple(item.name for item in BLOCK.outputs) == (*OUTPUTS, "DIAG_DATA")


def test_every_input_has_its_row():
    assert sorted(row[0] for row in ROWS) == sorted(INPUTS)


@pytest.mark.parametrize(("name", "mark", "low", "high", "default"), ROWS)
def test_inputs_are_those_of_table_1(name, mark, low, high, default):
    item = BLOCK.parameter(name)
    assert item.type is TYPES[mark]
    assert [str(item.low), str(item.high)] == [low.replace("-", "None"), high.replace("-", "None")]
    assert str(item.default) == default.replace("absent", "None")
    assert item.required == (default == "None")
    assert (name in LIMITS) == (low != "-")


def test_outputs_are_optional_and_diag_data_is_38_by_2():
    assert not any(item.required for item in BLOCK.outputs)
    assert [(item.name, item.dimensions) for item in BLOCK.outputs if item.dimensions] == [("DIAG_DATA", (38, 2))]
    assert [(item.name, item.alias) for item in BLOCK.outputs if item.alias] == [("INFAULT_RESET", "INFALT_RESET")]
    assert BLOCK.parameter("INFALT_RESET") is BLOCK.parameter("INFAULT_RESET")


def test_slots_name_their_modules():
    assert {item.name: item.module for item in BLOCK.inputs if item.module} == {
        "IO_CNTL_SLOT": "57C406",
        "DIG_IO_SLOT": "57C408",
    }


def test_rate_limits_are_those_that_the_manual_prints():
    assert ref_rate_limits(60) == (0.00035, 11.37)
    assert ref_rate_limits(50) == (0.00042, 13.65)
    assert ref_lag_limits(60) == (1.0, 500.0)
    assert ref_lag_limits(50) == (1.0, 400.0)


@repeatable
@given(st.floats(48, 62))
def test_at_the_limits_the_rate_is_1_to_32767_counts_a_scan(hz):
    """RATE = LIM_BAR / INPUT x sec / scan, with 4095 counts of LIM_BAR (52.1.2); the limits are rounded inward."""
    low, high = ref_rate_limits(hz)
    fastest, slowest = (4095 / limit / (6 * hz) for limit in (low, high))
    assert 32767 * 0.97 < fastest <= 32767
    assert slowest * (1 + 1e-12) >= 1
    assert slowest < 1.001
    assert is_good("REF_RATE", low, hz)
    assert is_good("REF_RATE", high, hz)
    assert not is_good("REF_RATE", low * 0.999, hz)
    assert not is_good("REF_RATE", high * 1.001, hz)
    assert is_good("REF_RATE", 0.0, hz)
    assert not is_good("REF_RATE", -low, hz)


@pytest.mark.parametrize("name", LIMITS)
def test_a_real_that_holds_a_limit_is_good(name):
    low, high = LIMITS[name]
    assert all(is_good(name, stored_real(float(limit))[0], 60) for limit in (low, high))
    assert not is_good(name, low - 0.001, 60)
    assert not is_good(name, high + 0.001, 60)


@repeatable
@given(st.integers(100, 400), st.integers(100, 400))
def test_overcurrent_is_less_than_1_8_lim_bar_exactly(ioc, bar):
    assert ioc_is_possible(ioc, bar) == (Fraction(ioc) < Fraction(18, 10) * bar)
