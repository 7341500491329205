"""The layout of a task's state: names, roles, hash, flat values."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from automax_ros.compile.base.layout import Layout, Role, StateField
from automax_ros.core.types import DataType
from compile.support import compiled_of, lines, repeatable, task_of

BASE = {
    "declare": "LOCAL A%, R, S$:10, T%(2,3), G [CURRENT=1.0, HIGH=9.0, LOW=0.0]",
    "statements": (
        "A% = A% + 1",
        "CALL RAMP(INPUT=A%, ACCEL_RATE=5, OUTPUT=A%)",
        "CALL LAG(INPUT=A%, WLG=R, OUTPUT=A%)",
    ),
}


def hash_of(statements=BASE["statements"], declare=BASE["declare"]) -> str:
    return compiled_of(lines(*statements, declare=declare)).layout.hash


@pytest.mark.parametrize(
    "declare",
    [
        "LOCAL A%, R, S$:10, T%(2,3)",
        "LOCAL A%, R, S$:10, T%(2,3), G [CURRENT=1.0, HIGH=9.0, LOW=0.0], NEW%",
        "LOCAL A%, R, S$:10, T%(2,4), G [CURRENT=1.0, HIGH=9.0, LOW=0.0]",
        "LOCAL A%, R, S$:10, T%(3,2), G [CURRENT=1.0, HIGH=9.0, LOW=0.0]",
        "LOCAL A%, R, S$:11, T%(2,3), G [CURRENT=1.0, HIGH=9.0, LOW=0.0]",
        "LOCAL A%, R, S$:10, T!(2,3), G [CURRENT=1.0, HIGH=9.0, LOW=0.0]",
        "LOCAL A%, R, S$:10, T%(2,3), G",
        "LOCAL R, A%, S$:10, T%(2,3), G [CURRENT=1.0, HIGH=9.0, LOW=0.0]",
        "LOCAL A%, R, S$:10, T%(2,3), G(0)",
    ],
)
def test_the_hash_changes_with_a_variable(declare):
    assert hash_of(declare=declare) != hash_of()


@pytest.mark.parametrize(
    "statements",
    [
        BASE["statements"][:2],
        (*BASE["statements"], "CALL TRANSITION(INPUT=X@, OUTPUT=X@)"),
        ("REM", *BASE["statements"]),
        (BASE["statements"][0], BASE["statements"][2], BASE["statements"][1]),
        (*BASE["statements"][:2], "CALL LAG(INPUT=A%, WLG=2.0, OUTPUT=A%)"),
        (*BASE["statements"], "FOR A% = 1 TO T%(1,1) \\ NEXT A%"),
        (*BASE["statements"], "READ A% \\ DATA 1"),
    ],
)
def test_the_hash_changes_with_a_block_or_a_stack(statements):
    declare = BASE["declare"] + ", X@"
    assert hash_of(statements, declare) != hash_of(declare=declare)


@pytest.mark.parametrize(
    "statements",
    [
        ("A% = A% * 7", *BASE["statements"][1:]),
        (BASE["statements"][0], "CALL RAMP(INPUT=A%, ACCEL_RATE=6, DECEL_RATE=3, OUTPUT=A%)", BASE["statements"][2]),
        (*BASE["statements"], "PRINT A%", "IF A% > 0 THEN A% = 0"),
    ],
)
def test_the_hash_does_not_change_otherwise(statements):
    assert hash_of(statements) == hash_of()


def test_the_hash_does_not_depend_on_tuning_or_the_commons():
    assert hash_of(declare=BASE["declare"].replace("CURRENT=1.0", "CURRENT=2.0")) == hash_of()
    assert hash_of(declare=BASE["declare"] + " \\ COMMON K%") == hash_of()


def test_fields_are_named_after_variables_and_blocks():
    layout = compiled_of(lines(*BASE["statements"], declare=BASE["declare"])).layout
    roles = {field.name: field.role for field in layout.fields}
    assert roles["A%"] is roles["T%"] is Role.LOCAL
    assert (roles["G"], roles["40 RAMP.register"], roles["50 LAG.y1"]) == (Role.TUNABLE, Role.BLOCK, Role.BLOCK)
    assert {"50 LAG.seen_wlg", "50 LAG.gain", "50 LAG.limited"} <= set(roles)
    assert layout.index("R") == 1
    with pytest.raises(KeyError):
        layout.index("NONE")


def test_installation_gives_zero_and_current():
    """2.4.5."""
    task, _ = task_of(lines(*BASE["statements"], declare=BASE["declare"]))
    assert [task.value(name) for name in ("A%", "R", "S$", "T%", "G")] == [0, 0.0, "", [0] * 12, 1.0]


VALUES = {
    DataType.INTEGER: st.integers(-32768, 32767),
    DataType.DOUBLE: st.integers(-(2**31), 2**31 - 1),
    DataType.REAL: st.floats(width=32, allow_infinity=False, allow_nan=False),
    DataType.BOOLEAN: st.booleans(),
    DataType.STRING: st.text(max_size=5),
}


@st.composite
def layouts(draw) -> tuple[Layout, list]:
    fields, state = [], []
    for number in range(draw(st.integers(0, 6))):
        kind = draw(st.sampled_from(list(DataType)))
        size = draw(st.integers(1, 3))
        is_array = draw(st.booleans())
        role = draw(st.sampled_from([Role.LOCAL, Role.BLOCK]))
        length = 5 if kind is DataType.STRING else 0
        fields.append(StateField(f"F{number}", kind, role, kind.zero, size if is_array else 1, is_array, length=length))
        state.append(draw(st.lists(VALUES[kind], min_size=size, max_size=size)) if is_array else draw(VALUES[kind]))
    return Layout(tuple(fields)), state


@given(layouts())
@repeatable(150)
def test_flat_values_bring_the_state_back(made):
    layout, state = made
    flat = layout.flatten(state)
    assert all(not isinstance(value, list) for value in flat)
    restored = layout.restore(flat)
    assert restored == state
    assert list(map(type, layout.flatten(restored))) == list(map(type, flat))
    with pytest.raises(ValueError, match="does not fit"):
        layout.restore([*flat, 0])


@pytest.mark.parametrize(
    ("kind", "role", "value"),
    [
        (DataType.INTEGER, Role.LOCAL, 32768),
        (DataType.INTEGER, Role.TUNABLE, -32769),
        (DataType.DOUBLE, Role.LOCAL, 2**31),
        (DataType.INTEGER, Role.LOCAL, math.nan),
        (DataType.INTEGER, Role.BLOCK, math.inf),
        (DataType.INTEGER, Role.LOCAL, "5"),
        (DataType.REAL, Role.LOCAL, "5"),
        (DataType.STRING, Role.LOCAL, "TOO LONG"),
        (DataType.STRING, Role.LOCAL, 5),
    ],
)
def test_values_that_a_field_cannot_hold_are_refused(kind, role, value):
    """A snapshot comes from a bag, which nobody vouches for."""
    with pytest.raises(ValueError, match="cannot be"):
        Layout((StateField("F", kind, role, kind.zero, length=4),)).restore([value])


def test_a_blocks_state_may_be_wider_than_its_type():
    layout = Layout((StateField("30 PULSE_MULT.remainder", DataType.INTEGER, Role.BLOCK, 0),))
    assert layout.restore([2**40]) == [2**40]


BUFFERS = """10 LOCAL A%, B%, C%, X@
20 CALL SCAN_LOOP(TICKS=4)
30 CALL SHIFT_WORDS(STRUCTURE_NAME=QUEUE%, MAX_COLUMNS=3, SHIFT=TRUE, INPUT1=A%, OUTPUT1=B%)
40 CALL RUNNING_AVERAGE(REQUIRED_SAMPLES=4, INPUT=A%, OUTPUT=C%)
50 DATA 1, 2
60 READ A%
70 RESTORE
80 END
"""


@pytest.mark.parametrize(
    ("name", "highest"),
    [
        ("QUEUE%.head", 2),
        ("QUEUE%.loaded", 3),
        ("40 RUNNING_AVERAGE.position", 3),
        ("40 RUNNING_AVERAGE.taken", 4),
        ("DATA.pointer", 2),
    ],
)
def test_a_snapshot_with_a_place_outside_of_its_buffer_is_refused(name, highest):
    """A snapshot comes from a bag, which anybody may have written: no scan may fail on it."""
    task, _ = task_of(BUFFERS)
    task.run()
    task.scan(1)
    layout = task.compiled.layout
    at = sum(field.size for field in layout.fields[: layout.index(name)])
    good = task.snapshot()
    for value in (0, highest):
        task.restore([*good[:at], value, *good[at + 1 :]])
        task.scan(2)
    for value in (-1, highest + 1, 99999):
        with pytest.raises(ValueError, match=f"it is 0 to {highest}"):
            task.restore([*good[:at], value, *good[at + 1 :]])
