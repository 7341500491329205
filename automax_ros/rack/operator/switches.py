"""Operations in and around a rack by hand: controls of modules, faults of plants.

Stimuli, services and commands call them; observers receive each, refused ones too. Neither needs the rack's power
(decision): a switch is a lever, and a plant is outside the rack.
"""

from __future__ import annotations

from typing import NoReturn

from automax_ros.core.text import near_or_listed, printable, quoted
from automax_ros.drive.base.errors import ParameterError
from automax_ros.drive.plant.faults import values_of, work_on
from automax_ros.rack.base.observers import Operation
from automax_ros.rack.base.stop_cause import OperationRefused
from automax_ros.rack.modules.module import Operable
from automax_ros.rack.rack import Rack

MOST_CHARACTERS = 100
"""Longest text of a value that is accepted (decision: a bound on what strangers send)."""


class SwitchOperations:
    """The controls of one rack.

    Raises:
        OperationRefused: all methods, if the module, plant or control does not exist, or the control cannot be moved
            so.
    """

    def __init__(self, rack: Rack) -> None:
        self._rack = rack

    def module(self, slot: str, control: str, value: str) -> None:
        """Move a control of the module in a slot to a position, in any case: ``7``, ``test_switch``, ``A``."""
        told = f"{slot} {control} {value}"
        modules = {str(module.config.slot): module for module in self._rack.modules}
        module = modules.get(slot)
        if module is None:
            self._refuse("module", told, f"the rack has no module in slot {printable(slot)}")
        if not isinstance(module, Operable) or control not in module.controls:
            has = near_or_listed(control, module.controls) if isinstance(module, Operable) else "it has no controls"
            self._refuse("module", told, f"the {module.config.model} in slot {slot} has no {quoted(control)}: {has}")
        positions = module.controls[control]
        position = next((item for item in positions if item.lower() == value.lower()), value)
        if position not in positions:
            self._refuse("module", told, f"{control} cannot be {quoted(value)}: it takes {', '.join(positions)}")
        try:
            module.operate(control, position)
        except OperationRefused as refused:
            self._refuse("module", told, str(refused))
        self._tell("module", f"{slot} {control} {position}")

    def plant(self, name: str, verb: str, value: str) -> None:
        """Break, mend or load a plant, now: ``UNWIND``, ``short_scr``, ``3``; ``drive/plant/faults`` has the verbs."""
        if len(value) > MOST_CHARACTERS:
            self._refuse("plant", f"{name} {verb}", f"a text of {len(value)} characters: at most {MOST_CHARACTERS}")
        told = f"{name} {verb} {value.strip()}"
        plant = self._rack.plants.get(name)
        if plant is None:
            has = near_or_listed(name, self._rack.plants) or "it has none with a motor"
            self._refuse("plant", told, f"the rack has no plant {quoted(name)}: {has}")
        try:
            values = values_of(verb, value)
        except ParameterError as error:
            self._refuse("plant", told, str(error))
        plant.advance(self._rack.now_ns)
        try:
            work_on(plant, verb, values)
        except ParameterError as error:
            self._refuse("plant", told, str(error))
        self._tell("plant", told)

    def load(self, name: str, torque_nm: float) -> None:
        """Load a plant's shaft (N m) as one of many samples: no operation is reported (decision)."""
        plant = self._rack.plants.get(name)
        if plant is None:
            raise OperationRefused(f"the rack has no plant {quoted(name)}")
        plant.advance(self._rack.now_ns)
        try:
            plant.load_torque_nm = torque_nm
        except ParameterError as error:
            raise OperationRefused(str(error)) from error

    def _tell(self, what: str, detail: str, *, reason: str = "", ok: bool = True) -> None:
        told = Operation(self._rack.now_ns, what, "", ok, reason, printable(detail))
        self._rack.observers.operated(told)

    def _refuse(self, what: str, detail: str, reason: str) -> NoReturn:
        self._tell(what, detail, reason=reason, ok=False)
        raise OperationRefused(reason)
