"""ROS 2 for a subcommand that needs it, and what its command line says to ROS."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from automax_ros.cli.usage import UsageError

if TYPE_CHECKING:
    from automax_ros.ros.setup.arguments import RosArguments

_RANGES = ("localhost", "subnet", "off")


def add_ros_arguments(parser: argparse.ArgumentParser) -> None:
    """Add ``--range``, and let the subcommand take ``--ros-args`` as ``ros``."""
    parser.add_argument(
        "--range",
        choices=_RANGES,
        dest="discovery",
        help="whom this program speaks to in its ROS domain (default: what ROS_AUTOMATIC_DISCOVERY_RANGE says, else "
        "this host)",
    )
    parser.set_defaults(ros=None)


def ros_arguments(arguments: argparse.Namespace) -> RosArguments:
    """Return what the command line and ROS_NAMESPACE say to ROS.

    Raises:
        RosArgumentsError: ROS_NAMESPACE is not a namespace.
    """
    from automax_ros.ros.setup.arguments import split_arguments

    given: RosArguments | None = arguments.ros
    return split_arguments([])[1] if given is None else given


def prepare_ros(arguments: argparse.Namespace, hint: str | None = None) -> int:
    """Make ROS 2 usable, before any input is read, and return the domain; ``hint`` says what to do without it.

    Raises:
        UsageError: it is not there, or ROS_DOMAIN_ID names no domain.
        RosArgumentsError: ROS cannot take its arguments.
    """
    from automax_ros.ros.setup.environment import RosUnavailable, prepare

    try:
        prepare(discovery=arguments.discovery)
        from automax_ros.ros.setup.lock import domain_id

        ros_arguments(arguments).checked()
        return domain_id()
    except RosUnavailable as error:
        raise UsageError(str(error), hint) from error
