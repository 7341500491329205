"""I/O points of the ``common`` section: a variable with ``slot``, ``register`` and, for a BOOLEAN, ``bit``."""

from __future__ import annotations

from collections.abc import Iterable

from automax_ros.core.diagnostics import Note, Span
from automax_ros.core.json_schema import Keys, whole
from automax_ros.core.types import DataType
from automax_ros.rackfile.model.config import MAX_SLOT, IoPoint
from automax_ros.rackfile.model.module import ModuleConfig
from automax_ros.rackfile.reading.names import VariableName
from automax_ros.rackfile.reading.values import ProblemList, Section, integer_value, schemas, whole_key

_SLOT = whole_key("slot", "Slot of the module that the point belongs to.", 0, MAX_SLOT, "AMX6421")
_REGISTER = "Register of the module; a DOUBLE INTEGER takes this one and the next."
_BIT = whole_key("bit", "Bit of the register, for a BOOLEAN; 0 is the lowest.", 0, 15, "AMX6421")
KEYS: Keys = {
    **schemas(_SLOT),
    "drop": whole("Drop of a 57C404 whose register it is; 0 is the module's status.", 0, 55),
    "register": whole(_REGISTER, 0, 65535),
    **schemas(_BIT),
}
"""The keys of a point's place; a module has fewer drops and registers."""
_SIZES = {DataType.BOOLEAN: 1, DataType.INTEGER: 16, DataType.DOUBLE: 32, DataType.REAL: 32}
"""Bits of the types that a point may have (J2-3045 p. 7-1); a REAL only on the application registers of a UDC."""


class PointReader:
    """Reads the places of I/O points. A word may have a name and its bits too, otherwise a bit has one name."""

    def __init__(
        self, modules: Iterable[ModuleConfig], findings: ProblemList, unread: frozenset[int] = frozenset()
    ) -> None:
        """Create from the modules without errors, and the slots of the others: points there are not checked."""
        self._unread = unread
        self._modules = {module.slot: module for module in modules}
        self._findings = findings
        self._named: dict[tuple[int, int, int], tuple[str, Span]] = {}

    def read(self, section: Section, declared: VariableName, span: Span) -> IoPoint | None:
        """Return a variable's place on a module, None if it is in common memory or its place is wrong."""
        given = [key for key in KEYS if key in section]
        if not given:
            return None
        what = f"I/O point {declared.name}"
        wanted = ("slot", "register", "bit") if declared.type is DataType.BOOLEAN else ("slot", "register")
        if not section.require(wanted, what, span) or not self._is_possible(section, declared):
            return None
        slot = section.read(_SLOT, what)
        module = self._module(slot, section, what) if slot is not None else None
        if slot is None or module is None:
            return None
        words = -(-_SIZES[declared.type] // 16)
        if module.registers.count < words:
            self._findings.add("AMX6421", f"{what} takes two registers; the {module.model} has one", span)
            return None
        first = self._first_register(section, module, what, span)
        if first is None:
            return None
        last = (module.registers.area or module.registers.count) - words
        number = section.read(whole_key("register", _REGISTER, 0, last, "AMX6421"), what)
        bit = section.read(_BIT, what)
        if number is None or (bit is None and "bit" in section):
            return None
        register = first + number
        if not self._suits(declared, module, range(register, register + words), section):
            return None
        point = IoPoint(slot, register, bit)
        return point if self._is_free(point, declared, span) else None

    def _first_register(self, section: Section, module: ModuleConfig, what: str, span: Span) -> int | None:
        """Return the first register of the drop that a point names, 0 for a module without drops."""
        registers, place = module.registers, f"the {module.model} in slot {module.slot}"
        if "drop" not in section:
            if registers.area:
                hint = f"{place} has an area for each drop: write drop: 0 for its status"
                self._findings.add("AMX6562", f"{what} lacks the key 'drop'", span, hint)
            return None if registers.area else 0
        if not registers.area:
            self._findings.add("AMX6562", f"{what} has a drop; {place} has none", section.key_span("drop"))
            return None
        node = section.get("drop")
        assert node is not None
        low, high = min(registers.areas), max(registers.areas)
        drop = integer_value(node, f"drop of {what}", self._findings, low=low, high=high, code="AMX6562")
        if drop is not None and drop not in registers.areas:
            drops = ", ".join(map(str, sorted(registers.areas)))
            self._findings.add("AMX6562", f"drop of {what} is {drop}; {place} has {drops}", node.span)
            return None
        return None if drop is None else drop * registers.area

    def check_input(self, point: IoPoint, declared: VariableName, span: Span) -> None:
        """Report a point for the process to write, if only its module or tasks may write it."""
        module = self._modules[point.slot]
        place = module.registers.place(point.register)
        hint = "leave out ros, or write ros: out"
        if point.register in module.registers.shown:
            message = f"{declared.name} cannot be ros: in: the {module.model} writes {place} itself"
            self._findings.add("AMX6550", message, span, hint)
        elif point.register in module.registers.commands:
            message = f"{declared.name} cannot be ros: in: {place} of the {module.model} is an output: tasks write it"
            self._findings.add("AMX6494", message, span, hint)

    def _suits(self, declared: VariableName, module: ModuleConfig, taken: range, section: Section) -> bool:
        """Report two registers of which a task may write only one, and a REAL on registers that cannot hold one."""
        message, place = "", section.key_span("register")
        own = [register for register in taken if register in module.registers.reserved]
        if own:
            place_of = module.registers.place(own[0])
            message = f"{declared.name}: {place_of} of the {module.model} belongs to the module itself"
        elif len({module.registers.direction(register) for register in taken}) > 1:
            both = f"{module.registers.place(taken[0])} and {module.registers.place(taken[-1])}"
            message = f"{declared.name} takes {both} of the {module.model}"
            message += f": an {' and an '.join(map(module.registers.direction, taken))}"
        elif declared.type is DataType.REAL and any(register not in module.registers.reals for register in taken):
            self._report_impossible(f"{declared.name} cannot be an I/O point: it is REAL", place)
            return False
        if message:
            self._findings.add("AMX6421", message, place)
        return not message

    def _is_possible(self, section: Section, declared: VariableName) -> bool:
        message = ""
        place = section.key_span(next(key for key in KEYS if key in section))
        if declared.dimensions or declared.type not in _SIZES:
            kind = "an array" if declared.dimensions else declared.type.word
            message = f"{declared.name} cannot be an I/O point: it is {kind}"
        elif declared.type is not DataType.BOOLEAN and "bit" in section:
            message, place = f"{declared.name} has a bit but is not BOOLEAN", section.key_span("bit")
        elif "non_volatile" in section:
            message = f"{declared.name} cannot be non-volatile: its module holds it"
            place = section.key_span("non_volatile")
        if message:
            self._report_impossible(message, place)
        return not message

    def _report_impossible(self, message: str, place: Span) -> None:
        hint = "an I/O point is a simple BOOLEAN (with slot, register, bit), INTEGER or DOUBLE INTEGER"
        self._findings.add("AMX6422", message, place, hint)

    def _module(self, slot: int, section: Section, what: str) -> ModuleConfig | None:
        module = self._modules.get(slot)
        if module is not None and module.registers.count:
            return module
        if slot in self._unread:
            return None
        held = (
            f"the {module.model} there has no registers for I/O points" if module else "no module is configured there"
        )
        node = section.get("slot")
        assert node is not None
        self._findings.add("AMX6420", f"{what} is in slot {slot}, but {held}", node.span, "name the I/O module's slot")
        return None

    def _is_free(self, point: IoPoint, declared: VariableName, span: Span) -> bool:
        """Report a register or bit that has a name already; only a word may have bits that are named too."""
        size = _SIZES[declared.type]
        first = 16 * point.register + (point.bit or 0)
        for bit in range(first, first + size):
            for other_size in _SIZES.values():
                other = self._named.get((point.slot, bit, other_size))
                if other is not None and (other_size == size or 1 not in (size, other_size)):
                    notes = (Note(f"{other[0]} is defined here", other[1]),)
                    place = f"slot {point.slot} {self._modules[point.slot].registers.place(point.register)}"
                    self._findings.add(
                        "AMX6423", f"{declared.name} is at {place}, which {other[0]} names already", span, notes=notes
                    )
                    return False
        for bit in range(first, first + size):
            self._named[point.slot, bit, size] = (declared.name, span)
        return True
