"""What must hold among the tasks of a rack and its modules, beyond what each task's own check finds."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from automax_ros.core.diagnostics import Diagnostic
from automax_ros.language.program import Program
from automax_ros.rack.common_use import writer_findings
from automax_ros.rack.config import RackConfig
from automax_ros.rack.interrupt_check import interrupt_findings
from automax_ros.rack.modules.drive_rules import drive_findings
from automax_ros.rack.modules.udc_rules import udc_findings
from automax_ros.rack.plants.feeds import feed_findings

Rule = Callable[[RackConfig, Mapping[str, Program]], Mapping[str, Sequence[Diagnostic]]]
"""Returns what is wrong by the task in whose source it stands; it is given the programs without errors."""

RULES: tuple[Rule, ...] = (interrupt_findings, udc_findings, drive_findings, feed_findings, writer_findings)
"""All such rules."""


def findings_by_task(config: RackConfig, programs: Mapping[str, Program]) -> dict[str, list[Diagnostic]]:
    """Return what the rules find, by task."""
    found: dict[str, list[Diagnostic]] = {}
    for rule in RULES:
        for name, diagnostics in rule(config, programs).items():
            found.setdefault(name, []).extend(diagnostics)
    return found
