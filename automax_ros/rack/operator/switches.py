"""Operations in and around a rack by hand: controls of modules, faults of plants, breaks of webs.

Stimuli, services and commands call them; observers receive each, refused ones too. Neither needs the rack's power
(decision): a switch is a lever, and a plant is outside the rack.
"""

from __future__ import annotations

from automax_ros.core.text import near_or_listed, printable, quoted
from automax_ros.drive.base.errors import ParameterError
from automax_ros.rack.base.stop_cause import OperationRefused
from automax_ros.rack.modules.module import Operable
from automax_ros.rack.operator.plant_verbs import VERBS_OF, named_in, read_values
from automax_ros.rack.rack import Rack

MOST_CHARACTERS = 100
"""Longest text of a value that is accepted (decision: a bound on what strangers send)."""


class SwitchOperations:
    """The controls of one rack.

    Raises:
        OperationRefused: all methods, if the module, plant, web or control does not exist, or the control cannot be
            moved so.
    """

    def __init__(self, rack: Rack) -> None:
        self._rack, self._reports = rack, rack.operations.reports

    def module(self, slot: str, control: str, value: str) -> None:
        """Move a control of the module in a slot to a position, in any case: ``7``, ``test_switch``, ``A``."""
        reports, detail = self._reports, printable(f"{slot} {control} {value}")
        modules = {str(module.config.slot): module for module in self._rack.modules}
        module = modules.get(slot)
        if module is None:
            reports.refuse("module", f"the rack has no module in slot {printable(slot)}", detail=detail)
        if not isinstance(module, Operable) or control not in module.controls:
            has = near_or_listed(control, module.controls) if isinstance(module, Operable) else "it has no controls"
            reports.refuse(
                "module", f"the {module.config.model} in slot {slot} has no {quoted(control)}: {has}", detail=detail
            )
        positions = module.controls[control]
        position = next((item for item in positions if item.lower() == value.lower()), value)
        if position not in positions:
            reports.refuse(
                "module", f"{control} cannot be {quoted(value)}: it takes {', '.join(positions)}", detail=detail
            )
        try:
            module.operate(control, position)
        except OperationRefused as refused:
            reports.refuse("module", str(refused), detail=detail)
        reports.done("module", detail=printable(f"{slot} {control} {position}"))

    def plant(self, name: str, verb: str, value: str) -> None:
        """Break, mend or load a plant, now: ``UNWIND``, ``short_scr``, ``3``; ``PLANT_VERBS`` are the verbs."""
        self._work("plant", name, verb, value, "it has none with a motor")

    def web(self, name: str, verb: str, value: str = "") -> None:
        """Break, thread or change a web, now: ``W1``, ``break``; ``WEB_VERBS`` are the verbs."""
        self._work("web", name, verb, value, "it has none")

    def _work(self, what: str, name: str, verb: str, value: str, none: str) -> None:
        """Execute a verb on the plant or web (``what``) of a name; ``none`` is the hint where there are none."""
        reports, plants = self._reports, self._rack.plants
        known = named_in(plants, what)
        if len(value) > MOST_CHARACTERS:
            reason = f"a text of {len(value)} characters: at most {MOST_CHARACTERS}"
            reports.refuse(what, reason, detail=printable(f"{name} {verb}"))
        detail = printable(f"{name} {verb} {value.strip()}".rstrip())
        if name not in known:
            has = near_or_listed(name, known) or none
            reports.refuse(what, f"the rack has no {what} {quoted(name)}: {has}", detail=detail)
        try:
            values = read_values(what, verb, value)
        except ParameterError as error:
            reports.refuse(what, str(error), detail=detail)
        plants.named(name).advance(self._rack.now_ns)
        try:
            VERBS_OF[what][verb].act(plants, name, values)
        except ParameterError as error:
            reports.refuse(what, str(error), detail=detail)
        reports.done(what, detail=detail)

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
