"""Expressions of BASIC: 32 bits with clamps, truncation, one overflow a statement, no short circuit (semantics)."""

from __future__ import annotations

import dataclasses

import pytest
from hypothesis import strategies as st
from soaking import holds_for

from automax_ros.compile.compiler import compile_program
from automax_ros.core.types import DataType
from automax_ros.language.program import Program
from automax_ros.language.tree.tree import Assignment
from automax_ros.runtime.memory.memory import CommonMemory
from automax_ros.runtime.tasks.task import Task
from compile.interpreter import Interpreter
from compile.native.test_random_tasks import compare, installed
from compile.programs import DECLARATIONS, checked, expressions, numbers
from compile.support import OTHER, lines, logged, program_of, ran

LOW, HIGH = -(2**31), 2**31 - 1
INTEGERS = [-32768, -32767, -1, 0, 1, 2, 3, 32766, 32767]
DOUBLES = [LOW, LOW + 1, -65536, -32769, *INTEGERS, 32768, 46341, 65536, HIGH - 1, HIGH]
REALS = [0.0, 1.0, -1.0, 0.5, -2.5, 32767.5, -32768.5, 2147483648.0, -2147483904.0, 9.223371487098962e18, 1e-19, -3e-20]
EDGES = {
    DataType.INTEGER: st.sampled_from(INTEGERS),
    DataType.DOUBLE: st.sampled_from(DOUBLES),
    DataType.REAL: st.sampled_from(REALS),
    DataType.BOOLEAN: st.booleans(),
    DataType.STRING: st.sampled_from(["", "A", "7", "-1.5E2", "12345"]),
}


def simple_names(program: Program) -> list[str]:
    return [name for name, symbol in program.symbols.items() if not symbol.dimensions and symbol.tuning is None]


def agree_on_values(program: Program, values: dict[str, object]) -> None:
    task, memory = installed(program)
    model = Interpreter(program)
    task.run()
    model.run()
    for name, value in values.items():
        if name in model.locals:
            model.locals[name] = task.state[task.compiled.layout.index(name)] = value
        else:
            model.commons[name] = value
            memory.write_from_outside(memory.view(name), value, OTHER)
    record = task.scan(1)
    model.scan()
    compare(task, memory, model, record)


@st.composite
def statements(draw) -> str:
    kind = draw(st.sampled_from(["number", "number", "number", "boolean", "string"]))
    target = {"number": ["A%", "D!", "KD!", "KA%", "R", "KR"], "boolean": ["X@", "KX@"], "string": ["S$", "P$"]}[kind]
    value = draw(numbers(4) if kind == "number" else expressions(kind, 3))
    return f"{draw(st.sampled_from(target))} = {value}"


@holds_for(70, st.data(), statements(), soak=(2000, (st.data(), statements())))
def test_compiled_expressions_are_those_of_the_interpreter(data, statement) -> None:
    program = checked(f"{DECLARATIONS}20 CALL SCAN_LOOP(TICKS=4)\n100 {statement}\n200 END\n")
    used = [name for name in simple_names(program) if name in statement]
    agree_on_values(program, {name: data.draw(EDGES[program.symbols[name].type]) for name in used})


VARIABLE_EDGES = {"A%": INTEGERS, "B%": INTEGERS, "D!": DOUBLES, "E!": DOUBLES, "R": REALS, "Q": REALS}
TWO_OPERANDS = [f"{{0}} {operator} {{1}}" for operator in ("+", "-", "*", "/", "**", "AND", "OR", "XOR")]
BOUNDED = [
    *TWO_OPERANDS,
    *(f"({text}) - 1" for text in TWO_OPERANDS),
    "-({0} - {1})",
    "ABS({0}) + {1}",
    "NOT {0} * 2",
    "MIN({0}, {1}) - MAX({0}, {1}, 5)",
    "SGN({0}) * {1}",
    "INT({0}) + 1",
]


@pytest.mark.parametrize("names", [("A%", "B%"), ("D!", "A%"), ("D!", "E!"), ("A%", "D!")], ids=" ".join)
@pytest.mark.parametrize("target", ["C%", "D!"])
def test_bounds_never_leave_out_a_clamp(names, target):
    """Every operation at every pair of edges: what the static bounds leave out must not be needed."""
    text = lines(*(f"{target} = {form.format(*names)}" for form in BOUNDED))
    program = program_of(text)
    single = [
        dataclasses.replace(program, scan=(statement,))
        for statement in program.scan
        if isinstance(statement, Assignment)
    ]
    for part in single:
        compiled = compile_program(part, {})
        for first in VARIABLE_EDGES[names[0]]:
            for second in VARIABLE_EDGES[names[1]]:
                task, model = Task(compiled, CommonMemory([])), Interpreter(part)
                task.record_scans()
                for name, value in ((names[0], first), (names[1], second)):
                    task.state[compiled.layout.index(name)] = model.locals[name] = value
                task.run()
                record = task.scan(0)
                model.scan()
                assert (task.value(target), record.errors) == (model.locals[target], model.log), (first, second)


@pytest.mark.parametrize(
    ("expression", "value"),
    [
        ("7 / 2", 3),
        ("-7 / 2", -3),
        ("7 / (-2)", -3),
        ("-2147483648", LOW),
        ("0FFFFFFFFH", -1),
        ("0FFFFH", 65535),
        ("2 ** 3 ** 2", 64),
        ("-3 ** 2", 9),
        ("2 ** 30", 2**30),
        ("(-2) ** 31", LOW),
        ("2 ** (-1)", 0),
        ("(-1) ** (-3)", -1),
        ("7 AND 12", 4),
        ("7 OR 12", 15),
        ("7 XOR 12", 11),
        ("NOT 0", -1),
        ("TRUE + TRUE", 2),
        ("TRUE ** 1", 1),
        ("5 AND TRUE", 1),
        ("1 + 2 * 3", 7),
        ("INT(-2.9)", -2),
        ("SGN(-0.5)", -1),
        ("MIN(3, 1, 2)", 1),
        ("LEN%(\"ABC\") + ASC%(\"A\")", 68),
        ("BIT_SET%(0, 15)", -32768),
        ("BIT_CLR%(-1, 0)", -2),
        ("SHIFTL%(1, 15)", -32768),
        ("SHIFTR%(-32768, 15)", 1),
        ("ROTATEL%(-32768, 1)", 1),
        ("ROTATER%(1, 1)", -32768),
        ("BIT_SET%(65536, 0)", 1),
    ],
)  # fmt: skip
def test_integers(expression, value):
    """Precedence: parentheses, signs, ** from the left, * /, + -, relations, NOT, AND, OR XOR."""
    task = ran(f"D! = {expression}")
    assert (task.value("D!"), type(task.value("D!")), logged(task)) == (value, int, [])


@pytest.mark.parametrize(
    ("statement", "name", "value", "code"),
    [
        ("D! = 2147483647 + A%", "D!", HIGH, 7023),
        ("D! = -2147483648 - A%", "D!", LOW, 7023),
        ("D! = -(-2147483648 * A%)", "D!", HIGH, 7023),
        ("D! = ABS(-2147483648 * A%)", "D!", HIGH, 7023),
        ("D! = D! - 80000000H", "D!", HIGH, 7023),
        ("D! = -2147483648 / (-A%)", "D!", HIGH, 7023),
        ("D! = (A% + 1) ** 31", "D!", HIGH, 7023),
        ("D! = (-A% - 2) ** 21", "D!", LOW, 7023),
        ("B% = A% + 32767", "B%", 32767, 7020),
        ("B% = -A% * 40000", "B%", -32768, 7020),
        ("D! = 3.0E9 * A%", "D!", HIGH, 7021),
        ("R = 9.0E18 * (A% + 1)", "R", 9.223371487098962e18, 7022),
        ("R = -9.0E18 * (A% + 1)", "R", -9.223371487098962e18, 7022),
        ("D! = 5 / (A% - 1)", "D!", HIGH, 7024),
        ("D! = -5 / (A% - 1)", "D!", LOW, 7024),
        ("D! = (A% - 1) / (A% - 1)", "D!", 0, 7024),
        ("D! = (A% - 1) ** (-1)", "D!", HIGH, 7024),
        ("R = -5.0 / (A% - 1)", "R", -9.223371487098962e18, 7024),
        ("R = SQRT(-A%)", "R", 0.0, 7025),
        ("R = LN(A% - 1)", "R", 0.0, 7025),
        ("R = (-2.0) ** (A% / 2.0)", "R", 0.0, 7025),
        ('S$ = CHR$(A% + 255)', "S$", "", 7025),
        ('A% = ASC%(S$)', "A%", 0, 7025),
        ("R = EXP(A% * 1000)", "R", 9.223371487098962e18, 7023),
        ("B% = SHIFTL%(A%, A% + 15)", "B%", 1, 7025),
        ("B% = T%(A% + 10)", "B%", 0, 7026),
        ("B% = T%(-A%)", "B%", 0, 7026),
    ],
)  # fmt: skip
def test_what_a_statement_logs(statement, name, value, code):
    task = ran("A% = 1", statement)
    assert (task.value(name), logged(task)) == (value, [(40, code)])


def test_one_statement_logs_one_overflow_the_first():
    task = ran("A% = 30000", "B% = A% * A% * A% * A% + A%")
    assert logged(task) == [(40, 7023)]


def test_there_is_no_short_circuit():
    task = ran("X@ = FALSE AND 1 / A% > 0", "Y@ = TRUE OR T%(A% - 1) = 0")
    assert logged(task) == [(30, 7024), (40, 7026)]
    assert (task.value("X@"), task.value("Y@")) == (False, True)


def test_an_array_element_out_of_range_is_not_written():
    task = ran("A% = 11", "T%(A%) = 5", "T%(A% - 1) = 6")
    assert (task.value("T%"), logged(task)) == ([0] * 10 + [6], [(40, 7026)])


def test_the_last_subscript_counts_fastest_and_each_is_tested():
    task = ran("M%(1,0) = 7", "A% = 3", "M%(0,A%) = 9", declare="LOCAL M%(1,2), A%")
    assert (task.value("M%"), logged(task)) == ([0, 0, 0, 7, 0, 0], [(50, 7026)])


def test_reals_round_to_24_bits_on_the_store_only():
    task = ran("R = 1.6777217E7", "Q = 1.6777217E7 - 1.6777216E7")
    assert (task.value("R"), task.value("Q")) == (16777216.0, 1.0)


def test_small_reals_become_zero():
    """2.4.2: 5.4210107E-20, 2.7105054E-20 for negative values."""
    task = ran("R = 1.0E-19 / 2", "Q = -1.0E-19 / 3")
    assert (task.value("R"), task.value("Q")) == (0.0, pytest.approx(-1e-19 / 3, rel=1e-6))


def test_strings_are_cut_to_132_in_expressions_and_to_their_length_in_variables():
    task = ran('S$ = "ABCDEFGHIJ"', "A% = LEN%(L$ + L$)", 'P$ = S$ + "X"', declare="LOCAL S$, P$:4, L$:100, A%")
    assert task.value("P$") == "ABCD"
    hundred = ["L$ = L$ + S$"] * 10
    task = ran('S$ = "ABCDEFGHIJ"', *hundred, "A% = LEN%(L$ + L$)", declare="LOCAL S$, L$:100, A%")
    assert task.value("A%") == 132
