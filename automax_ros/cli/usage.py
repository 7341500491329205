"""The error for wrong usage of a command."""

from __future__ import annotations

from automax_ros.core.faults import UserError


class UsageError(UserError):
    """The command cannot do what was asked: wrong arguments, or an unreadable file; exit code 2."""
