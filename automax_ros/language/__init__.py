"""From .BLK text to a checked program: lexer, parser, syntax tree, printer, checker."""

from __future__ import annotations

from typing import TYPE_CHECKING

from automax_ros.core.face import face

if TYPE_CHECKING:
    from automax_ros.language.checks.checker import CheckResult, check
    from automax_ros.language.program import CommonSpec, Program, Symbol
    from automax_ros.language.syntax.parser import parse

__all__ = [
    "CheckResult",
    "CommonSpec",
    "Program",
    "Symbol",
    "check",
    "parse",
]

__getattr__ = face(__name__, "syntax.parser", "program", "checks.checker")
