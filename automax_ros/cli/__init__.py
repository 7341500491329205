"""The command `automax`: ``main`` finds the subcommand, one file each; they are thin callers of the floors below.

A subcommand is a module with ``add_arguments(parser)`` and ``run(arguments) -> int``, whose result is the exit code:
0 fine, 1 the thing checked has errors or differences, 2 wrong usage or unreadable file. It raises ``UsageError`` for 2.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from automax_ros.core.face import face

if TYPE_CHECKING:
    from automax_ros.cli.usage import UsageError

__all__ = [
    "UsageError",
]

__getattr__ = face(__name__, "usage")
