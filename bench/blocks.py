"""Time of each block in a compiled scan, over the 7010 Processor's (J-3676-5, Table 4). Prints ratios, never fails.

Each block is programmed with every parameter: inputs are variables that change from scan to scan where the block allows
it, all outputs are wired. Coefficients of dynamic blocks are literals, which cost nothing in a scan. The cost of the
empty scan is subtracted. A separate table shows, as information, the cost of a REAL coefficient that changes in every
scan, so that all coefficients of the block are computed again.
"""

from __future__ import annotations

from _harness import Loop, ns_in_turn, scan_ns, scans_of, task_of

from automax_ros.blocks.catalogue import CATALOGUE
from automax_ros.blocks.declare.declaration import Access, Block, Form, Input, Platform, Special, Time
from automax_ros.blocks.scan_loop import END_TIMES
from automax_ros.core.types import DataType

COPIES = 40
FEW_COPIES = 2
"""Copies of blocks that take so long that fewer are enough."""
COEFFICIENTS = {
    **dict.fromkeys(("KP", "KI"), "0.5"),
    **dict.fromkeys(("WLG", "WM", "WN"), "20.0"),
    "KD": "0.05",
    "LOOP_TIME": "0.011",
    "Q_FACTOR": "2.0",
    "WLD": "8.0",
}
LITERALS = {"WORD_SIZE": "12", "ABS_RAMP": "TRUE", "SCALE": "100", "MAX_COLUMNS": "20", "COMPARE_GTR": "TRUE"}
INPUTS = ("IN_W%", "LOW_W%", "HIGH_W%", "IN_B@", "OFF_B@", "IN_D!")
VALUES = (0, 1200, -700, 4095, 90, -4095, 2000, 3)
LOW = ("INPUT_MIN", "OUTPUT_IMIN", "LIMIT_MINUS", "LOW_LIMIT", "LOW_LOW_LIMIT")
HIGH = (
    *("LIMIT_PLUS", "INPUT_MAX", "OUTPUT_IMAX", "ACCEL_RATE", "DECEL_RATE", "JERK_RATE", "MULTIPLIER", "HIGH_LIMIT"),
    *("HIGH_HIGH_LIMIT", "INPUT3", "SCALE"),
)
OFF = ("RESET", "HOLD", "HOLD_PLUS", "HOLD_MINUS")
ON = ("ENABLE", "SHIFT")
TABLE = 16
"""Elements of the table that SEARCH searches; INPUT matches none of them, so that it searches all."""


def literal_of(item: Input) -> str:
    """Return a sensible literal for an input that must or should be a literal."""
    if item.name == "ORDER":
        return str(item.one_of[-1])
    if item.name in COEFFICIENTS:
        return COEFFICIENTS[item.name]
    if item.sample is not None and not isinstance(item.sample, bool):
        return str(item.sample)
    default = str(item.default or 5) if item.default != 0 else "0"
    return LITERALS.get(item.name, "FALSE" if item.type is DataType.BOOLEAN else default)


def variable_of(block: Block, item: Input) -> str:
    """Return the variable for an input."""
    if item.name == "COLUMN":
        return "COLUMN_W%"
    if item.type is DataType.DOUBLE:
        return "IN_D!"
    if item.type is DataType.BOOLEAN:
        return "OFF_B@" if item.name in OFF else "-OFF_B@" if item.name in ON else "IN_B@"
    if item.name in LOW or (block.name == "SEARCH" and item.name == "INPUT"):
        return "LOW_W%"
    return "HIGH_W%" if item.name in HIGH else "IN_W%"


def call_text(block: Block, number: int, changing: str = "") -> tuple[str, list[str]]:
    """Return one CALL with every parameter, and the variables it needs; ``changing`` is the input that gets COEF."""
    parts, variables = [], []
    for item in block.inputs:
        if item.type is Special.TABLE:
            parts.append(f"{item.name}=TABLE%")
        elif isinstance(item.type, Special):
            parts.append(f"{item.name}={structure_of(block, number)}")
        elif item.name == changing:
            parts.append(f"{item.name}=COEF")
        elif item.form is Form.LITERAL or (block.coefficients and item.name in block.coefficients.parameters):
            parts.append(f"{item.name}={literal_of(item)}")
        else:
            parts.append(f"{item.name}={variable_of(block, item)}")
    for output in block.outputs:
        name = f"O{number}_{len(variables)}{output.type.value}"
        variables.append(name)
        parts.append(f"{output.name}={name}")
    return f"CALL {block.name}({', '.join(parts)})", variables


def structure_of(block: Block, number: int) -> str:
    """Return the name of a data structure: each SHIFT block makes its own, READ and WRITE use that of the first."""
    mark = "@" if block.name.endswith("BITS") else "%"
    return f"QUEUE{number if block.structure is Access.MAKES else ''}{mark}"


def block_ns(block: Block, table: int = TABLE, changing: str = "") -> float:
    """Return the time of one call in ns; ``changing`` is a coefficient that changes in every scan."""
    calls, names = (
        [],
        [*INPUTS, "COLUMN_W%", "SPARE%", "SPARE@", f"TABLE%({table - 1 if block.name == 'SEARCH' else 256})"],
    )
    copies = FEW_COPIES if changing else COPIES
    for number in range(copies):
        text, outputs = call_text(block, number, changing)
        calls.append(text)
        names += outputs
    lines = [f"{100 + n} {'COMMON' if name in INPUTS else 'LOCAL'} {name}" for n, name in enumerate(names)]
    lines += ["19999 COMMON COEF"] if changing else []
    lines += [f"20000 CALL SCAN_LOOP(TICKS={20 if block.times.model_7010 is None else 2})"]
    if block.structure is Access.USES:
        lines.append(f"20001 {shift_text(block)}")
    target = Platform.UDC if block.times.model_7010 is None else Platform.AUTOMAX
    coefficient = float(COEFFICIENTS[changing]) if changing else None
    empty = _varied("\n".join([*lines, "30000 END"]), target, coefficient)
    full = _varied(
        "\n".join([*lines, *(f"{21001 + n} {call}" for n, call in enumerate(calls)), "30000 END"]), target, coefficient
    )
    return ns_in_turn([Loop(full.whole, empty.whole, full.passes * copies)])[0]


def shift_text(block: Block) -> str:
    """Return the SHIFT block that makes the data structure of READ and WRITE blocks."""
    mark, shift = ("@", "SHIFT_BITS") if block.name.endswith("BITS") else ("%", "SHIFT_WORDS")
    source = "IN_B@" if mark == "@" else "IN_W%"
    pairs = ", ".join(f"INPUT{n}={source}, OUTPUT{n}=SPARE{mark}" for n in range(1, 9))
    return f"CALL {shift}(STRUCTURE_NAME=QUEUE{mark}, MAX_COLUMNS=20, SHIFT=-OFF_B@, {pairs})"


def _varied(text: str, target: Platform, coefficient: float | None = None) -> Loop:
    """Return scans of a task whose inputs change from scan to scan, and COEF where there is one."""
    task, memory = task_of(text, target)
    word, low, high, flag = (memory.view(name) for name in ("IN_W%", "LOW_W%", "HIGH_W%", "IN_B@"))
    memory.write_now(low, -4000, 1)
    memory.write_now(high, 4000, 1)
    write = memory.write_now

    def vary(number: int) -> None:
        write(word, VALUES[number & 7], 1)
        write(flag, number & 3 == 1, 1)

    if coefficient is None:
        return scans_of(task, vary)
    changing, changed = memory.view("COEF"), [coefficient * (1.0 + 0.01 * number) for number in range(8)]

    def vary_all(number: int) -> None:
        vary(number)
        write(changing, changed[number & 7], 1)

    return scans_of(task, vary_all)


def manual_us(block: Block) -> float:
    """Return the manual's time of the block as programmed here: on the 7010, or the UDC where only that runs it."""
    time = block.times.model_7010 or block.times.udc
    assert time is not None
    channels = sum(item.name[-1].isdigit() for item in block.inputs)
    pairs = sum(item.name.startswith("INPUT") for item in block.inputs)
    orders = [item.one_of[-1] for item in block.inputs if item.name == "ORDER"]
    ordered = time.base + time.o * sum(orders)
    return ordered + time.n * len(block.outputs) + time.j * channels + (time.k + time.p) * pairs + time.m * TABLE


def commons_ns(number: int) -> float:
    """Return the time of a scan that latches INTEGER commons and has no block."""
    lines = [f"{10 + n} COMMON C{n}%" for n in range(number)]
    task, _ = task_of("\n".join([*lines, "1000 CALL SCAN_LOOP(TICKS=2)", "9999 END"]))
    return scan_ns(task)


def commons_manual_us(number: int) -> float:
    """Return SCAN_LOOP + END of Table 4 for a number of INTEGER commons."""
    total = 0.0
    for time in (CATALOGUE["SCAN_LOOP"].times.model_7010, END_TIMES.model_7010):
        assert isinstance(time, Time)
        total += time.base + number * (time.t + time.i)
    return total


PROGRAM = """
100 COMMON LINE_SP%, TRIM%, START@, STOP@, READY@, JOG@, FDBK%, COUNT%
101 COMMON SPEED_REF%, CUR_REF%, RUN@, ALARM@, LENGTH%
110 LOCAL A%, B%, C%, D%, E%, F%, G%, H%, I%, J%, K%, L%, M%, N%, O%, P%, Q%, R%, S%, T%, U%, V%, W%, X%, Y%, Z%
120 LOCAL B0@, B1@, B2@, B3@, B4@, B5@, B6@, B7@, B8@, S0@, S1@
200 CALL SCAN_LOOP(TICKS=2)
210 CALL AND(INPUT1=START@, INPUT2=READY@, INPUT3=-STOP@, OUTPUT=B0@)
211 CALL OR(INPUT1=STOP@, INPUT2=-READY@, OUTPUT=B1@)
212 CALL LATCH(SET=B0@, RESET=B1@, OUTPUT=RUN@)
213 CALL TRANSITION(INPUT=RUN@, OUTPUT=B2@)
214 CALL AND(INPUT1=RUN@, INPUT2=-JOG@, OUTPUT=B3@)
215 CALL OR(INPUT1=B3@, INPUT2=JOG@, OUTPUT=B4@)
216 CALL AND(INPUT1=B4@, INPUT2=READY@, OUTPUT=B5@)
217 CALL OR(INPUT1=B2@, INPUT2=B1@, OUTPUT=B6@)
218 CALL LATCH(SET=B6@, RESET=B5@, OUTPUT=B7@)
219 CALL AND(INPUT1=B7@, INPUT2=START@, OUTPUT=ALARM@)
220 CALL SWITCH(INPUT1=LINE_SP%, INPUT2=200, SELECT=B3@, OUTPUT=A%)
221 CALL SWITCH(INPUT1=A%, INPUT2=0, SELECT=B4@, OUTPUT=B%)
222 CALL SWITCH(INPUT1=TRIM%, INPUT2=0, SELECT=RUN@, OUTPUT=C%)
230 CALL RAMP(INPUT=B%, RESET=B1@, ACCEL_RATE=200, DECEL_RATE=300, SCALE=91, OUTPUT=D%)
231 CALL RAMP(INPUT=C%, ACCEL_RATE=50, DECEL_RATE=50, SCALE=91, ABS_RAMP=FALSE, OUTPUT=E%)
240 CALL SCALE(INPUT=D%, INPUT_MAX=4095, INPUT_MIN=0, OUTPUT_IMAX=4000, OUTPUT_IMIN=0, OUTPUT=F%)
241 CALL SCALE(INPUT=E%, INPUT_MAX=1000, INPUT_MIN=-1000, OUTPUT_IMAX=200, OUTPUT_IMIN=-200, OUTPUT=G%)
242 CALL SCALE(INPUT=FDBK%, INPUT_MAX=4095, INPUT_MIN=0, OUTPUT_IMAX=4000, OUTPUT_IMIN=0, CLAMP=TRUE, OUTPUT=H%)
243 CALL SCALE(INPUT=H%, INPUT_MAX=4000, INPUT_MIN=0, OUTPUT_IMAX=1000, OUTPUT_IMIN=0, OUTPUT=I%)
250 CALL SUMMER(INPUT1=F%, INPUT2=G%, OUTPUT=SPEED_REF%)
251 CALL DIFFERENCE(INPUT1=SPEED_REF%, INPUT2=H%, OUTPUT=J%)
252 CALL SUMMER(INPUT1=J%, INPUT2=I%, OUTPUT=K%)
253 CALL DIFFERENCE(INPUT1=K%, INPUT2=I%, OUTPUT=L%)
254 CALL SUMMER(INPUT1=L%, INPUT2=10, OUTPUT=M%)
255 CALL DIFFERENCE(INPUT1=M%, INPUT2=10, OUTPUT=N%)
256 CALL SUMMER(INPUT1=N%, INPUT2=A%, OUTPUT=O%)
257 CALL DIFFERENCE(INPUT1=O%, INPUT2=A%, OUTPUT=P%)
260 CALL PROP_INT(INPUT=P%, KP=0.8, WLD=1.5, RESET=-RUN@, LIMIT_PLUS=4095, LIMIT_MINUS=-4095, OUTPUT=Q%)
261 CALL PROP_INT(INPUT=J%, KP=0.4, WLD=3.0, RESET=-RUN@, OUTPUT=R%)
262 CALL PROP_INT(INPUT=L%, KP=0.2, WLD=3.0, OUTPUT=S%, SATURATED_PLUS=S0@)
263 CALL PROP_INT(INPUT=N%, KP=0.2, WLD=1.0, OUTPUT=T%)
270 CALL LAG(INPUT=Q%, WLG=10.0, OUTPUT=U%)
271 CALL LAG(INPUT=R%, WLG=20.0, OUTPUT=V%)
272 CALL LAG(INPUT=S%, WLG=5.0, RESET=B1@, OUTPUT=W%)
273 CALL LAG(INPUT=FDBK%, WLG=30.0, OUTPUT=X%)
280 CALL LIMIT(INPUT=U%, LIMIT_PLUS=4095, LIMIT_MINUS=-4095, OUTPUT=CUR_REF%)
281 CALL LIMIT(INPUT=V%, LIMIT_PLUS=2000, LIMIT_MINUS=-2000, SATURATED_PLUS=S1@, OUTPUT=Y%)
282 CALL PULSE_MULT(INPUT=COUNT%, WORD_SIZE=12, MULTIPLIER=8192, OUTPUT=LENGTH%)
283 CALL INTEGRATE(INPUT=W%, KI=0.5, LIMIT_PLUS=1000, LIMIT_MINUS=-1000, OUTPUT=Z%)
284 CALL TRANSITION(INPUT=B7@, OUTPUT=B8@)
9999 END
"""
PROGRAM_BLOCKS = 40


def program_ns() -> float:
    """Return the time of one scan of the program of 40 blocks, including latch and write-back."""
    task, memory = task_of(PROGRAM)
    views = [memory.view(name) for name in ("LINE_SP%", "FDBK%", "COUNT%", "START@", "READY@")]
    memory.write_from_outside(views[0], 3000, 1)
    memory.write_from_outside(views[3], True, 1)
    memory.write_from_outside(views[4], True, 1)
    feedback, count, write = views[1], views[2], memory.write_now

    def vary(number: int) -> None:
        write(feedback, number & 2047, 1)
        write(count, number * 7 & 4095, 1)

    return scan_ns(task, vary)


def main() -> None:
    """Print all figures."""
    print(f"{'block':20}{'ns':>9}{'7010 us':>10}{'ratio':>9}")
    worst = min(((manual_us(block) * 1000 / report(block)), block.name) for block in timed_blocks())
    print(f"lowest ratio {worst[0]:.0f} ({worst[1]}); wanted: at least 40")
    search = CATALOGUE["SEARCH"]
    element = (block_ns(search, 10 * TABLE) - block_ns(search)) / (9 * TABLE)
    assert search.times.model_7010 is not None
    manual = search.times.model_7010.m
    print(f"SEARCH, each element: {element:.1f} ns, 7010 {manual:.2f} us, ratio {manual * 1000 / element:.0f}\n")
    print(f"{'commons':>8}{'scan ns':>10}{'7010 us':>10}{'ratio':>9}   SCAN_LOOP + END")
    for number in (0, 10, 100):
        taken, manual = commons_ns(number), commons_manual_us(number)
        print(f"{number:>8}{taken:>10.0f}{manual:>10.1f}{manual * 1000 / taken:>9.0f}")
    report_changing()
    whole = program_ns()
    each = whole / PROGRAM_BLOCKS
    print(f"\nprogram of {PROGRAM_BLOCKS} blocks: {whole:.0f} ns per scan, {each:.1f} ns per block; wanted: at most 80")


def report_changing() -> None:
    """Print the time of each block with a coefficient that changes in every scan."""
    print(f"\n{'changing':20}{'ns':>9}{'7010 us':>10}{'ratio':>9}   coefficient, a new value in every scan")
    for block in timed_blocks():
        name = changing_of(block)
        if name:
            taken, manual = block_ns(block, changing=name), manual_us(block)
            print(f"{block.name:20}{taken:>9.0f}{manual:>10.2f}{manual * 1000 / taken:>9.0f}   {name}")


def changing_of(block: Block) -> str:
    """Return the first REAL coefficient of a block that may be a variable, "" where there is none."""
    names = () if block.coefficients is None else block.coefficients.parameters
    return next(
        (
            item.name
            for item in block.inputs
            if item.name in names and item.type is DataType.REAL and item.form is not Form.LITERAL
        ),
        "",
    )


def timed_blocks() -> list[Block]:
    """Return the blocks that a scan executes."""
    return [block for block in CATALOGUE.values() if block.step is not None]


def report(block: Block) -> float:
    """Print one block's line and return its time in ns."""
    taken, manual = block_ns(block), manual_us(block)
    note = "   UDC's time" if block.times.model_7010 is None else ""
    print(f"{block.name:20}{taken:>9.1f}{manual:>10.2f}{manual * 1000 / taken:>9.0f}{note}")
    return taken


if __name__ == "__main__":
    main()
