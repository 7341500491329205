"""What is wrong with how the command was used."""

from __future__ import annotations

from automax_ros.core.faults import UserError


class UsageError(UserError):
    """The command cannot do what it was told: wrong arguments, or an unreadable file; exit code 2."""
