"""Native scans: a compiled task's scans as machine code, made by a C compiler and kept in the user's cache."""

from __future__ import annotations

from typing import TYPE_CHECKING

from automax_ros.core.face import face

if TYPE_CHECKING:
    from automax_ros.compile.native.cache import NativeCache
    from automax_ros.compile.native.executed import BesideLatch, Executed
    from automax_ros.compile.native.forms import NativeForms, NativeMode, NativeOutcome
    from automax_ros.compile.native.source import NativeSource, NotNative
    from automax_ros.compile.native.task import NativeTask, native_form
    from automax_ros.compile.native.translation import translate

__all__ = [
    "BesideLatch",
    "Executed",
    "NativeCache",
    "NativeForms",
    "NativeMode",
    "NativeOutcome",
    "NativeSource",
    "NativeTask",
    "NotNative",
    "native_form",
    "translate",
]

__getattr__ = face(__name__, "source", "executed", "cache", "task", "forms", "translation")
