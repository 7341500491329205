"""Makes ROS 2 usable in this process: call prepare() before the first `import rclpy`.

Where ROS 2 is installed from the distribution, its setup script has set the environment and prepare() only checks that
the messages are there. In the virtual environment of `make setup` ROS 2 comes as wheels, and three things differ:

- AMENT_PREFIX_PATH does not name the environment; rclpy looks there for middleware and interfaces.
- The wheels' libraries lie in lib/ and site-packages/ros_*.libs of the environment. The loader reads LD_LIBRARY_PATH
  once, when a process starts, so the wheels bring site-packages/ros_wheels_bootstrapper.pth: each start of Python there
  sets that variable and executes the same command line again (os.execve with sys.orig_argv), before any program code.
  The process id, arguments, open files, standard input and exit code stay what they were; it takes about 30 ms.
- A variable tells the second start not to do it again. Child processes inherit it, so a Python of another such
  environment runs with foreign libraries; and the bootstrapper mixes its folders at random with those that it finds,
  so after `source /opt/ros/.../setup.bash` either installation may win. PYTHONPATH shadows the wheels likewise.

prepare() finds the last kind of trouble and cures it the way the wheels do: it starts the same command line once more,
with this environment's folders first. That is why it belongs at the very beginning of a program, before any input is
read or a thread is started. In an ordinary shell none of this happens.
"""

import importlib
import importlib.util
import os
import sys
import sysconfig
import tempfile
from pathlib import Path

from automax_ros.core.user_error import UserError
from automax_ros.messages.types.definitions import message_types
from automax_ros.ros.setup.discovery import announce_soon, choose_range

SETUP_COMMAND = "make setup"
COLCON_COMMAND = "colcon build --base-paths src src/automax_ros/msg_defs"
"""In a workspace as docs/howto/workspace.md lays it out: without the second path colcon does not see msg_defs/."""


# Set for the process that prepare() starts in place of this one: a second restart could not do better.
_RESTARTED = "AUTOMAX_ROS_RESTARTED"


class RosUnavailable(UserError):
    """ROS 2, its middleware or automax_msgs cannot be used here; the text names the command that helps."""


def prepare(*, may_restart: bool = True, discovery: str | None = None) -> None:
    """Set the environment up for rclpy and check that rclpy and automax_msgs can be imported.

    Args:
        discovery: the range of this process (``discovery.RANGES``); None keeps that of the environment, or this host
            if the environment has none (``discovery.choose_range``).
        may_restart: False where the process must not be replaced, such as in a test runner that captures output or in
            a notebook; an unsuitable environment is then an error.

    Raises:
        RosUnavailable: something is missing, or would have to be cured by a restart that is not allowed.
    """
    restarted = os.environ.pop(_RESTARTED, None) is not None
    put_prefix_first()
    choose_range(discovery)
    announce_soon()
    if not os.environ.get("HOME") and not os.environ.get("ROS_LOG_DIR"):
        # ROS wants a place for log files even where none are written; services often run without a home.
        os.environ["ROS_LOG_DIR"] = tempfile.gettempdir()
    if wheels_installed():
        changes = _needed_changes()
        if changes and may_restart and not restarted:
            sys.stdout.flush()
            sys.stderr.flush()
            os.execve(sys.executable, sys.orig_argv, {**os.environ, **changes, _RESTARTED: "1"})
        if changes:
            raise RosUnavailable(
                f"{' and '.join(changes)} of this shell lead to another ROS 2 installation: "
                f"start from a shell that has none sourced (unset {' '.join(changes)})"
            )
        # The wheels bring Fast DDS only, but the shell may be prepared for another middleware.
        name = os.environ.get("RMW_IMPLEMENTATION")
        if name and not (Path(sys.prefix) / "lib" / f"lib{name}.so").exists():
            raise RosUnavailable(
                f"RMW_IMPLEMENTATION={name} is not installed in {sys.prefix}: unset RMW_IMPLEMENTATION"
            )
    _check_imports()


def put_prefix_first() -> None:
    """Put this environment in front of AMENT_PREFIX_PATH if it holds ROS 2; no effect elsewhere."""
    prefix = Path(sys.prefix)
    if not (prefix / "share" / "ament_index" / "resource_index" / "packages" / "rclpy").exists():
        return
    others = [entry for entry in _entries("AMENT_PREFIX_PATH") if Path(entry) != prefix]
    os.environ["AMENT_PREFIX_PATH"] = os.pathsep.join([str(prefix), *others])


def wheels_installed() -> bool:
    """Whether ROS 2 in this environment comes from the PyPI wheels."""
    return importlib.util.find_spec("ros_wheels_bootstrapper") is not None


def _needed_changes() -> dict[str, str]:
    changes = {}
    libraries = _entries("LD_LIBRARY_PATH")
    own = _own_library_folders()
    # The order among our own folders does not matter: no library is in two of them.
    if set(libraries[: len(own)]) != set(own):
        foreign = [entry for entry in libraries if entry not in own]
        changes["LD_LIBRARY_PATH"] = os.pathsep.join([*own, *foreign])
    python = _entries("PYTHONPATH")
    clean = [entry for entry in python if not (Path(entry) / "rclpy").exists()]
    if clean != python:
        changes["PYTHONPATH"] = os.pathsep.join(clean)
    return changes


def _own_library_folders() -> list[str]:
    """The folders that the wheels' bootstrapper adds for this environment, spelled as it does."""
    site_packages = Path(sysconfig.get_path("purelib"))
    folders = (path for path in sorted(site_packages.glob("ros_*.libs")) if path.is_dir())
    return [os.path.join(sys.prefix, "lib"), *(str(path.resolve()) for path in folders)]


def _entries(variable: str) -> list[str]:
    return [entry for entry in os.environ.get(variable, "").split(os.pathsep) if entry]


def _check_imports() -> None:
    for module in ("rclpy", "automax_msgs.msg"):
        try:
            importlib.import_module(module)
        except ImportError as error:
            raise RosUnavailable(f"cannot import {module.partition('.')[0]} ({error}): {_cure()}") from error
    _check_messages()


def _check_messages() -> None:
    """Check automax_msgs: after an update of this package the installed one may be older."""
    for name, known in message_types().items():
        package, _, short = name.split("/")
        if package == "automax_msgs":
            kind = getattr(importlib.import_module(f"{package}.msg"), short, None)
            fields = [] if kind is None else list(kind.get_fields_and_field_types())
            if fields != [field.name for field in known.definition.fields]:
                raise RosUnavailable(f"automax_msgs is of another version than automax_ros ({short}): {_cure()}")


def _cure() -> str:
    if not wheels_installed() and os.environ.get("AMENT_PREFIX_PATH"):
        return f"run `{COLCON_COMMAND}` in the workspace and source install/setup.bash"
    return f"run `{SETUP_COMMAND}` and use the programs in .venv/bin"
