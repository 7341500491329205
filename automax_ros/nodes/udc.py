"""The node ``udc_SLOT``: a UDC module with its tasks.

It does for its tasks all that a Processor's node does; ``/diagnostics`` also tells of the common clock, the next scan,
and the scans per interrupt.
"""

from __future__ import annotations

from diagnostic_msgs.msg import DiagnosticStatus, KeyValue

from automax_ros.nodes.module_node import Site
from automax_ros.nodes.processor import ProcessorNode
from automax_ros.rack.modules.running import Module
from automax_ros.rack.modules.udc_registers import ISCR, SCAN_COUNTER, SCANS_PER_INTERRUPT

_SHOWN = {"iscr": ISCR, "scans_per_interrupt": SCANS_PER_INTERRUPT, "scans_since_interrupt": SCAN_COUNTER}


class UdcNode(ProcessorNode):
    """Serves one UDC."""

    def __init__(self, site: Site, udc: Module) -> None:
        """Create publishers and parameters, and observe the rack."""
        self._udc = udc
        super().__init__(site, udc)

    def _module_status(self, tasks: list[DiagnosticStatus]) -> DiagnosticStatus:
        """Return the health of the module itself: WARN, too, while its tasks wait for the common clock."""
        config, rack = self._udc.config, self.site.rack
        bank = rack.backplane.bank(config.slot)
        assert bank is not None
        status = super()._module_status(tasks)
        for name, register in _SHOWN.items():
            status.values.append(KeyValue(key=name, value=str(rack.memory.read_now(bank.view, register))))
        if rack.clock_since_ns is None and status.level == DiagnosticStatus.OK:
            status.level, status.message = DiagnosticStatus.WARN, "tasks wait at SCAN_LOOP for the common clock"
        return status
