"""Start one rack: ros2 launch automax_ros rack.launch.py [config:=FILE] [simulated:=true] [duration:=SECONDS] ...

The launch arguments are those of `automax run`; `ros2 launch automax_ros rack.launch.py --show-args` lists them.
"""

import shlex

from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess, OpaqueFunction, Shutdown
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.substitutions import ExecutableInPackage, FindPackageShare

PACKAGE = "automax_ros"
SWITCHES = {
    "simulated": "simulated time, as fast as it goes",
    "allow_outside": "let the rack file name task sources outside its own folder",
    "record_locals": "record locals and block states after every scan",
}
VALUES = {
    "duration": "seconds to run; empty: until Ctrl-C",
    "state": "folder that keeps non-volatile values; empty: next to the rack file",
    "stimuli": "file of what operator and process do, by rack time; empty: none",
    "report": "JSON file that says how the run ended; empty: none",
    "record": "bag folder to record into; empty: none",
    "record_split_mb": "megabytes after which the recording begins a new file; empty: one file",
    "record_split_s": "seconds after which the recording begins a new file; empty: one file",
    "record_compression": "zstd, lz4 or none; empty: zstd",
    "record_tasks": "tasks whose scans are recorded, such as SPEED,LINE; empty: all",
    "watch": "variables of the status line, such as REF%,RUN@; empty: the first published ones",
}


def start_rack(context: LaunchContext) -> list[ExecuteProcess]:
    """`automax run` with the arguments that were given; an empty one is left to the program's own default."""

    def value(name: str) -> str:
        return LaunchConfiguration(name).perform(context)

    command = [ExecutableInPackage(package=PACKAGE, executable="automax"), "run", value("config")]
    command += [_option(name) for name in SWITCHES if value(name) == "true"]
    for name in VALUES:
        if value(name):
            command += [_option(name), value(name)]
    for setting in shlex.split(value("set")):
        command += ["--set", setting]
    # An emulated rack that has ended, by itself or by a fault, ends the launch.
    return [ExecuteProcess(cmd=command, name="rack", output="screen", on_exit=Shutdown())]


def _option(name: str) -> str:
    return f"--{name.replace('_', '-')}"


def generate_launch_description() -> LaunchDescription:
    """The launch arguments, then the rack."""
    example = PathJoinSubstitution([FindPackageShare(PACKAGE), "config", "section_drive", "rack.yaml"])
    yes_no = ["true", "false"]
    return LaunchDescription(
        [
            DeclareLaunchArgument("config", default_value=example, description="rack YAML file"),
            DeclareLaunchArgument(
                "set", default_value="", description="common variables to write first, such as 'REF%=5 RUN@=1'"
            ),
            *(
                DeclareLaunchArgument(name, default_value="false", choices=yes_no, description=text)
                for name, text in SWITCHES.items()
            ),
            *(DeclareLaunchArgument(name, default_value="", description=text) for name, text in VALUES.items()),
            OpaqueFunction(function=start_rack),
        ]
    )
