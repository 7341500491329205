"""Any CALL of DC_DRIVE_CML that check accepts: the loop gets what it says, outputs go where they belong."""

from __future__ import annotations

from dataclasses import dataclass

import pytest
from hypothesis import given
from hypothesis import strategies as st

from automax_ros.blocks.catalogue import CATALOGUE
from automax_ros.blocks.declare.declaration import Form, Input
from automax_ros.compile.compiler import CompiledTask
from automax_ros.core.numbers import stored_real
from automax_ros.core.types import DataType, Value
from compile.lowering.test_minor_loop import FORMS
from compile.support import compiled_of, repeatable

BLOCK = CATALOGUE["DC_DRIVE_CML"]
LETTERS = {DataType.INTEGER: "%", DataType.BOOLEAN: "@", DataType.REAL: ""}
LITERALS = {
    "REF_RATE": ("0.0", "0.5", "11.37"), "REF_LAG": ("1.0", "400.0"), "KP": ("0.0", "3.75"), "PI_W_LEAD": ("10.0",),
    "MAX_M_DROPOUT": ("0.1", "0.75"), "IO_CNTL_SLOT": ("0", "15"), "DIG_IO_SLOT": ("3",), "AC_LINE_FREQ": ("50", "60"),
    "AG_FACTOR": ("1", "300"), "CC_THRESH": ("0", "32767"), "TEST_ALPHA": ("0", "180"), "IOC_THRESH": ("100", "179"),
    "LIM_BAR": ("100", "400"), "OSV_THRESH": ("4500",),
}  # fmt: skip
"""Of inputs that are not booleans."""
SIZE = 4
VALUES = {
    DataType.INTEGER: st.integers(-32768, 32767),
    DataType.BOOLEAN: st.booleans(),
    DataType.REAL: st.sampled_from([0.0, 0.25, 7.5, 200.0, -1e6]),
}


@dataclass
class Case:
    """A task, what its variables hold, what the loop must get, and where each output must go."""

    text: str
    commons: dict[str, Value | list[Value]]
    locals: dict[str, Value | list[Value]]
    inputs: list[Value | None]
    targets: list[tuple[int, str, int | None]]


def literal_value(text: str) -> Value:
    return (
        text == "TRUE" if text in ("TRUE", "FALSE") else int(text) if "." not in text else stored_real(float(text))[0]
    )


@st.composite
def cases(draw: st.DrawFn) -> Case:
    commons: dict[str, Value | list[Value]] = {}
    own: dict[str, Value | list[Value]] = {}

    def variable(kind: DataType) -> tuple[str, str, int | None, Value]:
        """A new variable: its text in the CALL, its name, its element, its value."""
        place = draw(st.sampled_from([commons, own]))
        name = f"{'C' if place is commons else 'L'}{len(place)}{LETTERS[kind]}"
        if draw(st.integers(0, 3)):
            value = place[name] = draw(VALUES[kind])
            return name, name, None, value
        values = place[name] = draw(st.lists(VALUES[kind], min_size=SIZE, max_size=SIZE))
        element = draw(st.integers(0, SIZE - 1))
        return f"{name}({element})", name, element, values[element]

    given_texts, inputs = [], []
    for item in BLOCK.inputs:
        if not item.required and draw(st.booleans()):
            inputs.append(item.default)
            continue
        choices = LITERALS.get(item.name, ("TRUE", "FALSE"))
        if item.form is Form.LITERAL or (item.form is Form.ANY and draw(st.booleans())):
            text = draw(st.sampled_from(choices))
            inputs.append(literal_value(text))
        else:
            text, _, _, value = variable(item.type)
            inverted = item.type is DataType.BOOLEAN and draw(st.booleans())
            text = f"-{text}" if inverted else text
            inputs.append(not value if inverted else value)
        given_texts.append(f"{item.name}={text}")
    targets = []
    outputs = [item for item in BLOCK.outputs if not item.dimensions]
    for place, item in enumerate(outputs):
        if draw(st.booleans()):
            text, name, element, _ = variable(item.type)
            given_texts.append(f"{item.name}={text}")
            targets.append((place, name, element))
    call = ", &\n ".join(draw(st.permutations(given_texts)))
    head = "".join(
        f"{line} {declared(name, value)}\n" for line, (name, value) in enumerate({**commons, **own}.items(), 1)
    )
    return Case(f"{head}200 CALL DC_DRIVE_CML({call})\n300 END\n", commons, own, inputs, targets)


def declared(name: str, value: Value | list[Value]) -> str:
    scope = "COMMON" if name.startswith("C") else "LOCAL"
    return f"{scope} {name}({SIZE - 1})" if isinstance(value, list) else f"{scope} {name}"


class ModelIo:
    """A memory of commons by view, and a loop that notes its inputs."""

    def __init__(self, case: Case, compiled: CompiledTask, outcome: tuple[Value, ...] | None) -> None:
        self.names = list(case.commons)
        self.memory = {name: value[:] if isinstance(value, list) else value for name, value in case.commons.items()}
        self.latched, self.written = compiled.latched, len(compiled.written)
        self.outcome, self.seen = outcome, None

    def latch(self):
        return tuple(self.memory[name] for name in self.latched)

    def forces(self):
        return (False,) * self.written

    def commit(self, changes):
        for view, value in changes:
            self.memory[self.names[view]] = value

    def read_now(self, view, element=0):
        value = self.memory[self.names[view]]
        return value[element] if isinstance(value, list) else value

    def write_now(self, view, value, element=0):
        held = self.memory[self.names[view]]
        if isinstance(held, list):
            held[element] = value
        else:
            self.memory[self.names[view]] = value

    def minor_loop(self, inputs, _records):
        self.seen = list(inputs)
        return self.outcome


@pytest.mark.parametrize("form", FORMS)
@repeatable(25)
@given(cases(), st.booleans())
def test_inputs_and_outputs_of_any_call(form, case, writes):
    compiled = compiled_of(case.text)
    fields = [item.name for item in compiled.layout.fields]
    state = [value[:] if isinstance(value := case.locals[name], list) else value for name in fields]
    outputs = [item for item in BLOCK.outputs if not item.dimensions]
    outcome = tuple(n % 3 == 0 if item.type is DataType.BOOLEAN else 1000 + n for n, item in enumerate(outputs))
    io = ModelIo(case, compiled, outcome if writes else None)
    FORMS[form](compiled, io, state)
    assert io.seen == case.inputs
    assert [type(value) for value in io.seen] == [type(value) for value in case.inputs]
    expected = {**case.commons, **case.locals}
    for place, name, element in case.targets if writes else ():
        if element is None:
            expected[name] = outcome[place]
        else:
            expected[name] = [*expected[name][:element], outcome[place], *expected[name][element + 1 :]]
    assert {**io.memory, **dict(zip(fields, state, strict=True))} == expected


def test_literals_are_there_for_every_input_that_takes_one():
    wanted = {item.name for item in BLOCK.inputs if isinstance(item, Input) and item.form is not Form.VARIABLE}
    booleans = {item.name for item in BLOCK.inputs if item.type is DataType.BOOLEAN}
    assert set(LITERALS) == wanted - booleans
