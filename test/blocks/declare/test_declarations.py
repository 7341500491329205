"""Every block of the catalogue against the rules of declarations, and its numbers against the manual's tables."""

import ast
import inspect
import re
import textwrap

import pytest
from hypothesis import given
from hypothesis import strategies as st

from automax_ros.blocks.catalogue import CATALOGUE, FAMILIES
from automax_ros.blocks.declare.declaration import (
    CALL_FACTS,
    HELPERS,
    Access,
    BlockTimes,
    Form,
    Platform,
    Special,
    Time,
)
from automax_ros.blocks.declare.instance import Instance
from automax_ros.blocks.discrete.shift import STRUCTURE_STATES
from automax_ros.blocks.scan_loop import END_TIMES, REMARK_TIMES
from automax_ros.core.problems import PROBLEMS
from automax_ros.core.types import DataType
from blocks.support import TICK, int16, repeatable

BLOCKS = list(CATALOGUE.values())
STEPPED = [block for block in BLOCKS if block.step]
each_block = pytest.mark.parametrize("block", BLOCKS, ids=lambda block: block.name)
each_step = pytest.mark.parametrize("block", STEPPED, ids=lambda block: block.name)


def test_the_catalogue_is_in_alphabetical_order_and_keyed_by_name():
    assert list(CATALOGUE) == sorted(CATALOGUE)
    assert all(name == block.name for name, block in CATALOGUE.items())


def test_every_block_belongs_to_one_family():
    names = [block.name for family in FAMILIES for block in family.blocks]
    assert sorted(names) == list(CATALOGUE)
    assert len({family.name for family in FAMILIES}) == len(FAMILIES)
    assert all([block.name for block in family.blocks] == sorted(b.name for b in family.blocks) for family in FAMILIES)


@each_block
def test_every_parameter_is_documented(block):
    assert block.title
    assert block.function
    assert re.fullmatch(r"\d+", block.section)
    for item in block.parameters:
        assert item.text
        assert re.fullmatch(r"[A-Z][A-Z0-9]*", item.symbol) or item.symbol == item.name
        assert re.fullmatch(r"[A-Z][A-Z0-9_]*", item.name)
    for field in ("name", "symbol"):
        values = [getattr(item, field) for item in block.parameters]
        assert len(set(values)) == len(values)


@each_block
def test_inputs_are_consistent(block):
    for item in block.inputs:
        assert not (item.required and item.default is not None), item.name
        if item.default is not None:
            expected = {DataType.BOOLEAN: bool, DataType.REAL: float}.get(item.type, int)
            assert type(item.default) is expected
            assert item.low is None or item.low <= item.default <= item.high
        if item.low is not None or item.high is not None:
            assert item.low < item.high
        assert list(item.one_of) == sorted(set(item.one_of))
        assert item.form is not Form.LITERAL or item.also is None
        assert item.runs_on & block.runs_on


@each_block
def test_problems_exist(block):
    assert all(code in PROBLEMS for code in block.problems)
    assert ("AMX7004" in block.problems) == (block.coefficients is not None)
    assert "AMX7004" not in block.logs


@each_block
def test_coefficients_name_their_parameters(block):
    if block.coefficients is None:
        assert block.line_scan or not any(item.type is DataType.REAL for item in block.inputs)
        return
    declared = block.coefficients
    reals = {item.name for item in block.inputs if item.type is DataType.REAL}
    inputs = {item.name: item for item in block.inputs}
    assert reals <= set(declared.parameters) <= set(inputs)
    assert len({limit.parameter for limit in declared.limits}) == len(declared.limits)
    seen = set()
    choices = {name for name in declared.parameters if inputs[name].one_of or inputs[name].type is DataType.BOOLEAN}
    for limit in declared.limits:
        assert set(limit.uses) - choices <= seen, "a limit may read only what was limited before it"
        seen.add(limit.parameter)
    assert seen | choices == set(declared.parameters)
    filled = set(declared.defaults(0.0055))
    assert filled == {name for name in declared.parameters if not inputs[name].required}
    for name, value in declared.defaults(0.0055).items():
        assert inputs[name].default in (None, value)
    if declared.relation is not None:
        assert set(declared.relation.parameters) <= set(declared.parameters)
        values = {**dict.fromkeys(declared.relation.parameters, 1.0), **declared.defaults(0.0055)}
        assert declared.relation.holds(declared.relation.first(0.0055, values))


def source_of(step):
    tree = ast.parse(textwrap.dedent(inspect.getsource(step))).body[0]
    assert isinstance(tree, ast.FunctionDef)
    return tree


def names_of(block):
    """What a step function may take: inputs, coefficients, states, and facts of the CALL."""
    coefficients = set(block.coefficients.names) if block.coefficients else set()
    evaluated = set(block.coefficients.parameters) if block.coefficients else set()
    inputs = {
        item.variable
        for item in block.inputs
        if (item.name not in evaluated or item.one_of)
        and (item.type is Special.TABLE or isinstance(item.type, DataType))
    }
    states = {state.name for state in block.states}
    if block.structure is Access.USES:
        states = set(STRUCTURE_STATES)
    return inputs, coefficients, states


@each_step
def test_step_takes_only_what_is_declared(block):
    inputs, coefficients, states = names_of(block)
    parameters = set(inspect.signature(block.step).parameters)
    assert len(inputs) + len(coefficients) + len(states) == len(inputs | coefficients | states)
    assert parameters - set(CALL_FACTS) == (inputs | coefficients | states) - set(CALL_FACTS)


def test_the_blocks_that_make_a_data_structure_have_its_states():
    for block in BLOCKS:
        if block.structure is Access.MAKES:
            assert tuple(state.name for state in block.states) == STRUCTURE_STATES


@each_step
def test_step_returns_outputs_states_and_error(block):
    returned = source_of(block.step).body[-1]
    assert isinstance(returned, ast.Return)
    names = [node.id for node in returned.value.elts]
    expected = [item.variable for item in block.outputs] + [state.name for state in block.states]
    assert names == expected + ["writes"] * block.holds + ["problem"] * bool(block.logs)


ALLOWED = (
    *(ast.Assign, ast.If, ast.While, ast.Return, ast.Name, ast.Constant, ast.Tuple, ast.Load, ast.Store, ast.Subscript),
    *(ast.BoolOp, ast.BinOp, ast.UnaryOp, ast.Compare, ast.IfExp, ast.Call, ast.And, ast.Or, ast.Not, ast.USub),
    *(ast.Add, ast.Sub, ast.Mult, ast.Div, ast.FloorDiv, ast.LShift, ast.RShift, ast.BitAnd),
    *(ast.Eq, ast.NotEq, ast.Lt, ast.LtE, ast.Gt, ast.GtE),
)


@each_step
def test_step_is_pure_and_straight(block):
    tree = source_of(block.step)
    body = tree.body[1:]
    assert ast.get_docstring(tree)
    inputs, coefficients, states = names_of(block)
    facts = set(CALL_FACTS) & set(inspect.signature(block.step).parameters)
    buffers = {state.name for state in block.states if state.size} | ({"data"} if block.structure else set())
    tables = {item.variable for item in block.inputs if item.type is Special.TABLE}
    numbers = {name for name, value in block.step.__globals__.items() if type(value) in (int, float)}
    assigned = set()
    for node in (part for statement in body for part in ast.walk(statement)):
        assert isinstance(node, ALLOWED), ast.dump(node)
        if isinstance(node, ast.Return):
            assert node is body[-1]
        if isinstance(node, ast.Call):
            assert isinstance(node.func, ast.Name)
            assert node.func.id in HELPERS
            assert not node.keywords
        if isinstance(node, ast.Compare):
            assert len(node.ops) == 1
        if isinstance(node, ast.Assign):
            (target,) = node.targets
            if isinstance(target, ast.Subscript):
                assert target.value.id in buffers
            else:
                assigned.add(target.id)
        if isinstance(node, ast.Subscript):
            assert node.value.id in buffers | tables
    assert not assigned & (inputs | coefficients | facts), "a literal must be able to stand in their place"
    loaded = {
        node.id
        for statement in body
        for node in ast.walk(statement)
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load)
    }
    assert loaded <= inputs | coefficients | states | facts | assigned | numbers | set(HELPERS)
    builtin = {node.func.id for statement in body for node in ast.walk(statement) if isinstance(node, ast.Call)}
    assert not builtin & (inputs | coefficients | states | assigned), "a parameter hides a helper that is called"


@each_step
def test_optional_outputs_are_never_read(block):
    """So that they vanish where they are not programmed."""
    optional = {item.variable for item in block.outputs if not item.required}
    for node in (part for statement in source_of(block.step).body[:-1] for part in ast.walk(statement)):
        if isinstance(node, ast.Assign):
            loaded = {item.id for item in ast.walk(node.value) if isinstance(item, ast.Name)}
            assert not loaded & optional
        elif isinstance(node, (ast.If, ast.While)):
            assert not {item.id for item in ast.walk(node.test) if isinstance(item, ast.Name)} & optional


REALS = st.floats(-9.2e18, 9.2e18) | st.floats(0.001, 100.0)
BY_TYPE = {
    DataType.INTEGER: int16,
    DataType.DOUBLE: st.integers(-(2**31), 2**31 - 1),
    DataType.BOOLEAN: st.booleans(),
    DataType.REAL: REALS,
    Special.TABLE: st.lists(int16, min_size=2, max_size=2),
}
PYTHON = {DataType.INTEGER: int, DataType.DOUBLE: int, DataType.BOOLEAN: bool, DataType.REAL: float}


def variables(block):
    wanted = [item for item in block.inputs if item.form is not Form.LITERAL and item.type in BY_TYPE]
    return st.fixed_dictionaries({item.variable: BY_TYPE[item.type] for item in wanted})


def literals(block):
    chosen = {}
    for item in block.inputs:
        if item.form is not Form.LITERAL or (item.type is DataType.REAL and not item.required):
            continue
        if item.type is DataType.REAL:
            chosen[item.variable] = st.sampled_from([0.01, 0.022, 1.0])
            continue
        if item.one_of:
            chosen[item.variable] = st.sampled_from(item.one_of)
        elif item.type is DataType.INTEGER:
            chosen[item.variable] = st.integers(item.low, min(item.high, 20 if block.states else item.high))
        else:
            chosen[item.variable] = BY_TYPE[item.type]
    return st.fixed_dictionaries(chosen)


def instances(block, fixed):
    """The block, after the SHIFT block that makes its data structure, if it uses one."""
    if block.structure is not Access.USES:
        return Instance(block, TICK, **fixed), None
    maker = Instance(CATALOGUE[f"SHIFT_{block.name.partition('_')[2]}"], TICK, max_columns=3)
    return Instance(block, TICK, maker, **fixed), maker


@each_step
def test_any_values_give_values_of_the_declared_types_and_ranges(block):
    @repeatable
    @given(literals(block), st.lists(variables(block), min_size=1, max_size=12))
    def check(fixed, rows):
        instance, maker = instances(block, fixed)
        for row in rows:
            if maker is not None:
                maker.scan(shift=True, input1=maker.block.parameter("INPUT1").type.zero)
            result = instance.scan(**row)
            for item in block.outputs:
                assert type(result[item.variable]) is PYTHON[item.type]
                assert item.type is not DataType.INTEGER or -32768 <= result[item.variable] <= 32767
            for state in block.states:
                held = instance.state[state.name]
                assert {type(value) for value in (held if state.size else [held])} == {PYTHON[state.type]}
            assert instance.error == 0 or f"AMX{instance.error}" in block.problems

    check()


# Copied from the manual. Table 4: 7010 and 6010/6011; table 5: UDC; table 6: PC3000, SCAN_LOOP's with its lost term.
# Table 5 forgets SEARCH, which has an estimate, calls the pass filters LEADN and LAGN, and the n of its PACK_BITS
# counts inputs.
TABLES = """
ABSOLUTE_VALUE       9.16   41   8.30   6.44
ALARM                11.16 + n(2.48)   44 + n(11)   10.10 + n(1.80)   7.8 + n(1.76)
AMPLIFIER            13.16 + k(3.12)   62 + k(13.8)   15.30 + k(1.80)   9.2 + k(2.20)
AND                  10.80 + j(1.88)   41 + j(8.3)   10.60 + j(1.45)   7.56 + j(1.32)
BIT_SELECT           26.04 + n(1.20)   118 + n(6.5)   -   18.24 + n(0.84)
COMPARE              11.24 + n(1.16)   45 + n(5.5)   7.50 + n(2.25)   7.88 + n(0.80)
COUNTER              15.64   61   16.90   10.96
DIFFERENCE           10.80   44   7.97   7.56
DIFF_LAG             33.04   154   41.50   23.12
END                  13.82 + t(2.0) + i(1.6) + b(2.2) + d(2.5)   60 + t(3.2) + i(2.8) + b(4.3) + d(4.9)   130.00 + i(2.40) + b(2.50) + d(3.30)   9.68 + t(1.40) + i(1.12) + b(1.56) + d(1.76)
FUNCTION             23.56   93   20.30   16.48
HIGH_PASS_FILTER     -   -   39.25 + o(4.00)   -
INTEGRATE            39.14   193   58.60   27.40
INVERTER             10.84   48   9.40   7.60
LAG                  26.52   118   41.00   18.56
LATCH                15.04   68   14.85   10.52
LEAD_LAG             68.60   284   39.70   48.04
LIMIT                18.20   69   15.05   12.76
LOW_PASS_FILTER      -   -   39.25 + o(4.00)   -
MOVE                 10.40 + p(2.32)   39 + p(11)   10.40 + p(1.80)   7.28 + p(1.64)
MULTIPLY_DIVIDE      13.76   71   13.80   9.64
NOTCH                85.16   393   -   59.60
NOTCHN               -   -   64.25 + o(20.00)   -
OR                   10.24 + j(1.88)   41 + j(8.3)   8.90 + j(1.45)   7.16 + j(1.32)
PACK_BITS            24.28 + j(1.44)   110 + j(5)   16.16 + j(1.25)   17.00 + j(1.00)
PID                  124.00   515   -   86.80
PROP_INT             40.32   193   70.85   28.24
PULSE_MULT           18.32   86   18.96   12.84
RAMP                 27.72   122   24.96   19.40
READ_BITS            24.32 + n(1.12)   106 + n(7.3)   -   17.04 + n(0.80)
READ_WORDS           25.76 + n(1.28)   111 + n(5.6)   -   18.04 + n(0.92)
RUNNING_AVERAGE      28.64   125   26.94   20.04
SAMPLED_AVERAGE      29.00   125   25.94   20.32
SCALE                22.48   98   18.30   15.72
SCAN_LOOP            80.00 + t(1.6) + i(2.5) + b(3.8) + d(4.1)   326 + t(2.4) + i(4.4) + b(6.8) + d(7.2)   350.00 + i(2.20) + b(2.00) + d(3.30)   56.00 + t(1.12) + i(1.76) + b(2.68) + d(2.88)
SEARCH               19.80 + m(0.68)   74 + m(3)   15.84 + m(0.544)   13.88 + m(0.48)
SELECT               11.36 + j(2.52)   44 + j(12.2)   12.50 + j(1.50)   7.96 + j(1.76)
SHIFT_BITS           18.28 + p(2.04)   92 + p(19.7)   -   12.80 + p(1.44)
SHIFT_WORDS          17.80 + p(1.72)   89 + p(13.3)   -   12.48 + p(1.20)
SUMMER               11.28   44   10.00   7.88
SWITCH               11.52   47   12.55   8.08
S_CURVE              47.00   282   35.01   32.92
TACHLOSS_OVERSPEED   -   -   22.00   -
THERMAL_OVERLOAD     -   -   46.10   -
TRANSITION           11.36   48   11.90   7.96
UNPACK_BITS          23.40 + n(1.44)   106 + n(7.3)   14.40 + n(1.90)   16.40 + n(1.00)
WRITE_BITS           25.56 + j(1.36)   103 + j(6)   -   17.88 + j(0.96)
WRITE_WORDS          25.52 + j(0.36)   110 + j(1.9)   -   17.88 + j(0.28)
REMARK               9.88   40   2.37   6.92
"""  # noqa: E501
ROWS = {line.split()[0]: re.split(r"\s{3,}", line.split(maxsplit=1)[1]) for line in TABLES.strip().splitlines()}


def parsed(text):
    if text == "-":
        return None
    base, *terms = text.split(" + ")
    return Time(float(base), **{term[0]: float(term[2:-1]) for term in terms})


def times_of(name):
    return {"END": END_TIMES, "REMARK": REMARK_TIMES}.get(name) or CATALOGUE[name].times


ALONE = {"SCAN_LOOP": 312.0, "END": 100.0}


@pytest.mark.parametrize("name", ROWS)
def test_times_are_those_of_tables_4_to_6(name):
    times = times_of(name)
    found = [times.model_7010, times.model_6010, times.udc, times.pc3000]
    expected = [parsed(text) for text in ROWS[name]]
    if name in ALONE:
        expected[2] = Time(**{**vars(expected[2]), "alone": ALONE[name]})
    assert found == expected


@pytest.mark.parametrize("name", [name for name in ROWS if times_of(name).pc3000])
def test_pc3000_times_are_0_7_of_the_7010s(name):
    times = times_of(name)
    for term, value in vars(times.pc3000).items():
        assert value == pytest.approx(0.7 * getattr(times.model_7010, term), abs=0.041), term


@each_block
def test_times_are_there_for_every_processor_that_runs_the_block(block):
    if block.line_scan is not None:
        assert block.times == BlockTimes(None, None, None, None), "the manual prints no time of a current minor loop"
        return
    assert block.name in ROWS
    assert (block.times.udc is not None) == (Platform.UDC in block.runs_on)
    assert (block.times.pc3000 is not None) == (Platform.PC3000 in block.runs_on)
    assert (block.times.model_7010 is not None) == (Platform.AUTOMAX in block.runs_on)
    assert (block.times.model_6010 is not None) == (Platform.AUTOMAX in block.runs_on)
