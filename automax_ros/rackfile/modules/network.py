"""Network modules 57C404 in a rack file, with the network's name, the drop and the depth.

```yaml
12: {module: 57C404, network: PAPER, drop: 3, depth: 2}
```

Drop 0 is the network's one master, 1 to 55 are slaves. ``depth`` is the number of drops on which variables of a slave
may be; the depth with which the module communicates is that of its register 20, which a task writes (57C570 manual p.
18-7). Racks that name the same network in one ROS 2 domain, below the same namespace, are on one cable (decision).

The module has 56 drop areas of 64 registers (57C570 manual p. 18-4 to 18-7). Register 64 x drop + n of the module is
register n of the drop's area, for IOREAD% and IOWRITE too (decision). In the area of a drop, 0 to 31 go from its slave
to the master and 32 to 63 from the master to its slave. The area of drop 0 is the module's status; 32 to 39 of it are
broadcast, written in the master and read in every slave. That the 57C404 has the map that is printed for the network
part of a 57C570 is ours (decision); the manual of the 57C445 says the same of its drops.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from types import MappingProxyType

from automax_ros.core.diagnostics import Note, Span
from automax_ros.core.json_schema import named
from automax_ros.core.text import quoted
from automax_ros.core.yaml_text import Node
from automax_ros.rackfile.model.module import ModuleConfig, Registers
from automax_ros.rackfile.modules.kind import ModuleKind, ModuleSection, RackLayout
from automax_ros.rackfile.reading.names import RACK_NAME, is_rack_name
from automax_ros.rackfile.reading.values import Key, ProblemList, integer_value, schemas, text_value, whole_key

AREA = 64
"""Registers of the area of one drop."""
HALF = 32
"""Registers that go in one direction; those from the master come second."""
MASTER = 0
"""The drop of the master."""
LAST_DROP = 55
COUNT = AREA * (LAST_DROP + 1)

STATUS = range(4, 8)
"""The drops that communicate: drops 0 to 15 in the bits of the first register, and so on."""
OWN_DROP, RECEIVED, TIMEOUTS, CRC_ERRORS, OVERRUNS, TRANSMITTED, DEPTH = 12, 14, 15, 16, 17, 19, 20
"""Further registers of the area of drop 0; 18, abort errors, stays 0: nothing in DDS is like it (decision)."""
ABORTS = 18
VALID = 0x8000
"""The bit of ``OWN_DROP`` of a module whose drop number is valid."""
DONE, INVALID = 0x8000, 0x4000
"""Bits of ``DEPTH``: it was processed; it was invalid, and the last valid one is used."""
BROADCAST = range(32, 40)
_SHOWN = (*STATUS, OWN_DROP, RECEIVED, TIMEOUTS, CRC_ERRORS, OVERRUNS, ABORTS, TRANSMITTED)


def greatest_depth(drop: int) -> int:
    """Return the most drops that the slave at a drop can represent (p. 18-7)."""
    return LAST_DROP + 1 - drop


def from_slave(drop: int) -> range:
    """Return the registers of a drop that its slave writes."""
    return range(AREA * drop, AREA * drop + HALF)


def from_master(drop: int) -> range:
    """Return the registers of a drop that the master writes, those of drop 0 being ``BROADCAST`` and reserved ones."""
    return range(AREA * drop + HALF, AREA * (drop + 1))


def registers_of(drop: int, depth: int) -> Registers:
    """Return the registers of the module at a drop, for a slave with ``depth`` drops.

    No point can be on a register that the manual calls reserved, nor in a slave on drops that are not its own
    (decision: only the master has the areas of all drops).
    """
    own = range(drop, drop + depth)
    if drop == MASTER:
        areas = range(1, LAST_DROP + 1)
        outputs = {number for area in areas for number in from_master(area)} | set(BROADCAST)
        shown = frozenset(_SHOWN)
    else:
        areas = own
        outputs = {number for area in areas for number in from_slave(area)} | {DEPTH}
        shown = frozenset({*_SHOWN, *BROADCAST})
    data = {number for area in areas for number in range(AREA * area, AREA * (area + 1))}
    used = data | outputs | shown
    return Registers(
        COUNT,
        outputs=frozenset(outputs),
        reserved=frozenset(range(COUNT)) - used,
        by_itself=True,
        shown=shown,
        area=AREA,
        areas=frozenset({0, *areas}),
    )


@dataclass(frozen=True, kw_only=True)
class NetworkConfig(ModuleConfig):
    """A 57C404: the ``network`` whose cable it is on, its ``drop``, and ``depth``, the drops with variables."""

    network: str
    drop: int
    depth: int = 1
    span: Span | None = field(default=None, compare=False)

    @property
    def drops(self) -> range:
        """The drops that it may represent."""
        return range(self.drop, self.drop + self.depth)


def _network_name(node: Node, what: str, findings: ProblemList) -> str | None:
    text = text_value(node, what, findings, limit=100)
    name = findings.upper_case(text, node.span) if text is not None else None
    if text is None or name is None or is_rack_name(name):
        return name
    message = f"{what} is {quoted(text)}; a network's name has 1 to 8 letters and digits"
    findings.add("AMX6560", message, node.span, "for example PAPER, or the letter that the plant's drawings have")
    return None


_NETWORK = Key("network", named("Name of the network that its cable is part of.", RACK_NAME), _network_name)
_DROP = whole_key("drop", "Its place on the network; 0 is the master.", MASTER, LAST_DROP, "AMX6561")
_DEPTH = whole_key("depth", "On how many drops, from its own on, its variables may stand.", 1, LAST_DROP, "AMX6561", 1)


class NetworkKind(ModuleKind):
    """The options of a 57C404 in a rack file."""

    word = "network module"
    models = MappingProxyType({"57C404": "DCS-NET network communications module"})
    options = MappingProxyType(schemas(_NETWORK, _DROP, _DEPTH))

    def read(self, found: ModuleSection) -> NetworkConfig | None:
        """Read network, drop and depth."""
        section = found.section
        if not section.require(("network", "drop"), found.where, found.span):
            return None
        network, drop = section.read(_NETWORK), section.read(_DROP)
        place, node = section.get("drop"), section.get("depth")
        if network is None or drop is None or place is None:
            return None
        depth: int | None = 1
        if node is not None and drop == MASTER:
            message = f"{found.where} is the master, drop 0: it has no depth"
            hint = "depth is how many drops a slave represents: leave it out"
            found.findings.add("AMX6561", message, node.span, hint)
            return None
        if node is not None:
            what, high = f"depth of {found.where}", greatest_depth(drop)
            depth = integer_value(node, what, found.findings, low=1, high=high, code="AMX6561")
        if depth is None:
            return None
        return NetworkConfig(
            **found.placed("network"),
            registers=registers_of(drop, depth),
            network=network,
            drop=drop,
            depth=depth,
            span=place.span,
        )

    def check_places(self, rack: RackLayout) -> None:
        """Report two modules of the rack that represent one drop of a network (57C570 manual p. 18-7)."""
        own = [module for module in rack.modules if isinstance(module, NetworkConfig)]
        for index, module in enumerate(own):
            for other in own[:index]:
                both = sorted({*module.drops} & {*other.drops})
                if both and other.network == module.network and module.span is not None and other.span is not None:
                    message = f"drop {both[0]} of network {module.network} is that of the 57C404 in slot {other.slot}"
                    notes = (Note("that one is here", other.span),)
                    rack.findings.add("AMX6563", message, module.span, "give each module drops of its own", notes)


NETWORK = NetworkKind()
