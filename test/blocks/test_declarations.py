"""Every block of the catalogue against the rules of declarations, and its numbers against the manual's tables."""

import ast
import inspect
import re
import textwrap

import pytest
from hypothesis import given
from hypothesis import strategies as st

from automax_ros.blocks.catalogue import CATALOGUE
from automax_ros.blocks.declaration import HELPERS, Form, Processor, Special, Time
from automax_ros.blocks.instance import Instance
from automax_ros.blocks.scan_loop import END_TIMES, REMARK_TIMES
from automax_ros.core.problems import PROBLEMS
from automax_ros.core.types import DataType

from .support import TICK, int16, repeatable

BLOCKS = list(CATALOGUE.values())
STEPPED = [block for block in BLOCKS if block.step]
each_block = pytest.mark.parametrize("block", BLOCKS, ids=lambda block: block.name)
each_step = pytest.mark.parametrize("block", STEPPED, ids=lambda block: block.name)


def test_the_catalogue_is_in_alphabetical_order_and_keyed_by_name():
    assert list(CATALOGUE) == sorted(CATALOGUE)
    assert all(name == block.name for name, block in CATALOGUE.items())


@each_block
def test_every_parameter_is_documented(block):
    assert block.title
    assert block.function
    assert re.fullmatch(r"\d+", block.section)
    for item in block.parameters:
        assert item.text
        assert re.fullmatch(r"[A-Z][A-Z0-9]*", item.symbol), item.name
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
        assert item.runs_on <= block.runs_on


@each_block
def test_problems_exist(block):
    assert all(code in PROBLEMS for code in block.problems)
    assert ("AMX7004" in block.problems) == (block.coefficients is not None)
    assert "AMX7004" not in block.logs


@each_block
def test_coefficients_name_their_parameters(block):
    if block.coefficients is None:
        assert not any(item.type is DataType.REAL for item in block.inputs)
        return
    declared = block.coefficients
    assert sorted(declared.parameters) == sorted(item.name for item in block.inputs if item.type is DataType.REAL)
    assert len({limit.parameter for limit in declared.limits}) == len(declared.limits)
    seen = set()
    for limit in declared.limits:
        assert set(limit.uses) <= seen, "a limit may read only what was limited before it"
        seen.add(limit.parameter)
    assert seen == set(declared.parameters)
    filled = set(declared.defaults(0.0055))
    assert filled == {item.name for item in block.inputs if item.type is DataType.REAL and not item.required}


def source_of(step):
    tree = ast.parse(textwrap.dedent(inspect.getsource(step))).body[0]
    assert isinstance(tree, ast.FunctionDef)
    return tree


def names_of(block):
    inputs = {
        item.variable for item in block.inputs if item.type is not Special.EVENT and item.type is not DataType.REAL
    }
    coefficients = set(block.coefficients.names) if block.coefficients else set()
    return inputs, coefficients, {state.name for state in block.states}


@each_step
def test_step_takes_only_what_is_declared(block):
    inputs, coefficients, states = names_of(block)
    held = {item.variable for item in block.outputs if item.holds}
    parameters = list(inspect.signature(block.step).parameters)
    assert len(inputs) + len(coefficients) + len(states) + len(held) == len(inputs | coefficients | states | held)
    assert set(parameters) == inputs | coefficients | states | held


@each_step
def test_step_returns_outputs_states_and_error(block):
    returned = source_of(block.step).body[-1]
    assert isinstance(returned, ast.Return)
    names = [node.id for node in returned.value.elts]
    expected = [item.variable for item in block.outputs] + [state.name for state in block.states]
    assert names == expected + ["error"] * bool(block.logs)


ALLOWED = (
    *(ast.Assign, ast.If, ast.Return, ast.Name, ast.Constant, ast.Tuple, ast.Load, ast.Store),
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
    held = {item.variable for item in block.outputs if item.holds}
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
            assigned.add(target.id)
    assert not assigned & (inputs | coefficients), "a literal must be able to stand in their place"
    loaded = {
        node.id
        for statement in body
        for node in ast.walk(statement)
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load)
    }
    assert loaded <= inputs | coefficients | states | held | assigned | numbers | set(HELPERS)
    builtin = {node.func.id for statement in body for node in ast.walk(statement) if isinstance(node, ast.Call)}
    assert not builtin & (inputs | coefficients | states | assigned), "a parameter hides a helper that is called"


@each_step
def test_optional_outputs_are_never_read(block):
    """So that they vanish where they are not programmed."""
    optional = {item.variable for item in block.outputs if not item.required}
    for statement in source_of(block.step).body[:-1]:
        for node in ast.walk(statement):
            assert not (isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load) and node.id in optional)


REALS = st.floats(-9.2e18, 9.2e18) | st.floats(0.001, 100.0)
BY_TYPE = {DataType.INTEGER: int16, DataType.BOOLEAN: st.booleans(), DataType.REAL: REALS}
PYTHON = {DataType.INTEGER: int, DataType.BOOLEAN: bool, DataType.REAL: float}


def variables(block):
    return st.fixed_dictionaries({i.variable: BY_TYPE[i.type] for i in block.inputs if i.form is not Form.LITERAL})


def literals(block):
    chosen = {}
    for item in block.inputs:
        if item.form is Form.LITERAL and item.type is not DataType.REAL:
            whole = item.type is DataType.INTEGER
            chosen[item.variable] = st.integers(item.low, item.high) if whole else BY_TYPE[item.type]
    return st.fixed_dictionaries(chosen)


@each_step
def test_any_values_give_values_of_the_declared_types_and_ranges(block):
    @repeatable
    @given(literals(block), st.lists(variables(block), min_size=1, max_size=12))
    def check(fixed, rows):
        instance = Instance(block, TICK, **fixed)
        for row in rows:
            result = instance.scan(**row)
            for item in block.outputs:
                assert type(result[item.variable]) is PYTHON[item.type]
                assert item.type is not DataType.INTEGER or -32768 <= result[item.variable] <= 32767
            for state in block.states:
                assert type(instance.state[state.name]) is PYTHON[state.type]
            assert instance.error == 0 or f"AMX{instance.error}" in block.problems

    check()


# Copied from the manual. Table 4: 7010 and 6010/6011; table 5: UDC; table 6: PC3000, SCAN_LOOP's with its lost term.
TABLES = """
AND          10.80 + j(1.88)   41 + j(8.3)   10.60 + j(1.45)   7.56 + j(1.32)
DIFFERENCE   10.80             44            7.97              7.56
END          13.82 + t(2.0) + i(1.6) + b(2.2) + d(2.5)   60 + t(3.2) + i(2.8) + b(4.3) + d(4.9)   130.00 + i(2.40) + b(2.50) + d(3.30)   9.68 + t(1.40) + i(1.12) + b(1.56) + d(1.76)
INTEGRATE    39.14             193           58.60             27.40
LAG          26.52             118           41.00             18.56
LATCH        15.04             68            14.85             10.52
LIMIT        18.20             69            15.05             12.76
OR           10.24 + j(1.88)   41 + j(8.3)   8.90 + j(1.45)    7.16 + j(1.32)
PROP_INT     40.32             193           70.85             28.24
PULSE_MULT   18.32             86            18.96             12.84
RAMP         27.72             122           24.96             19.40
SCALE        22.48             98            18.30             15.72
SCAN_LOOP    80.00 + t(1.6) + i(2.5) + b(3.8) + d(4.1)   326 + t(2.4) + i(4.4) + b(6.8) + d(7.2)   350.00 + i(2.20) + b(2.00) + d(3.30)   56.00 + t(1.12) + i(1.76) + b(2.68) + d(2.88)
SUMMER       11.28             44            10.00             7.88
SWITCH       11.52             47            12.55             8.08
TRANSITION   11.36             48            11.90             7.96
REMARK       9.88              40            2.37              6.92
"""  # noqa: E501
ROWS = {line.split()[0]: re.split(r"\s{3,}", line.split(maxsplit=1)[1]) for line in TABLES.strip().splitlines()}


def parsed(text):
    base, *terms = text.split(" + ")
    return Time(float(base), **{term[0]: float(term[2:-1]) for term in terms})


def times_of(name):
    return {"END": END_TIMES, "REMARK": REMARK_TIMES}.get(name) or CATALOGUE[name].times


@pytest.mark.parametrize("name", ROWS)
def test_times_are_those_of_tables_4_to_6(name):
    times = times_of(name)
    found = [times.model_7010, times.model_6010, times.udc, times.pc3000]
    alone = {"SCAN_LOOP": 312.0, "END": 100.0}.get(name, 0.0)
    expected = [parsed(text) for text in ROWS[name]]
    expected[2] = Time(**{**vars(expected[2]), "alone": alone})
    assert found == expected


@pytest.mark.parametrize("name", ROWS)
def test_pc3000_times_are_0_7_of_the_7010s(name):
    times = times_of(name)
    for term, value in vars(times.pc3000).items():
        assert value == pytest.approx(0.7 * getattr(times.model_7010, term), abs=0.041), term


@each_block
def test_times_are_there_for_every_processor_that_runs_the_block(block):
    assert block.name in ROWS
    assert (block.times.udc is not None) == (Processor.UDC in block.runs_on)
    assert (block.times.pc3000 is not None) == (Processor.PC3000 in block.runs_on)
    assert block.times.model_7010 is not None
    assert block.times.model_6010 is not None
