"""Native scans: a compiled task's scans as machine code, made by a C compiler and kept in the user's cache."""

from __future__ import annotations

from typing import TYPE_CHECKING

from automax_ros.core.face import face

if TYPE_CHECKING:
    from automax_ros.compile.native.source import NativeSource, NotNative

__all__ = [
    "NativeSource",
    "NotNative",
]

__getattr__ = face(__name__, "source")
