"""The namespace of a running rack, from its name, namespace, YAML file or folder."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

from automax_ros.core.text import quoted
from automax_ros.core.user_error import UsageError
from automax_ros.rackfile.model.ros_names import namespace
from automax_ros.ros.setup.arguments import NO_ARGUMENTS, RosArguments

if TYPE_CHECKING:
    from automax_ros.rackfile.model.config import RackConfig

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
