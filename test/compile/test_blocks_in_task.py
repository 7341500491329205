"""A block inlined into a compiled scan does what its step function does as it stands, however it is programmed."""

from __future__ import annotations

import dataclasses
from collections import Counter

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from automax_ros.blocks.catalogue import CATALOGUE
from automax_ros.blocks.declare.declaration import Access, Block, Form, Given, Platform, Special
from automax_ros.blocks.declare.instance import Instance
from automax_ros.blocks.declare.rules import AtLeast, Contiguous, Needs, NumberTrue
from automax_ros.core.numbers import stored_real
from automax_ros.core.types import DataType, type_of_name
from automax_ros.runtime.memory.memory import CommonMemory
from compile.block_model import SIZE, TICKS, Model, ModelBlock, Programmed
from compile.support import OTHER, lines, logged, ran, repeatable, run_scans, scan_and_record, task_of

BLOCKS = [block for block in CATALOGUE.values() if block.step is not None]
ON_A_RACK = [block for block in BLOCKS if Platform.AUTOMAX in block.runs_on]
EDGES = st.sampled_from([-32768, -32767, -1, 0, 1, 32766, 32767])
VALUES = {
    DataType.INTEGER: EDGES | st.integers(-32768, 32767) | st.integers(-50, 50),
    DataType.DOUBLE: st.sampled_from([-(2**31), 2**31 - 1, 2**31 - 32768, 0, 1]) | st.integers(-(2**31), 2**31 - 1),
    DataType.BOOLEAN: st.booleans(),
    DataType.REAL: st.sampled_from([0.0, -1.0, 1e-7, 0.5, 2.0, 3.7, 10.0, 63.0, 200.0, 1e6]).map(
        lambda value: stored_real(value)[0]
    ),
}
REAL_LITERALS = ("0.5", "2.0", "10.0")
"""Inside the limits of nearly every coefficient at this scan period."""
OTHER_LITERALS = {
    **dict.fromkeys(["HIGH_PASS_FILTER WLD", "LOW_PASS_FILTER WLG", "NOTCHN WN"], ("20.0", "100.0")),
    "LEAD_LAG WLD": ("0.5", "2.0"),
    "LEAD_LAG WLG": ("4.0", "10.0"),
}
"""Those that their block's limits allow where the others are not, by block and parameter."""
SIMPLE = {
    DataType.DOUBLE: ["L1!", "K1!"],
    DataType.INTEGER: ["L1%", "L2%", "K1%", "K2%"],
    DataType.BOOLEAN: ["L1@", "L2@", "K1@", "K2@", "L3@", "K3@"],
    DataType.REAL: ["L1", "L2", "K1", "K2"],
}
ARRAYS = {
    DataType.DOUBLE: ["LT!", "KT!"],
    DataType.INTEGER: ["LT%", "KT%"],
    DataType.BOOLEAN: ["LT@", "KT@"],
    DataType.REAL: ["LT", "KT"],
}
SMALL = ("MAX_COLUMNS", "REQUIRED_SAMPLES")
"""Literals that size a buffer: small, so that a few scans fill it."""
TABLES = ["LF%", "KF%"]
"""Arrays of 3 = 2**1 + 1 elements, a size that every table may have."""
TABLE_SIZE = 3
INDEXES = ["LJ%", "KJ%", "0", "3"]
ALL_SIMPLE = [*(name for names in SIMPLE.values() for name in names), "LJ%", "KJ%"]
ALL_ARRAYS = [name for names in ARRAYS.values() for name in names]
SIZES = {**dict.fromkeys(ALL_ARRAYS, SIZE), **dict.fromkeys(TABLES, TABLE_SIZE)}


def declarations() -> str:
    names = [*ALL_SIMPLE, *(f"{name}({size - 1})" for name, size in SIZES.items())]
    local = ", ".join(name for name in names if name.startswith("L"))
    common = ", ".join(name for name in names if name.startswith("K"))
    return f"10 LOCAL {local}\n11 COMMON {common}\n"


def variables(kind: DataType) -> st.SearchStrategy[str]:
    elements = st.builds(
        lambda name, index: f"{name}({index})", st.sampled_from(ARRAYS[kind]), st.sampled_from(INDEXES)
    )
    return st.sampled_from(SIMPLE[kind]) | elements


def literals(block: Block, item) -> st.SearchStrategy[str]:
    if item.type is DataType.REAL:
        return st.sampled_from(OTHER_LITERALS.get(f"{block.name} {item.name}", REAL_LITERALS))
    if item.type is DataType.BOOLEAN:
        return st.sampled_from(["TRUE", "FALSE"])
    if item.one_of:
        return st.sampled_from([str(value) for value in item.one_of])
    if item.name in SMALL:
        return st.sampled_from(["1", "2", "3", "5"])
    low, high = (-32768 if item.low is None else item.low), (32767 if item.high is None else item.high)
    return (st.integers(low, high) | st.sampled_from([low, high, max(low, min(high, 1))])).map(str)


@st.composite
def inputs(draw, block: Block, everything: bool) -> dict[str, str]:
    parameters = {}
    for item in block.inputs:
        if not (item.required or everything or draw(st.booleans())):
            continue
        if item.type is Special.TABLE:
            parameters[item.name] = draw(st.sampled_from(TABLES))
        elif isinstance(item.type, Special):
            parameters[item.name] = f"QUEUE{item.type.element.value}"
        else:
            choices = [] if item.form is Form.VARIABLE else [literals(block, item)]
            if item.form is not Form.LITERAL:
                choices.append(variables(item.type))
                if item.also is not None:
                    choices.append(variables(item.also))
                if item.type is DataType.BOOLEAN:
                    choices.append(variables(item.type).map(lambda name: f"-{name}"))
            parameters[item.name] = draw(st.one_of(choices))
    return parameters


@st.composite
def calls(draw, block: Block) -> Programmed:
    """A CALL that breaks no rule of the block."""
    everything = draw(st.booleans())
    parameters = draw(inputs(block, everything))
    for output in block.outputs:
        if output.required or everything or draw(st.booleans()):
            parameters[output.name] = draw(variables(output.type))
    for rule in block.rules:
        if rule.fault(seen_by_rules(parameters)):
            _mend(draw, block, rule, parameters)
    assume(not any(rule.fault(seen_by_rules(parameters)) for rule in block.rules))
    return Programmed(block, dict(draw(st.permutations(list(parameters.items())))))


def _mend(draw, block: Block, rule, parameters: dict[str, str]) -> None:
    """Program what a rule asks for besides: channels without a gap, one of a group, tables that go together."""
    wanted: list[str] = []
    if isinstance(rule, Contiguous):
        last = max((int(name[-1]) for name in parameters if name[-1].isdigit()), default=0)
        wanted = [f"{stem}{channel}" for channel in range(1, last + 1) for stem in rule.stems]
    elif isinstance(rule, AtLeast):
        wanted = draw(st.lists(st.sampled_from(rule.group), min_size=rule.count, max_size=rule.count, unique=True))
    elif isinstance(rule, Needs):
        wanted = [rule.other]
    elif isinstance(rule, NumberTrue):
        chosen = draw(st.lists(st.sampled_from(rule.group), min_size=rule.low, max_size=rule.high, unique=True))
        parameters.update({name: str(name in chosen).upper() for name in rule.group})
    for name in wanted:
        item = block.parameter(name)
        if name not in parameters:
            parameters[name] = draw(st.sampled_from(TABLES) if item.type is Special.TABLE else variables(item.type))


def seen_by_rules(parameters: dict[str, str]) -> dict[str, Given]:
    words = {"TRUE": True, "FALSE": False}
    seen = {}
    for keyword, text in parameters.items():
        value = words.get(text, int(text) if text.lstrip("-").isdigit() else None)
        seen[keyword] = Given(value, SIZES.get(text))
    return seen


@st.composite
def with_its_structure(draw, block: Block) -> list[Programmed]:
    """A CALL, after the SHIFT block that makes the data structure that it uses."""
    call = draw(calls(block))
    if block.structure is not Access.USES:
        return [call]
    shift = CATALOGUE[f"SHIFT_{block.name.partition('_')[2]}"]
    kind = DataType.BOOLEAN if block.name.endswith("BITS") else DataType.INTEGER
    parameters = {"STRUCTURE_NAME": f"QUEUE{kind.value}", "MAX_COLUMNS": draw(st.sampled_from(["1", "2", "3"]))}
    parameters["SHIFT"] = draw(variables(DataType.BOOLEAN))
    for channel in range(1, 9):
        parameters[f"INPUT{channel}"] = draw(variables(kind))
        parameters[f"OUTPUT{channel}"] = draw(variables(kind))
    return [Programmed(shift, parameters), call]


@st.composite
def scans(draw, names: list[str], count: int):
    """What is set before each scan: some of the variables."""
    changes = []
    for number in range(count):
        change = {}
        for name in names:
            if number == 0 or draw(st.integers(0, 3)) == 0:
                if name in ("LJ%", "KJ%"):
                    change[name] = draw(st.integers(-1, SIZE))
                else:
                    change[name] = draw(VALUES[type_of_name(name)])
        changes.append(change)
    return changes


def used(programmed: list[Programmed]) -> list[str]:
    """The simple variables that the calls name."""
    text = " ".join(call.text(0) for call in programmed)
    return [name for name in ALL_SIMPLE if name in text]


def compare(programmed: list[Programmed], changes, in_steps: bool) -> None:
    body = "\n".join(call.text(100 + number) for number, call in enumerate(programmed))
    target = Platform.AUTOMAX if all(call.block in ON_A_RACK for call in programmed) else Platform.UDC
    task, memory = task_of(f"{declarations()}20 CALL SCAN_LOOP(TICKS={TICKS})\n{body}\n999 END\n", target=target)
    task.record_scans()
    task.run()
    model = Model(
        {
            **{name: type_of_name(name).zero for name in ALL_SIMPLE},
            **{name: [type_of_name(name).zero] * size for name, size in SIZES.items()},
        }
    )
    structures: dict[str, Instance] = {}
    blocks = [ModelBlock(call, structures) for call in programmed]
    fill_tables(task, memory, model)
    for now, change in enumerate(changes):
        for name, value in change.items():
            model.values[name] = value
            if name.startswith("K"):
                memory.write_from_outside(memory.view(name), value, OTHER)
            else:
                task.state[task.compiled.layout.index(name)] = value
        model.codes.clear()
        for block in blocks:
            block.scan(model)
        record = scan_and_record(task, now)[1] if in_steps else task.scan(now)
        actual = actual_values(task, memory)
        assert actual == model.values
        assert {name: type_of(value) for name, value in actual.items()} == {
            name: type_of(value) for name, value in model.values.items()
        }
        assert Counter(code for _, code in record.errors) == Counter(model.codes)


def fill_tables(task, memory, model: Model) -> None:
    """Put numbers into the tables, so that looking up finds some."""
    for name, values in (("LF%", [-300, 50, 20000]), ("KF%", [0, 7, -32768])):
        model.values[name] = list(values)
        for index, value in enumerate(values):
            if name.startswith("L"):
                task.value(name)[index] = value
            else:
                memory.write_from_outside(memory.view(name), value, OTHER, index)


def actual_values(task, memory) -> dict[str, object]:
    values = {}
    for name in [*ALL_SIMPLE, *SIZES]:
        if name.startswith("L"):
            values[name] = task.value(name)
        elif name in ALL_SIMPLE:
            values[name] = memory.read_now(memory.view(name))
        else:
            values[name] = [memory.read_now(memory.view(name), index) for index in range(SIZES[name])]
    return values


def type_of(value: object) -> object:
    return [type(item) for item in value] if isinstance(value, list) else type(value)


@pytest.mark.parametrize("block", BLOCKS, ids=lambda block: block.name)
@given(data=st.data())
@repeatable(20)
def test_a_compiled_block_is_its_step_function(block, data):
    programmed = data.draw(with_its_structure(block))
    compare(programmed, data.draw(scans(used(programmed), 5)), data.draw(st.booleans()))


@pytest.mark.soak
@pytest.mark.parametrize("block", BLOCKS, ids=lambda block: block.name)
@given(data=st.data())
@repeatable(400)
def test_a_compiled_block_is_its_step_function_long(block, data):
    programmed = data.draw(with_its_structure(block))
    compare(programmed, data.draw(scans(used(programmed), 12)), data.draw(st.booleans()))


@given(data=st.data())
@repeatable(60)
def test_blocks_one_after_the_other(data):
    """They share variables, also several of one kind, each with a state of its own."""
    several = [block for block in ON_A_RACK if block.structure is None]
    chosen = data.draw(st.lists(st.sampled_from(several), min_size=2, max_size=5))
    programmed = [data.draw(calls(block)) for block in chosen]
    compare(programmed, data.draw(scans(used(programmed), 5)), data.draw(st.booleans()))


def test_two_outputs_onto_one_variable_leave_the_last_of_the_call():
    task = ran(
        "A% = 50",
        "CALL LIMIT(INPUT=A%, LIMIT_PLUS=40, SATURATED_PLUS=X@, SATURATED_MINUS=X@, OUTPUT=B%)",
        "CALL LIMIT(INPUT=A%, LIMIT_PLUS=40, SATURATED_MINUS=Y@, SATURATED_PLUS=Y@, OUTPUT=B%)",
    )
    assert (task.value("X@"), task.value("Y@"), task.value("B%")) == (False, True, 40)


LIMITING = "CALL LIMIT({}LIMIT_PLUS=5, SATURATED_PLUS=T10@(D3%), OUTPUT=D3%)"


@pytest.mark.parametrize("source", ["B1%", "D3%"])
@pytest.mark.parametrize("scope", ["LOCAL", "COMMON"])
def test_the_subscripts_of_a_call_are_those_before_the_block(scope, source):
    """Also where an output of the same CALL is the subscript of another, whatever the input is (decision)."""
    text = f"""10 {scope} B1%, D3%
11 LOCAL T10@(9)
20 B1% = 8 \\ D3% = 8
30 CALL SCAN_LOOP(TICKS=4)
40 CALL LIMIT(INPUT={source}, LIMIT_PLUS=5, OUTPUT=D3%, SATURATED_PLUS=T10@(D3%))
50 END
"""
    task, _ = task_of(text)
    run_scans(task, 1)
    assert [place for place, value in enumerate(task.value("T10@")) if value] == [8]


def test_outputs_are_stored_in_the_order_of_the_call_elements_too():
    task = ran(
        "A% = 1 \\ B% = 2",
        "CALL MOVE(INPUT1=A%, INPUT2=B%, OUTPUT2=T%(C%), OUTPUT1=T%(0))",
        "CALL MOVE(INPUT1=A%, INPUT2=B%, OUTPUT1=T%(C% + 1), OUTPUT2=T%(1))",
    )
    assert task.value("T%")[:2] == [1, 2]


@pytest.mark.parametrize(
    "call",
    [
        "LATCH(SET=X@, RESET=FALSE, OUTPUT=F@(C%))",
        "MOVE(ENABLE=X@, INPUT1=1, OUTPUT1=T%(C%))",
        "SHIFT_BITS(STRUCTURE_NAME=Q@, MAX_COLUMNS=1, SHIFT=X@, INPUT1=TRUE, OUTPUT1=F@(C%))",
        "SHIFT_WORDS(STRUCTURE_NAME=Q%, MAX_COLUMNS=1, SHIFT=X@, INPUT1=A%, OUTPUT1=T%(C%))",
    ],
)
def test_a_block_that_holds_looks_at_a_bad_subscript_only_when_it_writes_and_once(call):
    task = ran("C% = -1", f"CALL {call}", "X@ = NOT X@", declare="LOCAL A%, C%, X@, T%(5), F@(5)", scans=4)
    assert logged(task) == [(40, 7026), (40, 7026)]


class ReadMemory(CommonMemory):
    """Knows what was read past the latch."""

    def __init__(self, views):
        super().__init__(views)
        self.touched = []

    def read_now(self, view, element=0):
        self.touched.append((view, element))
        return super().read_now(view, element)


def test_a_block_that_holds_neither_reads_nor_writes_what_it_holds():
    """Equal values are written all the same when it updates."""
    text = """10 COMMON EN@, T%(3)
20 CALL SCAN_LOOP(TICKS=4)
30 CALL MOVE(ENABLE=EN@, INPUT1=5, OUTPUT1=T%(1))
40 END
"""
    task, memory = task_of(text, ReadMemory)
    task.run()
    memory.keep_log()
    for number, enable in enumerate([False, True, True, False]):
        memory.write_from_outside(memory.view("EN@"), enable, OTHER)
        task.scan(number)
    assert memory.touched == []
    assert [entry.value for entry in memory.drain() if entry.writer != OTHER] == [5, 5]


def test_same_variable_as_input_and_output():
    task = ran("A% = 50", "CALL DIFFERENCE(INPUT1=A%, INPUT2=A%, OUTPUT=A%)", "B% = 1")
    assert (task.value("A%"), task.value("B%")) == (0, 1)


def test_a_block_that_a_goto_skips_keeps_output_and_state():
    """State counts from the block's first execution since RUN (architecture)."""
    skipping = "30 IF N% < 3 THEN 50\n40 CALL RAMP(INPUT=100, ACCEL_RATE=10, OUTPUT=A%)\n50 N% = N% + 1\n60 END\n"
    task, _ = task_of("10 LOCAL N%, A%\n20 CALL SCAN_LOOP(TICKS=4)\n" + skipping)
    run_scans(task, 3)
    assert (task.value("A%"), task.value("40 RAMP.register")) == (0, 0)
    run_scans(task, 2, first=4)
    assert task.value("A%") == 20
    task.state[task.compiled.layout.index("N%")] = -2
    run_scans(task, 3, first=6)
    assert task.value("A%") == 20
    run_scans(task, 4, first=9)
    assert task.value("A%") == 40


def test_two_calls_of_one_line_have_two_states():
    task = ran(
        r"CALL RAMP(INPUT=100, ACCEL_RATE=10, OUTPUT=A%) \ CALL RAMP(INPUT=100, ACCEL_RATE=7, OUTPUT=B%)", scans=2
    )
    assert (task.value("30 RAMP.register"), task.value("30.2 RAMP.register")) == (20, 14)


def test_a_block_in_a_loop_runs_once_a_turn_on_one_state():
    task = ran("FOR C% = 1 TO 3", "CALL RAMP(INPUT=100, ACCEL_RATE=10, OUTPUT=A%)", "NEXT C%", scans=2)
    assert task.value("A%") == 60


def test_a_coefficient_out_of_its_limits_is_logged_when_it_goes_out():
    """Semantics, Coefficients: on the scan in which it goes out of range, not on every scan."""
    text = lines("CALL LAG(INPUT=A%, WLG=GAIN, OUTPUT=B%)", declare=r"LOCAL A%, B% \ COMMON GAIN")
    task, memory = task_of(text, GAIN=5.0)
    task.run()
    counts = []
    for gain in (5.0, 1e6, 1e6, 2e6, 5.0, 1e6):
        memory.write_from_outside(0, gain, OTHER)
        task.scan(0)
        counts.append(task.errors.count)
    assert counts == [0, 1, 1, 1, 1, 2]
    assert logged(task) == [(30, 7004), (30, 7004)]


STEPS = """
def swap_step(input1, input2):
    return input1, input2


def delay_step(input, last):
    return last, input


def count_step(input, count):
    first = count
    count = count + input
    return count, first, count


def guarded_step(input, divisor, select):
    output = truncated_quotient(input, divisor) if select else 0
    return (output,)


def pair_step(input, a, b):
    a, b = b + input, a
    return b, a, b
"""


@pytest.fixture
def made(tmp_path, monkeypatch):
    """Blocks whose steps return inputs and states as they are, as the declaration allows."""
    import importlib
    import sys

    (tmp_path / "made_steps.py").write_text("from automax_ros.core.numbers import truncated_quotient\n" + STEPS)
    monkeypatch.syspath_prepend(str(tmp_path))
    module = importlib.import_module("made_steps")
    yield module
    del sys.modules["made_steps"]


def block_like(name, step, inputs, outputs, states=()):
    from automax_ros.blocks.declare.declaration import Input, Output, State

    return dataclasses.replace(
        CATALOGUE["SUMMER"],
        name=name,
        inputs=tuple(Input(item, DataType.INTEGER, item, item, required=True) for item in inputs),
        outputs=tuple(Output(item, DataType.INTEGER, item, item) for item in outputs),
        states=tuple(State(item, DataType.INTEGER, 0) for item in states),
        logs=(),
        step=step,
    )


@pytest.mark.parametrize("name", ["swap", "delay", "count", "pair"])
def test_steps_that_return_inputs_and_states_as_they_are(made, monkeypatch, name):
    shapes = {
        "swap": (("INPUT1", "INPUT2"), ("OUTPUT2", "OUTPUT1"), ()),
        "delay": (("INPUT",), ("OUTPUT",), ("last",)),
        "count": (("INPUT",), ("OUTPUT", "BEFORE"), ("count",)),
        "pair": (("INPUT",), ("OUTPUT",), ("a", "b")),
    }
    inputs, outputs, states = shapes[name]
    block = block_like(name.upper(), getattr(made, f"{name}_step"), inputs, outputs, states)
    monkeypatch.setitem(CATALOGUE, block.name, block)
    names = dict(zip(inputs, ("L1%", "L2%"), strict=False))
    call = Programmed(block, {**names, **dict(zip(outputs, ("L2%", "L1%"), strict=False))})
    again = Programmed(block, {**names, **dict(zip(outputs, ("K1%", "K2%"), strict=False))})
    compare([call, again], [{"L1%": 3, "L2%": 5}, {"L1%": 7}, {}, {"L2%": 9}], False)


def test_a_helper_that_fails_on_literals_stays_behind_its_test(made, monkeypatch):
    block = block_like("GUARD", made.guarded_step, ("INPUT", "DIVISOR", "SELECT"), ("OUTPUT",))
    monkeypatch.setitem(CATALOGUE, block.name, block)
    call = Programmed(block, {"INPUT": "5", "DIVISOR": "0", "SELECT": "L1%", "OUTPUT": "L2%"})
    compare([call], [{"L1%": 0, "L2%": 1}], False)


def test_a_second_coefficient_out_of_its_limits_is_logged_while_the_first_still_is():
    task = ran("CALL PROP_INT(INPUT=A%, KP=R, WLD=Q, OUTPUT=B%)", scans=0)
    task.record_scans()
    logged = []
    for wld, kp in ((36.0, 1.0), (36.0, 200.0), (1000.0, 200.0), (1000.0, 1.0)):
        task.state[task.compiled.layout.index("Q")] = wld
        task.state[task.compiled.layout.index("R")] = kp
        logged.append([code for _, code in task.scan(0).errors])
    assert logged == [[], [7004], [7004], []]
