"""A rack's variables as views of memory, and the registers of its modules as the backplane finds them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from automax_ros.core.kinds import Direction
from automax_ros.core.types import DataType
from automax_ros.rack.config import CommonVariable
from automax_ros.running.views import Place, ViewSpec


def bank_variable(slot: int, registers: int, line: int) -> CommonVariable:
    """Return the variable that is all the registers of the module in a slot; ROS never sees it."""
    return CommonVariable(
        f"SLOT:{slot}%", DataType.INTEGER, (registers,), direction=Direction.CLOSED, line=line, bank=slot
    )


def bank_views(variables: Iterable[CommonVariable]) -> dict[int, int]:
    """Return the view of the registers of each slot that has some."""
    return {variable.bank: view for view, variable in enumerate(variables) if variable.bank is not None}


def view_specs(variables: Sequence[CommonVariable]) -> tuple[ViewSpec, ...]:
    """Return what memory must know of a rack's variables, in their order."""
    banks = bank_views(variables)
    return tuple(
        ViewSpec(
            variable.name,
            variable.type,
            variable.elements,
            is_array=variable.is_array,
            length=variable.length,
            non_volatile=variable.non_volatile,
            place=_place(variable, banks),
        )
        for variable in variables
    )


def _place(variable: CommonVariable, banks: dict[int, int]) -> Place | None:
    point = variable.point
    return None if point is None else Place(banks[point.slot], point.register, point.bit)
