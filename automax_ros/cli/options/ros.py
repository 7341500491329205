"""ROS 2 for a subcommand that needs it, and the ROS arguments of its command line."""

from __future__ import annotations

import argparse
import re
from pathlib import Path
from typing import TYPE_CHECKING

from automax_ros.cli.options.values import seconds_above_0
from automax_ros.core.text import quoted
from automax_ros.core.user_error import UsageError
from automax_ros.rackfile.model.ros_names import namespace
from automax_ros.ros.setup.arguments import NO_ARGUMENTS, RosArguments
from automax_ros.ros.setup.discovery import RANGES

if TYPE_CHECKING:
    from automax_ros.rackfile.model.config import RackConfig


DEFAULT_WAIT_S = "10"


def add_wait_argument(parser: argparse.ArgumentParser) -> None:
    """Add ``--wait``: how long a rack is looked for."""
    parser.add_argument(
        "--wait",
        type=seconds_above_0,
        metavar="S",
        default=DEFAULT_WAIT_S,
        help=f"seconds to look for the rack (default: {DEFAULT_WAIT_S})",
    )


def add_ros_arguments(parser: argparse.ArgumentParser) -> None:
    """Add ``--range``, and make the subcommand accept ``--ros-args`` as ``ros``."""
    parser.add_argument(
        "--range",
        choices=RANGES,
        dest="discovery",
        help="which hosts this program communicates with in its ROS domain (default: what "
        "ROS_AUTOMATIC_DISCOVERY_RANGE says, else this host)",
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


_SPACE = re.compile(r"/?[a-z][a-z0-9_]*(/[a-z][a-z0-9_]*){0,7}")


def names_file(text: str) -> bool:
    """Return whether a text names a rack's YAML file, or a folder with a ``rack.yaml``, rather than a rack."""
    path = Path(text)
    return path.suffix.lower() in {".yaml", ".yml"} or path.is_file() or _is_rack_folder(path)


def _is_rack_folder(path: Path) -> bool:
    if not path.is_dir():
        return False
    from automax_ros.cli.options.rack import is_rack_folder

    return is_rack_folder(path)


def config_of(path: Path) -> RackConfig:
    """Return the configuration of a rack's YAML file, or of the ``rack.yaml`` of a folder.

    Raises:
        UsageError: the file has errors, cannot be read or is a task.
    """
    # A rack given by its name needs none of these modules: loading them takes longer than the rack takes to answer.
    from automax_ros.cli.options.rack import load_rack_file
    from automax_ros.core.diagnostics import has_errors

    result = load_rack_file(path, allow_outside=True)
    if result.config is None or has_errors(result.diagnostics):
        raise UsageError(f"{path} is not a sound rack file", f"`automax check {path}` shows what is wrong")
    return result.config


def space_of(text: str, ros: RosArguments = NO_ARGUMENTS) -> str:
    """Return the namespace with its slash, such as ``/pm1``, of a rack's name, namespace, YAML file or folder.

    It is placed in the namespace that ROS arguments give, unless it begins with a slash.

    Raises:
        UsageError: the text is none of these.
    """
    if names_file(text):
        return f"/{ros.placed(config_of(Path(text)).namespace)}"
    space = text.strip().rstrip("/")
    if space and "/" not in space:
        space = namespace(space)
    if not _SPACE.fullmatch(space):
        raise UsageError(f"{quoted(text)} is neither a rack's name or namespace nor a YAML file or its folder")
    return space if space.startswith("/") else f"/{ros.placed(space)}"
