"""ROS 2 for a subcommand that needs it, and the ROS arguments of its command line."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from automax_ros.core.user_error import UsageError

if TYPE_CHECKING:
    from automax_ros.ros.setup.arguments import RosArguments

_RANGES = ("localhost", "subnet", "off")


def add_ros_arguments(parser: argparse.ArgumentParser) -> None:
    """Add ``--range``, and make the subcommand accept ``--ros-args`` as ``ros``."""
    parser.add_argument(
        "--range",
        choices=_RANGES,
        dest="discovery",
        help="whom this program speaks to in its ROS domain (default: what ROS_AUTOMATIC_DISCOVERY_RANGE says, else "
        "this host)",
    )
    parser.set_defaults(ros=None)


def ros_arguments(arguments: argparse.Namespace) -> RosArguments:
    """Return the ROS arguments of the command line and of ROS_NAMESPACE.

    Raises:
        RosArgumentsError: ROS_NAMESPACE is not a namespace.
    """
    from automax_ros.ros.setup.arguments import split_arguments

    given: RosArguments | None = arguments.ros
    return split_arguments([])[1] if given is None else given


def prepare_ros(arguments: argparse.Namespace, hint: str | None = None) -> int:
    """Make ROS 2 usable, before any input is read, and return the domain; ``hint`` says what to do without ROS 2.

    Raises:
        UsageError: ROS 2 is not available, or ROS_DOMAIN_ID is not a domain.
        RosArgumentsError: ROS does not accept its arguments.
    """
    from automax_ros.ros.setup.environment import RosUnavailable, prepare

    try:
        prepare(discovery=arguments.discovery)
        from automax_ros.ros.setup.lock import domain_id

        ros_arguments(arguments).checked()
        return domain_id()
    except RosUnavailable as error:
        raise UsageError(str(error), hint) from error
