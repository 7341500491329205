"""Tasks in which SHIFT, READ and WRITE blocks share data structures (sections 23, 24, 30, 31, 39 and 40)."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from compile.support import OTHER, logged, repeatable, run_scans, scan_in_steps, task_of

NO_SUCH_COLUMN = 7005


class Columns:
    """A data structure as a list of columns that really moves."""

    def __init__(self, columns, channels, zero):
        self.empty = (zero,) * channels
        self.columns = [self.empty] * columns
        self.shifts = 0


class Shift:
    """A SHIFT block: its statement, and what it does to a dictionary of variables."""

    def __init__(self, structure, columns, names, inputs, outputs, valid):
        self.structure, self.columns, self.names = structure, columns, names
        self.inputs, self.outputs, self.valid = inputs, outputs, valid

    def text(self):
        reset, shift, enable = self.names
        channels = [f"INPUT{number}={name}" for number, name in enumerate(self.inputs, 1)]
        channels += [f"OUTPUT{number}={name}" for number, name in enumerate(self.outputs, 1)]
        return (
            f"CALL SHIFT_{kind_of(self.structure)}(STRUCTURE_NAME={self.structure}, MAX_COLUMNS={self.columns},"
            f" RESET={reset}, SHIFT={shift}, ENABLE={enable}, DATA_VALID={self.valid}, {', '.join(channels)})"
        )

    def act(self, env, made):
        reset, shift, enable = (env[name] for name in self.names)
        if reset:
            made.columns, made.shifts = [made.empty] * self.columns, 0
        elif shift:
            entering = tuple(env[name] for name in self.inputs) if enable else made.empty
            made.columns, made.shifts = [entering, *made.columns[:-1]], made.shifts + 1
        if reset or shift:
            env.update(zip(self.outputs, made.columns[-1], strict=True))
        env[self.valid] = made.shifts >= self.columns
        return False


class Read:
    """A READ block of some channels."""

    def __init__(self, structure, column, enable, error, outputs):
        self.structure, self.column, self.enable, self.error, self.outputs = structure, column, enable, error, outputs

    def text(self):
        channels = ", ".join(f"OUTPUT{number}={name}" for number, name in self.outputs.items())
        return (
            f"CALL READ_{kind_of(self.structure)}(STRUCTURE_NAME={self.structure}, COLUMN={self.column},"
            f" ENABLE={self.enable}, ERROR={self.error}, {channels})"
        )

    def act(self, env, made):
        missing = env[self.enable] and not 0 <= env[self.column] < len(made.columns)
        if env[self.enable]:
            column = made.empty if missing else made.columns[env[self.column]]
            env.update({name: column[number - 1] for number, name in self.outputs.items()})
        env[self.error] = missing
        return missing


class Write:
    """A WRITE block of some channels."""

    def __init__(self, structure, column, enable, error, inputs):
        self.structure, self.column, self.enable, self.error, self.inputs = structure, column, enable, error, inputs

    def text(self):
        channels = ", ".join(f"INPUT{number}={name}" for number, name in self.inputs.items())
        return (
            f"CALL WRITE_{kind_of(self.structure)}(STRUCTURE_NAME={self.structure}, COLUMN={self.column},"
            f" ENABLE={self.enable}, {channels}, ERROR={self.error})"
        )

    def act(self, env, made):
        number, enabled = env[self.column], env[self.enable]
        missing = enabled and not 0 <= number < len(made.columns)
        if enabled and not missing and number < made.shifts:
            column = list(made.columns[number])
            for channel, name in self.inputs.items():
                column[channel - 1] = env[name]
            made.columns[number] = tuple(column)
        env[self.error] = enabled and (missing or number >= made.shifts)
        return missing


def kind_of(structure):
    return "BITS" if structure.endswith("@") else "WORDS"


BLOCKS = [
    Shift("PARTS%", 3, ("CLEAR@", "GO@", "FILL@"), ("IN1%", "IN2%"), ("OUT%", "L%"), "FULL@"),
    Shift("MARKS@", 2, ("CLEAR@", "STEP@", "TRUE"), ("IN1@", "IN2@", "IN3@"), ("OUT@", "M@(1)", "L@"), "L1@"),
    Read("PARTS%", "COL1%", "GET@", "ER1@", {2: "SEEN%"}),
    Read("PARTS%", "COL2%", "TRUE", "L2@", {2: "T%(2)", 1: "T%(0)"}),
    Read("MARKS@", "COL1%", "GET@", "L3@", {1: "L4@", 3: "M@(0)"}),
    Write("PARTS%", "COL3%", "PUT@", "ER2@", {1: "IN3%"}),
    Write("PARTS%", "COL1%", "PUT@", "L5@", {2: "IN2%", 1: "T%(3)"}),
    Write("MARKS@", "COL3%", "PUT@", "L6@", {2: "IN3@", 3: "IN1@"}),
]
INTEGERS = ("IN1%", "IN2%", "IN3%", "OUT%", "SEEN%")
COLUMNS = ("COL1%", "COL2%", "COL3%")
BOOLEANS = ("CLEAR@", "GO@", "STEP@", "FILL@", "GET@", "PUT@", "IN1@", "IN2@", "IN3@", "OUT@", "FULL@", "ER1@", "ER2@")
COMMONS = (*INTEGERS, *COLUMNS, *BOOLEANS)
LOCALS = ("L%", "L@", "L1@", "L2@", "L3@", "L4@", "L5@", "L6@")
ELEMENTS = ("T%(0)", "T%(2)", "T%(3)", "M@(0)", "M@(1)")
DECLARED = f"10 LOCAL {', '.join(LOCALS)}, M@(2)\n11 COMMON {', '.join(COMMONS)}, T%(4)\n20 CALL SCAN_LOOP(TICKS=4)\n"


def values_of(task, memory):
    """All variables of the task by name, elements too."""
    found = {name: memory.read_now(memory.view(name)) for name in COMMONS}
    found.update({name: task.value(name) for name in LOCALS})
    found.update({f"T%({index})": memory.read_now(memory.view("T%"), index) for index in (0, 2, 3)})
    found.update({f"M@({index})": task.value("M@")[index] for index in (0, 1)})
    return found


def settings_of_a_scan():
    """What other writers set before a scan, inputs and outputs alike."""
    return st.fixed_dictionaries(
        {"GO@": st.sampled_from([True, True, False]), "CLEAR@": st.integers(0, 11).map(lambda number: number == 0)},
        optional={
            **{name: st.integers(-32768, 32767) for name in INTEGERS},
            **{name: st.integers(-1, 3) | st.sampled_from([-32768, 32767]) for name in COLUMNS},
            **{name: st.booleans() for name in BOOLEANS if name not in ("GO@", "CLEAR@")},
        },
    )


@repeatable(60)
@given(st.permutations(BLOCKS), st.lists(settings_of_a_scan(), min_size=1, max_size=14), st.booleans())
def test_any_order_of_blocks_against_lists_of_columns(blocks, scans, in_steps):
    lines = "".join(f"{100 + 10 * number} {block.text()}\n" for number, block in enumerate(blocks))
    task, memory = task_of(f"{DECLARED}{lines}900 END\n")
    task.record_scans()
    task.run()
    made = {"PARTS%": Columns(3, 2, 0), "MARKS@": Columns(2, 3, False)}
    env = {**values_of(task, memory), "TRUE": True}
    for number, settings in enumerate(scans, 1):
        for name, value in settings.items():
            memory.write_from_outside(memory.view(name), value, OTHER)
        env.update(settings)
        missing = [
            (100 + 10 * place, NO_SUCH_COLUMN)
            for place, block in enumerate(blocks)
            if block.act(env, made[block.structure])
        ]
        before = task.errors.count
        if in_steps:
            scan_in_steps(task, number * task.period_ns)
        else:
            assert task.scan(number * task.period_ns).errors == missing
        assert task.errors.count - before == len(missing)
        assert {**values_of(task, memory), "TRUE": True} == env


QUEUE = """10 LOCAL N%, SEEN%, OUT%, VALID@, BAD@
11 COMMON CLEAR@, MOVE@, COL%
20 CALL SCAN_LOOP(TICKS=4)
30 CALL READ_WORDS(STRUCTURE_NAME=LINE%, COLUMN=COL%, ENABLE=TRUE, ERROR=BAD@, OUTPUT1=SEEN%)
40 N% = N% + 1
50 CALL SHIFT_WORDS(STRUCTURE_NAME=LINE%, MAX_COLUMNS=3, RESET=CLEAR@, SHIFT=MOVE@, INPUT1=N%, DATA_VALID=VALID@, &
     OUTPUT1=OUT%)
60 END
"""


def scanned(task, memory, count, *names):
    """The values of some variables after each of some scans."""
    found = []
    for _ in range(count):
        task.scan((task.scan_number + 1) * task.period_ns)
        found.append(tuple(task.value(name) for name in names))
    return found


def test_a_read_before_the_shift_in_the_text_sees_the_scan_before():
    task, memory = task_of(QUEUE, **{"MOVE@": True})
    task.run()
    assert scanned(task, memory, 5, "SEEN%", "OUT%") == [(0, 0), (1, 0), (2, 1), (3, 2), (4, 3)]


def test_columns_are_logged_at_the_line_of_the_call():
    task, _ = task_of(QUEUE, **{"COL%": 3})
    run_scans(task, 2)
    assert logged(task) == [(30, NO_SUCH_COLUMN)] * 2
    assert task.value("BAD@") is True


def test_run_again_starts_with_an_empty_structure():
    task, memory = task_of(QUEUE, **{"MOVE@": True})
    run_scans(task, 4)
    assert (task.value("OUT%"), task.value("VALID@")) == (2, True)
    task.stop()
    task.run()
    assert [row[1:] for row in scanned(task, memory, 3, "N%", "SEEN%", "VALID@")] == [(0, False), (5, False), (6, True)]
    assert task.value("OUT%") == 5


def test_a_task_that_only_ran_again_does_not_see_old_columns():
    task, memory = task_of(QUEUE, **{"MOVE@": True, "COL%": 2})
    run_scans(task, 5)
    assert task.value("SEEN%") == 2
    memory.write_from_outside(memory.view("MOVE@"), False, OTHER)
    task.stop()
    task.run()
    assert scanned(task, memory, 2, "SEEN%", "VALID@") == [(0, False)] * 2


@pytest.mark.parametrize("shifts", range(7))
def test_a_snapshot_carries_the_structure(shifts):
    task, memory = task_of(QUEUE, **{"MOVE@": True, "COL%": 1})
    run_scans(task, shifts)
    saved = task.snapshot()
    expected = scanned(task, memory, 5, "N%", "SEEN%", "OUT%", "VALID@")
    assert scanned(task, memory, 1, "OUT%") == [(shifts + 4,)]
    twin, its_memory = task_of(QUEUE, **{"MOVE@": True, "COL%": 1})
    twin.run()
    twin.restore(saved)
    assert twin.snapshot() == saved
    assert scanned(twin, its_memory, 5, "N%", "SEEN%", "OUT%", "VALID@") == expected
    task.restore(saved)
    assert scanned(task, memory, 5, "N%", "SEEN%", "OUT%", "VALID@") == expected


def test_a_snapshot_is_not_changed_by_later_scans():
    task, memory = task_of(QUEUE, **{"MOVE@": True})
    run_scans(task, 3)
    saved = task.snapshot()
    copy = list(saved)
    scanned(task, memory, 4, "OUT%")
    assert saved == copy
    task.restore(saved)
    scanned(task, memory, 4, "OUT%")
    assert saved == copy


def test_two_tasks_of_one_text_have_structures_of_their_own():
    task, memory = task_of(QUEUE, **{"MOVE@": True})
    other, its_memory = task_of(QUEUE, **{"MOVE@": True})
    run_scans(task, 5)
    other.run()
    assert scanned(other, its_memory, 3, "OUT%", "SEEN%") == [(0, 0), (0, 1), (1, 2)]
    assert scanned(task, memory, 1, "OUT%") == [(4,)]


def test_the_largest_structures_in_a_task():
    task, memory = task_of(
        """10 LOCAL N%, W%, B%, ODD@, LAST@, SEEN@, FULL@
20 CALL SCAN_LOOP(TICKS=4)
30 N% = N% + 1
35 ODD@ = N% = 2
40 CALL SHIFT_WORDS(STRUCTURE_NAME=WIDE%, MAX_COLUMNS=2047, SHIFT=TRUE, DATA_VALID=FULL@, INPUT1=N%, INPUT2=N%, &
     INPUT3=N%, INPUT4=N%, INPUT5=N%, INPUT6=N%, INPUT7=N%, INPUT8=N%, OUTPUT1=W%, OUTPUT2=W%, OUTPUT3=W%, &
     OUTPUT4=W%, OUTPUT5=W%, OUTPUT6=W%, OUTPUT7=W%, OUTPUT8=W%)
50 CALL SHIFT_BITS(STRUCTURE_NAME=LONG@, MAX_COLUMNS=32767, SHIFT=TRUE, INPUT1=ODD@, OUTPUT1=LAST@)
60 CALL READ_BITS(STRUCTURE_NAME=LONG@, COLUMN=2047, ENABLE=TRUE, OUTPUT1=SEEN@)
70 END
"""
    )
    task.run()
    found = scanned(task, memory, 2051, "W%", "FULL@", "SEEN@", "LAST@")
    assert found[2044:] == [
        (0, False, False, False),
        (0, False, False, False),
        (1, True, False, False),
        (2, True, False, False),
        (3, True, True, False),
        (4, True, False, False),
        (5, True, False, False),
    ]
    assert len(task.snapshot()) > 8 * 2047 + 32767


def test_a_forced_output_keeps_its_value_and_shows_the_next_shift_after_release():
    """An output is written with a shift only, so the force's value stays until then (2.4 and section 30)."""
    text = """10 LOCAL A%
11 COMMON OUT%, MOVE@
20 CALL SCAN_LOOP(TICKS=4)
30 A% = A% + 10
40 CALL SHIFT_WORDS(STRUCTURE_NAME=ONE%, MAX_COLUMNS=1, SHIFT=MOVE@, INPUT1=A%, OUTPUT1=OUT%)
50 END
"""
    task, memory = task_of(text, **{"MOVE@": True})
    out, move = memory.view("OUT%"), memory.view("MOVE@")
    task.run()
    seen = []
    for number, (forced, moving) in enumerate([(0, 1), (1, 1), (1, 0), (0, 0), (0, 0), (0, 1)], 1):
        memory.write_from_outside(move, bool(moving), OTHER)
        if forced:
            memory.force(out, -7)
        else:
            memory.release(out)
        task.scan(number * task.period_ns)
        seen.append(memory.read_now(out))
    assert seen == [10, -7, -7, -7, -7, 60]


def test_a_skipped_shift_leaves_the_structure_as_it_is():
    """A block that a GOTO passes over keeps its outputs and its data."""
    task, memory = task_of(
        """10 LOCAL N%, OUT%, SEEN%
11 COMMON SKIP@
20 CALL SCAN_LOOP(TICKS=4)
30 N% = N% + 1
40 IF SKIP@ THEN 60
50 CALL SHIFT_WORDS(STRUCTURE_NAME=LINE%, MAX_COLUMNS=2, SHIFT=TRUE, INPUT1=N%, OUTPUT1=OUT%)
60 CALL READ_WORDS(STRUCTURE_NAME=LINE%, COLUMN=0, ENABLE=TRUE, OUTPUT1=SEEN%)
70 END
"""
    )
    task.run()
    seen = []
    for skip in (False, True, True, False, False):
        memory.write_from_outside(memory.view("SKIP@"), skip, OTHER)
        seen += scanned(task, memory, 1, "OUT%", "SEEN%")
    assert seen == [(0, 1), (0, 1), (0, 1), (1, 4), (4, 5)]
