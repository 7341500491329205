"""What every floor speaks: number types, integer time, problem codes and diagnostics."""

from __future__ import annotations

from typing import TYPE_CHECKING

from automax_ros.core.face import face

if TYPE_CHECKING:
    from automax_ros.core.diagnostics import Diagnostic, SourceText, Span, has_errors, render_all
    from automax_ros.core.faults import Fault
    from automax_ros.core.kinds import Direction, WriteKind
    from automax_ros.core.names import Element, element, element_name
    from automax_ros.core.problems import PROBLEMS, Problem, Severity
    from automax_ros.core.ticks import NS_PER_MS, NS_PER_S, seconds_ns, tick_ns
    from automax_ros.core.types import DataType, Value
    from automax_ros.core.values import value_of, value_text

__all__ = [
    "NS_PER_MS",
    "NS_PER_S",
    "PROBLEMS",
    "DataType",
    "Diagnostic",
    "Direction",
    "Element",
    "Fault",
    "Problem",
    "Severity",
    "SourceText",
    "Span",
    "Value",
    "WriteKind",
    "element",
    "element_name",
    "has_errors",
    "render_all",
    "seconds_ns",
    "tick_ns",
    "value_of",
    "value_text",
]

__getattr__ = face(__name__, "types", "ticks", "faults", "problems", "diagnostics", "kinds", "names", "values")
