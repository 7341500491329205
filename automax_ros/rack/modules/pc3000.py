"""The AutoMax PC3000: a Processor on a card of its own in a personal computer, a rack without a backplane.

The card is the Processor/Scanner module 57C560; a 57C570 is an enclosure with one in it. The Serial module 57C565 is no
Processor (1.3). It is written as the only module of a rack, in slot 0, though the hardware has none (decision). It
holds its common variables itself; no I/O module can stand next to it, so there are neither points nor interrupts,
hardware events and current minor loops (J-3675 p. 6-17). Its times are those of table 6.
"""

from __future__ import annotations

from dataclasses import dataclass

from automax_ros.compile.cost import Model
from automax_ros.rack.modules.kind import Arrangement, FoundModule
from automax_ros.rack.modules.processor import ProcessorConfig, ProcessorKind

NODE = "pc3000"


@dataclass(frozen=True)
class Pc3000Config(ProcessorConfig):
    """A PC3000 with its tasks."""

    @property
    def name(self) -> str:
        """The module's name in the rack, as that of its node: there is one."""
        return NODE

    @property
    def times(self) -> Model:
        """Whose execution times its tasks have."""
        return Model.PC3000


class Pc3000Kind(ProcessorKind):
    """What a rack file may say of a PC3000: what it may say of a Processor."""

    word = "PC3000"
    models = dict.fromkeys(("57C560", "57C570"), "PC3000")

    def read(self, found: FoundModule) -> Pc3000Config:
        """Read tick and tasks."""
        plain = super().read(found)
        return Pc3000Config(plain.slot, plain.model, plain.tick_ns, plain.tasks, plain.line)

    def check_places(self, rack: Arrangement) -> None:
        """Report a PC3000 in another slot than 0, and whatever stands next to one."""
        own = rack.of(self)
        for item in own[:1]:
            if item.slot != 0:
                message = f"the PC3000 {item.model} stands in slot 0 of a rack of its own, not in slot {item.slot}"
                rack.findings.add("AMX6773", message, item.span)
        for item in rack.standing if own else ():
            if item is not own[0]:
                message = f"the {item.model} in slot {item.slot} cannot stand next to a PC3000, which has no slots"
                hint = "write a rack of its own for each of them"
                rack.findings.add("AMX6773", message, item.span, hint)


PC3000 = Pc3000Kind()
