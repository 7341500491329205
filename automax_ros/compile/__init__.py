"""Program to function: the compiler and its lowerings."""

from __future__ import annotations

from typing import TYPE_CHECKING

from automax_ros.core.face import face

if TYPE_CHECKING:
    from automax_ros.compile.compiler import CompiledTask, compile_program
    from automax_ros.compile.layout import Layout

__all__ = [
    "CompiledTask",
    "Layout",
    "compile_program",
]

__getattr__ = face(__name__, "layout", "compiler")
