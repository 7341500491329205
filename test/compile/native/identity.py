"""A task's native scans against its Python scans: all that they touch, the states that they leave, bit for bit."""

from __future__ import annotations

import random

from automax_ros.compile.base.scan_io import ScanTooLong
from automax_ros.compile.compiler import CompiledTask
from automax_ros.compile.native.run.task import NativeTask
from automax_ros.core.numbers import stored_real
from automax_ros.core.types import DataType, Value, type_of_name

EDGES = (-32768, -32767, -1, 0, 1, 2, 32766, 32767)
WIDE_EDGES = (-(2**31), 1 - 2**31, -65536, 65535, 2**31 - 1)
REALS = (0.0, -0.0, 1e-19, 0.5, -0.5, 1.0, 2.0, -2.25, 3.7, 10.0, 63.0, 200.0, 1e6, 32767.5, -32768.5, 2.2e9, 9.2e18)
SMALL_NAMES = ("LJ%", "KJ%", "A%", "G%")
"""Variables that are used as subscripts: mostly small."""


def some_value(draw: random.Random, name: str) -> Value:
    """A value of a variable's type, often one where rules change."""
    kind = type_of_name(name)
    if kind is DataType.BOOLEAN:
        return draw.random() < 0.5
    if kind is DataType.REAL:
        return draw.choice(REALS) if draw.random() < 0.5 else stored_real(draw.uniform(-100.0, 100.0))[0]
    if name in SMALL_NAMES and draw.random() < 0.9:
        return draw.randint(-1, 4)
    if kind is DataType.DOUBLE and draw.random() < 0.5:
        return draw.choice(WIDE_EDGES) if draw.random() < 0.5 else draw.randint(-(2**31), 2**31 - 1)
    choice = draw.random()
    return (
        draw.choice(EDGES) if choice < 0.3 else draw.randint(-32768, 32767) if choice < 0.6 else draw.randint(-50, 50)
    )


class Surroundings:
    """What a scan touches: it answers by a random source of its own and notes all that is asked and said."""

    def __init__(self, compiled: CompiledTask, seed: int) -> None:
        self.compiled, self.draw = compiled, random.Random(seed)
        self.names = {view: name for name, view in compiled.form("scans").views.items()}
        self.said: list[object] = []
        self.held = {name: some_value(self.draw, name) for name in compiled.latched}

    def latch(self) -> tuple[Value, ...]:
        for name in self.held:
            if self.draw.random() < 0.3:
                self.held[name] = some_value(self.draw, name)
        return tuple(self.held.values())

    def forces(self) -> tuple[bool, ...]:
        return tuple(self.draw.random() < 0.5 for _ in self.compiled.written)

    def commit(self, changes: list[tuple[int, Value]]) -> None:
        self.said.append(("commit", repr(changes)))
        for view, value in changes:
            self.held[self.names[view]] = value

    def read_now(self, view: int, element: int = 0) -> Value:
        value = some_value(self.draw, self.names[view])
        self.said.append(("read", view, element, value))
        return value

    def write_now(self, view: int, value: Value, element: int = 0) -> None:
        self.said.append(("write", view, element, repr(value)))

    def log(self, line: int, code: int) -> None:
        self.said.append(("log", line, code))

    def errors_logged(self) -> bool:
        return self.draw.random() < 0.5

    def clear_errors(self) -> None:
        self.said.append("clear")

    def io_read(self, slot: int, register: int) -> tuple[int, int]:
        self.said.append(("io_read", slot, register))
        return self.draw.choice([(5, 0), (-32768, 0), (0, 7031)])

    def io_write(self, slot: int, register: int, value: int) -> int:
        self.said.append(("io_write", slot, register, repr(value)))
        return self.draw.choice([0, 7031])


def assert_same(native: NativeTask, stretches: int, scans: int, *, forced: bool = False, seed: int = 1) -> None:
    """Both forms execute ``stretches`` of ``scans`` each; between them the variables of the task are set again."""
    compiled = native.compiled
    both = [Surroundings(compiled, seed), Surroundings(compiled, seed)]
    forms = [
        compiled.scans_forced if forced else compiled.scans,
        native.scans_forced if forced else native.scans,
    ]
    states = [compiled.layout.fresh(), compiled.layout.fresh()]
    draw = random.Random(seed)
    for stretch in range(stretches):
        executing = [form(state, io) for form, state, io in zip(forms, states, both, strict=True)]
        for scan in range(scans):
            ends = [_end_of(scans_of) for scans_of in executing]
            said = [io.said for io in both]
            assert ends[0] == ends[1], (stretch, scan, said[0][-3:], said[1][-3:])
            assert said[0] == said[1], (stretch, scan, _first_difference(*said))
            for io in both:
                io.said.clear()
            if ends[0] != "False":
                break
        for scans_of in executing:
            scans_of.close()
        fields = compiled.layout.fields
        differences = [
            (field.name, one, other)
            for field, one, other in zip(fields, *states, strict=True)
            if repr(one) != repr(other)
        ]
        assert not differences, (stretch, differences[:3])
        _set_variables(compiled, states, draw)


def _end_of(scans) -> str:
    try:
        return repr(next(scans))
    except ScanTooLong as error:
        return f"too long at {error.line}"


def _set_variables(compiled: CompiledTask, states: list[list], draw: random.Random) -> None:
    for place, field in enumerate(compiled.layout.fields):
        if field.role.value not in ("local", "tunable"):
            continue
        if field.is_array:
            values = [some_value(draw, field.name) for _ in range(field.size)]
            for state in states:
                state[place][:] = values
        else:
            value = some_value(draw, field.name)
            for state in states:
                state[place] = value


def _first_difference(one: list[object], other: list[object]) -> object:
    for place, (left, right) in enumerate(zip(one, other, strict=False)):
        if left != right:
            return place, left, right
    return len(one), len(other), one[len(other) :][:2], other[len(one) :][:2]
