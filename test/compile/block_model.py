"""A task of blocks alone, modeled by the step functions as they stand."""

from __future__ import annotations

import dataclasses

from automax_ros.blocks.declare.coefficients import limited
from automax_ros.blocks.declare.declaration import Access, Block, Special
from automax_ros.blocks.declare.instance import Instance
from automax_ros.core.types import DataType, type_of_name
from compile.support import TICK

TICKS = 4
SUBSCRIPT = 7026
SIZE = 4
"""Elements of every array."""


@dataclasses.dataclass(frozen=True)
class Programmed:
    """A CALL: the text of each parameter by keyword."""

    block: Block
    parameters: dict[str, str]

    def text(self, line: int) -> str:
        inside = ", ".join(f"{name}={value}" for name, value in self.parameters.items())
        return f"{line} CALL {self.block.name}({inside})"


class Model:
    """Variables of a task, and a block on them by its step function as it stands."""

    def __init__(self, values: dict[str, object]) -> None:
        self.values = values
        self.codes: list[int] = []

    def place(self, text: str) -> tuple[str, int | None]:
        """Name and flat index of a variable; the index is -1 out of range, None without one."""
        if "(" not in text:
            return text, None
        name, _, index = text[:-1].partition("(")
        number = int(index) if index.isdigit() else self.values[index]
        return name, number if 0 <= number < SIZE else -1

    def read(self, text: str):
        if text in ("TRUE", "FALSE"):
            return text == "TRUE"
        if text[0] == "-" and text[1].isalpha():
            return not self.read(text[1:])
        if text[0] in "-0123456789":
            return float(text) if "." in text else int(text)
        name, index = self.place(text)
        if index == -1:
            self.codes.append(SUBSCRIPT)
            return type_of_name(name).zero
        return self.values[name] if index is None else self.values[name][index]

    def write(self, place: tuple[str, int | None], value) -> None:
        name, index = place
        if index == -1:
            self.codes.append(SUBSCRIPT)
        elif index is None:
            self.values[name] = value
        else:
            self.values[name][index] = value


class ModelBlock:
    """A block by its step function; ``structures`` holds the SHIFT blocks so far, by the name of what they make."""

    def __init__(self, call: Programmed, structures: dict[str, Instance]) -> None:
        self.call = call
        given = [item for item in call.block.inputs if item.name in call.parameters]
        self.inputs = {item.variable: call.parameters[item.name] for item in given if isinstance(item.type, DataType)}
        self.tables = {item.variable: call.parameters[item.name] for item in given if item.type is Special.TABLE}
        self.outputs = {
            item.variable: (text, item.holds)
            for keyword, text in call.parameters.items()
            for item in call.block.outputs
            if item.name == keyword
        }
        fixed = {name: text for name, text in self.inputs.items() if text.lstrip("-")[0] not in "LK"}
        self.fixed = {name: Model({}).read(text) for name, text in fixed.items()}
        self.instance = self._instance(structures)
        self.were_limited: set[str] = set()

    def _instance(self, structures: dict[str, Instance]) -> Instance:
        block, name = self.call.block, self.call.parameters.get("STRUCTURE_NAME", "")
        if block.structure is Access.USES:
            return Instance(block, TICKS * TICK, structures[name], **self.fixed)
        if block.structure is None:
            return Instance(block, TICKS * TICK, **self.fixed)
        channels = sum(keyword.startswith("INPUT") for keyword in self.call.parameters)
        structures[name] = Instance(block, TICKS * TICK, channels=channels, **self.fixed)
        return structures[name]

    def scan(self, model: Model) -> None:
        given_now = {name: model.read(text) for name, text in self.inputs.items() if name not in self.fixed}
        given_now.update({name: list(model.values[text]) for name, text in self.tables.items()})
        places = {name: model.place(text) for name, (text, _) in self.outputs.items()}
        results = self.instance.scan(**given_now)
        self._note_limits(model, given_now)
        if self.call.block.logs and self.instance.error:
            model.codes.append(self.instance.error)
        for name, (_, holds) in self.outputs.items():
            if self.instance.wrote or not holds:
                model.write(places[name], results[name])

    def _note_limits(self, model: Model, given_now) -> None:
        declared = self.call.block.coefficients
        if declared is None:
            return
        everything = {**self.fixed, **given_now}
        reals = {name: everything[name.lower()] for name in declared.parameters if name.lower() in everything}
        values, out = limited(declared, TICKS * TICK / 1e9, reals)
        moved = set(out)
        if declared.relation is not None and not declared.relation.holds(values):
            moved.add("the relation")
        if moved - self.were_limited:
            model.codes.append(7004)
        self.were_limited = moved
