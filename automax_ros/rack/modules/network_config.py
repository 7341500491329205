"""Network modules as a rack file configures them: 57C404, with the network's name, its drop and how many it represents.

```yaml
12: {module: 57C404, network: PAPER, drop: 3, depth: 2}
```

Drop 0 is the network's one master, 1 to 55 are slaves. ``depth`` says on which drops variables of a slave may stand;
the depth with which the module communicates is that of its register 20, which a task writes (57C570 manual p. 18-7).
Racks that name the same network in one ROS 2 domain, below the same namespace, are on one cable (decision).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from types import MappingProxyType

from automax_ros.core.diagnostics import Note, Span
from automax_ros.core.json_schema import Keys, named, whole
from automax_ros.core.text import quoted
from automax_ros.core.yaml_text import Node
from automax_ros.rack.findings import Findings
from automax_ros.rack.modules.configured import Registers
from automax_ros.rack.modules.io_config import WithoutTasks
from automax_ros.rack.modules.kind import Arrangement, FoundModule
from automax_ros.rack.modules.network_registers import LAST_DROP, MASTER, greatest_depth, registers_of
from automax_ros.rack.names import RACK_NAME, is_rack_name
from automax_ros.rack.scalars import integer_value, text_value


@dataclass(frozen=True)
class NetworkConfig(WithoutTasks):
    """A 57C404: the ``network`` whose cable it is on, its ``drop``, and on how many drops variables may stand."""

    slot: int
    model: str
    network: str
    drop: int
    depth: int = 1
    line: int = 0
    span: Span | None = field(default=None, compare=False)

    @property
    def name(self) -> str:
        """The module's name in the rack, as that of its node."""
        return f"network_{self.slot}"

    @cached_property
    def registers(self) -> Registers:
        """Its registers, as its drop has them."""
        return registers_of(self.drop, self.depth)

    @property
    def drops(self) -> range:
        """The drops that it may represent."""
        return range(self.drop, self.drop + self.depth)


class NetworkKind:
    """What a rack file may say of a 57C404."""

    word = "network module"
    models: Mapping[str, str] = MappingProxyType({"57C404": "DCS-NET network communications module"})
    options: Keys = MappingProxyType(
        {
            "network": named("Name of the network that its cable is part of.", RACK_NAME),
            "drop": whole("Its place on the network; 0 is the master.", MASTER, LAST_DROP),
            "depth": whole("On how many drops, from its own on, its variables may stand.", 1, LAST_DROP, 1),
        }
    )

    def read(self, found: FoundModule) -> NetworkConfig | None:
        """Read network, drop and depth."""
        section, findings = found.section, found.findings
        if not section.require(("network", "drop"), found.where, found.span, findings):
            return None
        network, drop = section.get("network"), section.get("drop")
        assert network is not None
        assert drop is not None
        name = _network_name(network, f"network of {found.where}", findings)
        number = integer_value(drop, f"drop of {found.where}", findings, low=MASTER, high=LAST_DROP, code="AMX6561")
        if name is None or number is None:
            return None
        depth = _depth(section.get("depth"), number, found)
        return (
            None
            if depth is None
            else NetworkConfig(found.slot, found.model, name, number, depth, found.span.line, drop.span)
        )

    def check_places(self, rack: Arrangement) -> None:
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


def _network_name(node: Node, what: str, findings: Findings) -> str | None:
    text = text_value(node, what, findings, limit=100)
    if text is None:
        return None
    name = findings.upper_case(text, node.span)
    if not is_rack_name(name):
        message = f"{what} is {quoted(text)}; a network's name has 1 to 8 letters and digits"
        findings.add("AMX6560", message, node.span, "for example PAPER, or the letter that the plant's drawings have")
        return None
    return name


def _depth(node: Node | None, drop: int, found: FoundModule) -> int | None:
    if node is None:
        return 1
    if drop == MASTER:
        message = f"{found.where} is the master, drop 0: it has no depth"
        found.findings.add("AMX6561", message, node.span, "depth is how many drops a slave represents: leave it out")
        return None
    high = greatest_depth(drop)
    return integer_value(node, f"depth of {found.where}", found.findings, low=1, high=high, code="AMX6561")
