"""Start one rack: ros2 launch automax_ros rack.launch.py [config:=FILE] [simulated:=true] [duration:=SECONDS] ...

The launch arguments are those of `automax run`; `ros2 launch automax_ros rack.launch.py --show-args` lists them.
"""

from launch import LaunchContext, LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess, OpaqueFunction, Shutdown
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.substitutions import ExecutableInPackage, FindPackageShare

PACKAGE = "automax_ros"


def start_rack(context: LaunchContext) -> list[ExecuteProcess]:
    """`automax run` with the arguments that were given; an empty one is left to the program's own default."""

    def value(name: str) -> str:
        return LaunchConfiguration(name).perform(context)

    command = [ExecutableInPackage(package=PACKAGE, executable="automax"), "run", value("config")]
    if value("simulated") == "true":
        command.append("--simulated")
    for name in ("duration", "record"):
        if value(name):
            command += [f"--{name}", value(name)]
    # An emulated rack that has ended, by itself or by a fault, ends the launch.
    return [ExecuteProcess(cmd=command, name="rack", output="screen", on_exit=Shutdown())]


def generate_launch_description() -> LaunchDescription:
    """The launch arguments, then the rack."""
    example = PathJoinSubstitution([FindPackageShare(PACKAGE), "config", "section_drive", "rack.yaml"])
    yes_no = ["true", "false"]
    return LaunchDescription(
        [
            DeclareLaunchArgument("config", default_value=example, description="rack YAML file"),
            DeclareLaunchArgument(
                "simulated", default_value="false", choices=yes_no, description="simulated time, as fast as it goes"
            ),
            DeclareLaunchArgument("duration", default_value="", description="seconds to run; empty: until Ctrl-C"),
            DeclareLaunchArgument("record", default_value="", description="bag folder to record into; empty: none"),
            OpaqueFunction(function=start_rack),
        ]
    )
