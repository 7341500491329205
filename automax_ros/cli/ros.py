"""ROS 2 for a subcommand that needs it."""

from __future__ import annotations

from automax_ros.cli.usage import UsageError


def prepare_ros(hint: str | None = None) -> int:
    """Make ROS 2 usable, before any input is read, and return the domain; ``hint`` says what to do without it.

    Raises:
        UsageError: it is not there, or ROS_DOMAIN_ID names no domain.
    """
    from automax_ros.nodes.environment import RosUnavailable, prepare

    try:
        prepare()
        from automax_ros.nodes.lock import domain_id

        return domain_id()
    except RosUnavailable as error:
        raise UsageError(str(error), hint) from error
