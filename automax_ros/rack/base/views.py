"""A rack's variables as views of memory, and the registers of its modules as banks of the backplane."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from automax_ros.rackfile.model.config import CommonVariable, RackConfig
from automax_ros.runtime.memory.registers import Backplane, Bank
from automax_ros.runtime.memory.views import Place, ViewSpec


def backplane_of(config: RackConfig) -> Backplane:
    """Return the backplane with the registers of a rack's modules."""
    banks = bank_views(config.variables)
    return Backplane(
        Bank(module.slot, banks[module.slot], module.registers.count, module.registers.writable)
        for module in config.modules
        if module.slot in banks
    )


def bank_views(variables: Iterable[CommonVariable]) -> dict[int, int]:
    """Return, for each slot with registers, their view."""
    return {variable.bank: view for view, variable in enumerate(variables) if variable.bank is not None}


def view_specs(variables: Sequence[CommonVariable]) -> tuple[ViewSpec, ...]:
    """Return the specifications of the views, in the order of the rack's variables."""
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
