"""Random valid tasks: expressions over all types, IF, FOR, jumps forward, subroutines, arrays, DATA, blocks."""

from __future__ import annotations

from hypothesis import assume
from hypothesis import strategies as st

from automax_ros.blocks.catalogue import CATALOGUE
from automax_ros.core.diagnostics import SourceText
from automax_ros.language.checks.checker import check
from automax_ros.language.program import Program
from compile.support import TICK

DECLARATIONS = """10 LOCAL A%, B%, D!, E!, R, Q, X@, Y@, S$, P$:5, T%(10), U!(2,3), V(4), W@(3)
11 LOCAL F0%, F1%, F2!, FR, G% [CURRENT=3, HIGH=10, LOW=-10], H [CURRENT=1.5, HIGH=9.0, LOW=-9.0]
12 COMMON KA%, KB%, KD!, KR, KX@, KY@, KS$, KT%(4), KV(2), KW@(2), KF%
"""
WRITABLE = {
    "integer": ["A%", "B%", "KA%", "KB%", "T%({i})", "KT%({i})", "D!", "E!", "KD!", "U!({i},{i})"],
    "real": ["R", "Q", "KR", "V({i})", "KV({i})"],
    "boolean": ["X@", "Y@", "KX@", "KY@", "W@({i})", "KW@({i})"],
    "string": ["S$", "P$", "KS$"],
}
READABLE = {
    "integer": [*WRITABLE["integer"], "F0%", "F1%", "F2!", "KF%", "G%"],
    "real": [*WRITABLE["real"], "FR", "H"],
    "boolean": WRITABLE["boolean"],
    "string": WRITABLE["string"],
}
INTEGERS = [
    "0",
    "1",
    "2",
    "3",
    "7",
    "10",
    "15",
    "16",
    "31",
    "100",
    "32767",
    "32768",
    "65535",
    "65536",
    "2147483647",
    "0FFFFH",
    "80000000H",
    "0FFFFFFFFH",
    "7FFFFFFFH",
]
REALS = [
    "0.0",
    "0.5",
    "1.0",
    "1.5",
    "3.25",
    "100.0",
    "32767.9",
    "2.1474836E9",
    "9.2E18",
    "1.0E-19",
    "6.0E-20",
    "1.6777217E7",
]
STRINGS = ['""', '"A"', '"12"', '"3.5E2"', '"LONG TEXT"', '"1E30"', '"-7 "']
PLACES = st.sampled_from(["0", "1", "7", "15", "A%", "B%", "(A% AND 15)", "G%"])
LOOPS = ("F0%", "F1%", "F2!", "FR", "KF%")
REFUSED = {"AMX4024", "AMX2007", "AMX2008", "AMX2019", "AMX4023", "AMX0045", "AMX4056"}
"""What the checker knows of constants: a random task that has one of these is left out."""


@st.composite
def expressions(draw, kind: str, depth: int) -> str:
    if depth == 0 or draw(st.integers(0, 4)) == 0:
        return draw(leaves(kind))
    return draw(_COMPOUND[kind](depth - 1))


def leaves(kind: str):
    variable = st.builds(
        lambda name, index: name.replace("{i}", index),
        st.sampled_from(READABLE[kind]),
        st.sampled_from(["0", "1", "2", "3", "A%", "G%", "B% AND 3", "F0%"]),
    )
    constants = {"integer": INTEGERS, "real": REALS, "boolean": ["TRUE", "FALSE"], "string": STRINGS}
    return variable | variable | st.sampled_from(constants[kind])


def numbers(depth):
    return expressions("integer", depth) | expressions("real", depth)


def operations(operators, left, right):
    return st.builds(lambda a, operator, b: f"({a} {operator} {b})", left, st.sampled_from(operators), right)


def calls(names, *arguments):
    return st.builds(lambda name, *values: f"{name}({', '.join(values)})", st.sampled_from(names), *arguments)


def _integers(depth):
    one, logic = expressions("integer", depth), expressions("boolean", depth)
    chain = st.lists(one, min_size=2, max_size=5).map(" + ".join)
    return st.one_of(
        operations(["+", "-", "*", "*", "/", "**"], one, one),
        operations(["+", "-", "*"], one, one),
        operations(["AND", "OR", "XOR"], one, one),
        operations(["+", "-", "*", "AND"], one, logic),
        operations(["+", "**"], logic, logic),
        one.map(lambda text: f"(-({text}))"),
        st.sampled_from(INTEGERS).map(lambda text: f"(-{text})"),
        st.just("(-2147483648)"),
        one.map(lambda text: f"(NOT ({text}))"),
        chain.map(lambda text: f"({text})"),
        calls(["ABS", "INT", "SGN"], one),
        calls(["INT", "SGN"], expressions("real", depth)),
        calls(["MIN", "MAX"], one, one, one),
        calls(["LEN%", "ASC%"], expressions("string", depth)),
        calls(["BIT_SET%", "BIT_CLR%", "SHIFTL%", "SHIFTR%", "ROTATEL%", "ROTATER%"], one, PLACES),
    )


def _reals(depth):
    one, number = expressions("real", depth), numbers(depth)
    return st.one_of(
        operations(["+", "-", "*", "/"], one, number),
        operations(["+", "-", "*", "/", "**"], number, one),
        operations(["**"], one, expressions("integer", depth)),
        one.map(lambda text: f"(-({text}))"),
        calls(["ABS", "SQRT", "SIN", "ATN", "LN", "EXP"], one),
        calls(["MIN", "MAX"], one, number),
        calls(["SQRT", "EXP"], expressions("integer", depth)),
        calls(["VAL"], expressions("string", depth)),
    )


def _booleans(depth):
    number, logic, text = numbers(depth), expressions("boolean", depth), expressions("string", depth)
    return st.one_of(
        operations(["=", "<>", "<", ">", "<=", ">="], number, number),
        operations(["AND", "OR", "XOR", "=", "<>"], logic, logic),
        operations(["=", "<>"], text, text),
        logic.map(lambda inner: f"(NOT ({inner}))"),
        calls(["BIT_TST@"], expressions("integer", depth), PLACES),
        st.just("TST_ERRLOG@"),
    )


def _strings(depth):
    text, number = expressions("string", depth), expressions("integer", depth)
    return st.one_of(
        operations(["+"], text, text),
        calls(["STR$"], numbers(depth)),
        calls(["CHR$"], number),
        calls(["LEFT$", "RIGHT$"], text, number),
        calls(["MID$"], text, number, expressions("integer", 0)),
    )


_COMPOUND = {"integer": _integers, "real": _reals, "boolean": _booleans, "string": _strings}


@st.composite
def assignments(draw, depth: int = 2) -> str:
    kind = draw(st.sampled_from(["integer", "integer", "real", "boolean", "string"]))
    index = draw(st.sampled_from(["0", "1", "2", "A%", "F1%", "A% AND 1"]))
    target = draw(st.sampled_from(WRITABLE[kind])).replace("{i}", index)
    numeric = kind in ("integer", "real")
    value = draw(numbers(depth)) if numeric else draw(expressions(kind, depth))
    return f"{target} = {value}"


@st.composite
def block_calls(draw) -> str:
    integer, boolean = (
        st.sampled_from(["A%", "B%", "KA%", "KB%", "T%(A%)", "KT%(2)"]),
        st.sampled_from(["X@", "KX@", "KW@(1)"]),
    )
    one, two, out = draw(integer), draw(integer), draw(integer)
    flag, flag_out = draw(boolean), draw(boolean)
    return draw(
        st.sampled_from(
            [
                f"CALL SUMMER(INPUT1={one}, INPUT2={two}, OUTPUT={out})",
                f"CALL DIFFERENCE(INPUT1={one}, INPUT2=5, OUTPUT={out})",
                f"CALL RAMP(INPUT={one}, ACCEL_RATE=100, DECEL_RATE={two}, RESET={flag}, OUTPUT={out})",
                f"CALL LATCH(SET={flag}, RESET=-{flag_out}, OUTPUT={flag_out})",
                f"CALL TRANSITION(INPUT={flag}, OUTPUT={flag_out})",
                f"CALL LAG(INPUT={one}, WLG=2.0, RESET=-{flag}, OUTPUT={out})",
                f"CALL DIFF_LAG(INPUT={one}, WLG=H, RESET={flag}, OUTPUT={out})",
                f"CALL LEAD_LAG(INPUT={one}, WLD=KR, WLG=H, INITIAL_VALUE={two}, RESET={flag}, OUTPUT={out})",
                f"CALL NOTCH(INPUT={one}, Q_FACTOR=KR, WN=2.0, RESET=-{flag}, OUTPUT={out})",
                f"CALL PID(ISA=TRUE, KP=KR, KI=H, KD=R, LOOP_TIME=1.1, INPUT={one}, FEEDBACK={two}, OUTPUT={out})",
                f"CALL PID(KP=H, KI=2.0, LOOP_TIME=0.022, INPUT={one}, FEEDBACK={two}, MANUAL={flag}, OUTPUT={out})",
                f"CALL PROP_INT(INPUT={one}, KP=KR, WLD=H, RESET={flag}, SATURATED_PLUS={flag_out}, OUTPUT={out})",
                f"CALL PULSE_MULT(INPUT={one}, WORD_SIZE=12, MULTIPLIER={two}, OUTPUT={out})",
                f"CALL AMPLIFIER(INPUT1={one}, GAIN1={two}, INPUT2={two}, GAIN2=-7, SCALE={one}, OUTPUT={out})",
                f"CALL MOVE(ENABLE={flag}, INPUT1={one}, OUTPUT1={out})",
                f"CALL MULTIPLY_DIVIDE(INPUT1={one}, INPUT2=300, INPUT3={two}, OUTPUT={out})",
                f"CALL COUNTER(INPUT_PLUS={one}, INPUT_MINUS={two}, PRESET=D!, RESET={flag}, OUTPUT={out})",
                f"CALL RUNNING_AVERAGE(REQUIRED_SAMPLES=3, INPUT={one}, RESET={flag}, OUTPUT={out})",
                f"CALL SAMPLED_AVERAGE(REQUIRED_SAMPLES={two}, INPUT={one}, DATA_VALID={flag_out}, OUTPUT={out})",
                f"CALL S_CURVE(INPUT={one}, ACCEL_RATE=100, JERK_RATE={two}, HOLD={flag}, OUTPUT={out})",
                f"CALL ALARM(INPUT={one}, HIGH_LIMIT={two}, ALARM_HIGH={flag_out})",
            ]
        )
    )


@st.composite
def simple_statements(draw) -> str:
    choice = draw(st.integers(0, 11))
    if choice < 6:
        return draw(assignments())
    if choice < 8:
        return draw(block_calls())
    if choice == 8:
        return f"READ {draw(st.sampled_from(['A%', 'R', 'KD!', 'S$', 'X@', 'T%(A%)', 'A%, KR, D!']))}"
    if choice == 9:
        return f"PRINT {draw(expressions('integer', 1))}; {draw(expressions('real', 1))}, {draw(leaves('string'))}"
    return draw(st.sampled_from(["RESTORE", "RESTORE 16", "CLR_ERRLOG", "REM HERE", "! HERE", "A% = 3 \\ B% = -3"]))


@st.composite
def bodies(draw, depth: int, loops: tuple[str, ...], most: int = 4) -> list:
    """A list of statements: text, or ("if", condition, then, otherwise), ("for", head, variable, body), jumps."""
    items = []
    for _ in range(draw(st.integers(1, most))):
        choice = draw(st.integers(0, 9)) if depth else 0
        if choice < 5:
            items.append(draw(simple_statements()))
        elif choice == 5:
            then = draw(bodies(depth - 1, loops, 3))
            otherwise = draw(st.just([]) | bodies(depth - 1, loops, 3))
            items.append(("if", draw(expressions("boolean", 1)), then, otherwise))
        elif choice == 6 and loops:
            items.append(draw(loop(depth, loops)))
        elif choice == 7:
            short = draw(assignments(1)), draw(assignments(1))
            items.append(f"IF {draw(expressions('boolean', 1))} THEN {short[0]} ELSE {short[1]}")
        elif choice == 8:
            items.append(("goto", draw(expressions("boolean", 1)), draw(st.integers(0, 2)), draw(st.integers(0, 2))))
        else:
            items.append(("on", draw(leaves("integer")), draw(st.booleans()), draw(st.integers(1, 4))))
    return items


@st.composite
def loop(draw, depth: int, loops: tuple[str, ...]):
    variable, others = loops[0], loops[1:]
    small = st.sampled_from(["0", "1", "4", "-2", "(B% AND 3)", "(KA% AND 3)", "G%", "2.5"])
    first, last, step = (
        draw(small),
        draw(small),
        draw(st.sampled_from(["", "", "1", "-1", "2", "(A% AND 1)", "0.5", "H"])),
    )
    if draw(st.integers(0, 7)) == 0 and variable.endswith("%"):
        first, last, step = "32765", "32767", draw(st.sampled_from(["", "1", "2", "(A% AND 1) + 1"]))
    head = f"FOR {variable} = {first} TO {last}" + (f" STEP {step}" if step else "")
    return ("for", head, variable, draw(bodies(depth - 1, others, 3)))


class Writer:
    """Gives the statements line numbers and the jumps their targets."""

    def __init__(self, subroutines: list[int]) -> None:
        self.subroutines = subroutines
        self.lines: list[str] = []
        self.number = 100

    def put(self, text: str) -> None:
        self.lines.append(f"{self.number} {text}")
        self.number += 10

    def body(self, items, around: list[list[int]]) -> None:
        """``around`` are the numbers to which statements in the bodies around may jump, known when they are placed."""
        numbers = self.sizes(items, self.number)
        for position, item in enumerate(items):
            later = [*around, numbers[position + 1 :]]
            if isinstance(item, str):
                self.put(item)
            elif item[0] == "if":
                self.put(f"IF {item[1]} THEN")
                self.body(item[2], later)
                if item[3]:
                    self.put("ELSE")
                    self.body(item[3], later)
                self.put("END_IF")
            elif item[0] == "for":
                self.put(item[1])
                self.body(item[3], later)
                self.put(f"NEXT {item[2]}")
            elif item[0] == "goto":
                self.put(self.jump(item, later))
            else:
                self.put(self.choice(item, later))

    def jump(self, item, later) -> str:
        _, condition, up, ahead = item
        targets = later[max(0, len(later) - 1 - up)]
        if not targets:
            return f"IF {condition} THEN END"
        return f"IF {condition} THEN {targets[min(ahead, len(targets) - 1)]}"

    def choice(self, item, later) -> str:
        _, selector, gosub, count = item
        targets = self.subroutines if gosub else [number for numbers in later for number in numbers]
        if not targets:
            return f"A% = {selector}"
        listed = ", ".join(str(targets[index % len(targets)]) for index in range(count))
        return f"ON {selector} {'GOSUB' if gosub else 'GOTO'} {listed}"

    def sizes(self, items, number: int) -> list[int]:
        """The line numbers that the statements of a body will get."""
        numbers = []
        for item in items:
            numbers.append(number)
            number += 10 * self.size(item)
        return numbers

    def size(self, item) -> int:
        if isinstance(item, str) or item[0] in ("goto", "on"):
            return 1
        if item[0] == "for":
            return 2 + sum(map(self.size, item[3]))
        return 2 + sum(map(self.size, item[2])) + (1 + sum(map(self.size, item[3])) if item[3] else 0)


@st.composite
def tasks(draw, depth: int = 3) -> str:
    """The text of a task; now and then one that the checker refuses for what it knows of constants."""
    main = draw(bodies(depth, LOOPS))
    subroutines = draw(st.lists(bodies(1, ()), max_size=2))
    starts = [20000 + 1000 * index for index in range(len(subroutines))]
    startup = Writer([])
    startup.number = 20
    for _ in range(draw(st.integers(0, 3))):
        startup.put(draw(assignments()))
    writer = Writer(starts)
    writer.body(main, [])
    if subroutines:
        writer.put(f"GOSUB {starts[0]}")
        writer.put("GOTO 29000")
        for start, body in zip(starts, subroutines, strict=True):
            writer.number = start
            writer.body(body, [])
            writer.put("RETURN")
    text = [DECLARATIONS.rstrip(), '15 DATA 1, 2.5, TRUE, "TEXT", -3', "16 DATA 40000, 9.0E18", *startup.lines]
    return "\n".join([*text, "90 CALL SCAN_LOOP(TICKS=4)", *writer.lines, "29000 END"]) + "\n"


def checked(text: str) -> Program:
    """The checked task; a test's example is left out where constants are at fault, and fails on any other error."""
    result = check(SourceText("task.blk", text), name="TASK", catalogue=CATALOGUE, tick_ns=TICK)
    if result.program is None:
        wrong = [item for item in result.diagnostics if item.severity.value == "error" and item.code not in REFUSED]
        assert not wrong, (wrong[0], text)
    assume(result.program is not None)
    assert result.program is not None
    return result.program


@st.composite
def outside_writes(draw) -> dict[str, object]:
    """What another writes into simple commons between two scans."""
    edges = st.sampled_from([-32768, -1, 0, 1, 3, 32767])
    values = {
        "KA%": edges,
        "KB%": edges,
        "KD!": edges | st.sampled_from([-(2**31), 2**31 - 1]),
        "KR": st.sampled_from([0.0, -1.5, 2.5, 2.0**62]),
        "KX@": st.booleans(),
        "KS$": st.sampled_from(["", "7", "AB"]),
    }
    names = draw(st.lists(st.sampled_from(sorted(values)), max_size=4, unique=True))
    return {name: draw(values[name]) for name in names}
